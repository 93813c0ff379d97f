"""Browsers of the tests of pages, each started once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from browsers import Firefox, watched_page
from playwright.sync_api import Browser, Page, sync_playwright


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """Debian's Chromium, without a window."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium")
        yield browser
        browser.close()


OpenPage = Callable[..., Page]


@pytest.fixture
def open_page(chromium: Browser) -> Iterator[OpenPage]:
    """Open a file as a page: `open_page(path, fragment="#...", size="phone")`.

    The test fails if the page raises an error, writes one to the console, or asks for anything.
    """
    with ExitStack() as stack:
        every: list[str] = []

        def opened(path: Path, *, fragment: str = "", size: str = "desktop") -> Page:
            page, faults = stack.enter_context(
                watched_page(chromium, path.resolve().as_uri() + fragment, size=size)
            )
            stack.callback(lambda: every.extend(faults))
            return page

        yield opened
        stack.close()
        assert every == []


@pytest.fixture(scope="session")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """Debian's Firefox, without a window."""
    browser = Firefox(tmp_path_factory.mktemp("firefox"))
    yield browser
    browser.close()
