"""A small evidence document of the documented shape: for testing the page, not the physics."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import pytest
from matplotlib.figure import Figure
from report_texts import page_text

from ringbalance.reports.page import page_content, render, render_pages
from ringbalance.reports.sections import CASES_VIEW, sections_of, view_of


@pytest.fixture
def unwritten(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are painted but not written out, which takes most of a page: for tests that read its text."""

    def savefig(_: object, buffer: IO[str], **__: object) -> None:
        buffer.write('<svg ><path d="M 0 0" /></svg>')

    monkeypatch.setattr(Figure, "savefig", savefig)


@pytest.fixture
def said(request: pytest.FixtureRequest) -> Callable[[dict[str, Any], str], str]:
    """The text of one section's page, without the other sections."""
    request.getfixturevalue("unwritten")

    def text(evidence: dict[str, Any], name: str) -> str:
        views = dict.fromkeys(sections_of(evidence["balancer"]))
        shown = {each: view_of(each, evidence) for each in (name, CASES_VIEW)}
        content = page_content(evidence, views={**views, **shown})
        file = f"{content.context['sections'][0]['document']}.html"
        return page_text(render_pages(content, documents=(file,))[file])

    return text


@pytest.fixture
def evidence() -> dict[str, Any]:
    """A whole evidence document, fresh for each test."""
    return document()


@pytest.fixture(scope="session")
def sample() -> dict[str, Any]:
    """A shared evidence document: not to be changed."""
    return document()


@pytest.fixture(scope="session")
def pages() -> dict[str, str]:
    """Report and annex of that document, without 3-D pictures."""
    return render(document())


@pytest.fixture(scope="session")
def page(pages: dict[str, str]) -> str:
    """The report of that document."""
    return pages["report.html"]


@pytest.fixture(scope="session")
def annex(pages: dict[str, str]) -> str:
    """The annex of that document."""
    return pages["annex.html"]


def document() -> dict[str, Any]:
    """A whole evidence document."""
    sample: dict[str, Any] = json.loads(Path(__file__).with_name("sample.json").read_text(encoding="utf-8"))
    return sample
