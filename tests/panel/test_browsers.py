"""The fixtures see what they are to see."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from browsers import SIZES, Firefox, accessibility_violations, watched_page
from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.panel
GOOD = """<!doctype html><html lang="en"><meta charset="utf-8"><title>A page</title>
<main><h1>A page</h1><label>Gain <input type="range" id="gain" min="0" max="10" value="5"></label></main>
<script>document.title = "run"; var width = innerWidth;</script></html>"""
BAD = """<!doctype html><meta charset="utf-8"><title>x</title><img src="http://example.invalid/a.png">
<script>console.error("told"); fetch("http://example.invalid/b").catch(() => 0); nothing.here;</script>"""


@pytest.mark.parametrize("size", SIZES)
def test_a_page_from_a_file(tmp_path: Path, open_page: Callable[..., Page], size: str) -> None:
    (tmp_path / "a.html").write_text(GOOD)
    page = open_page(tmp_path / "a.html", fragment="#x=1", size=size)
    assert page.title() == "run"
    assert page.evaluate("width") == SIZES[size][0]
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowRight")
    assert page.input_value("#gain") == "6"
    assert accessibility_violations(page) == []


def test_faults_are_noted(tmp_path: Path, chromium: Browser) -> None:
    (tmp_path / "a.html").write_text(BAD)
    with watched_page(chromium, (tmp_path / "a.html").as_uri()) as (page, faults):
        page.wait_for_load_state()
        assert "told" in faults
        assert "request: http://example.invalid/a.png" in faults
        assert "request: http://example.invalid/b" in faults
        assert any("nothing is not defined" in each for each in faults)
        broken = accessibility_violations(page)
    assert {each.partition(":")[0] for each in broken} >= {"html-has-lang", "image-alt"}


def test_firefox(tmp_path: Path, firefox: Firefox) -> None:
    (tmp_path / "good.html").write_text(GOOD)
    (tmp_path / "bad.html").write_text(BAD)
    firefox.open((tmp_path / "good.html").as_uri())
    assert firefox.run("return document.title") == "run"
    assert firefox.messages() == []
    firefox.open((tmp_path / "bad.html").as_uri())
    assert any("nothing is not defined" in each for each in firefox.messages())
