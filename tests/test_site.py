"""The site of the documentation builds without a warning, is whole, and asks for nothing from elsewhere."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

import pytest

ROOT: Final = Path(__file__).resolve().parents[1]
BROWSER: Final = shutil.which("chromium") or shutil.which("google-chrome")
IN_STYLE: Final = re.compile(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)")
IN_SCRIPT: Final = re.compile(
    r"""(?:\bfrom\s*|\bimport\s*\(?\s*|fetch\(\s*|importScripts\(\s*|\.src\s*=\s*)["'`]([^"'`]+)["'`]"""
)


class References(HTMLParser):
    """Addresses that a page loads by itself, and targets of its links."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.names: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in {"id", "name"} and value:
                self.names.add(value)
            elif name in {"src", "href", "srcset", "poster", "data", "action"} and value:
                (self.links if tag == "a" or value.startswith("#") else self.loads).append(value)
            elif name == "style" and value:
                self.loads += styled(value)


def styled(text: str) -> list[str]:
    """Addresses that a style sheet loads; a picture within it loads nothing."""
    places = (first or second for first, second in IN_STYLE.findall(text))
    return [url for url in places if not url.startswith(("data:", "#"))]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    recipe = re.search(r"-m sphinx (.*) build/site$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert recipe is not None
    options = recipe[1].split()
    assert "-W" in options
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, "-d", str(folder / "doctrees"), str(folder / "html")],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, References]:
    return {path: References(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}


def test_every_document_is_a_page(site: Path) -> None:
    documents = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    assert len(documents) > 20
    assert [
        path for path in documents if not (site / path.relative_to(ROOT)).with_suffix(".html").exists()
    ] == []
    assert (site / "index.html").read_bytes() == (site / "README.html").read_bytes()


def loaded(site: Path, pages: dict[Path, References]) -> Iterator[tuple[Path, str]]:
    """All that pages, style sheets and scripts load, with the file that names it."""
    for path, references in pages.items():
        yield from ((path, url) for url in references.loads)
    for path in site.rglob("*.css"):
        yield from ((path, url) for url in styled(path.read_text(encoding="utf-8")))
    for path in site.rglob("*.js"):
        yield from ((path, url) for url in IN_SCRIPT.findall(path.read_text(encoding="utf-8")))


def test_no_request_leaves_the_site(site: Path, pages: dict[Path, References]) -> None:
    places = list(loaded(site, pages))
    assert len(places) > 100
    outside = [(path, url) for path, url in places if urlsplit(url).scheme or url.startswith("//")]
    assert outside == []
    lacking = [
        (path, url)
        for path, url in places
        if path.suffix != ".js" and not (path.parent / unquote(urlsplit(url).path)).exists()
    ]
    assert lacking == []


def test_links_within_the_site_lead_somewhere(pages: dict[Path, References]) -> None:
    lacking = []
    for path, references in pages.items():
        for link in map(urlsplit, references.links):
            target = (path.parent / unquote(link.path)).resolve() if link.path else path
            if not link.scheme and not (
                target.exists() and (not link.fragment or unquote(link.fragment) in names(target, pages))
            ):
                lacking.append((path.name, link.geturl()))
    assert lacking == []


def names(target: Path, pages: dict[Path, References]) -> set[str]:
    """Names within a page to which links may lead."""
    return pages[target].names | {""} if target in pages else set()


@pytest.mark.parametrize(
    "text",
    [
        '<img src="https://example.org/a.png">',
        '<link rel="stylesheet" href="//example.org/a.css">',
        '<div style="background: url(https://example.org/a.png)">',
    ],
)
def test_a_request_is_seen(text: str, site: Path) -> None:
    page = {site / "x.html": References(text)}
    assert any("example.org" in url for _, url in loaded(site, page))
    assert styled("@import 'https://example.org/a.css'; b { c: url(\"d.svg\") }") == [
        "https://example.org/a.css",
        "d.svg",
    ]
    assert IN_SCRIPT.findall('import "https://a.b/c.js"; fetch("https://a.b/d")') == [
        "https://a.b/c.js",
        "https://a.b/d",
    ]


def requested(page: Path, folder: Path) -> list[str]:
    """Requests over a network that a page causes in a browser for which no host has an address."""
    log = folder / "network.json"
    # Root may not use the sandbox of this browser; the page is this program's own.
    subprocess.run(
        [
            *(str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", f"--log-net-log={log}"),
            *("--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={folder / 'browser'}"),
            *("--virtual-time-budget=3000", "--dump-dom", page.as_uri()),
        ],
        capture_output=True,
        timeout=240,
        check=True,
    )
    events = [each.get("params", {}) for each in json.loads(log.read_text(encoding="utf-8"))["events"]]
    # What the browser asks for by itself has no origin.
    return [
        each["url"]
        for each in events
        if "url" in each and each.get("initiator", "not an origin") != "not an origin"
    ]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_a_browser_asks_for_nothing(site: Path, tmp_path: Path) -> None:
    for name in ("index.html", "docs/how-it-works.html", "search.html"):
        assert requested(site / name, tmp_path) == []
    leaking = tmp_path / "leaking.html"
    leaking.write_text('<img src="https://example.org/a.png">', encoding="utf-8")
    assert "https://example.org/a.png" in requested(leaking, tmp_path)


def test_an_equation_within_a_line_stands_on_its_line(site: Path) -> None:
    page = (site / "docs" / "how-it-works.html").read_text(encoding="utf-8")
    depths = [float(depth) for depth in re.findall(r'<svg style="vertical-align: (-?[\d.]+)px"', page)]
    assert len(depths) > 20
    # Of r at least the margin of the picture; of a fraction the lower half of it.
    assert max(depths) <= -1.0
    assert min(depths) < -5.0
