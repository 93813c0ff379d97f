"""The page stands alone, is well formed and accessible, and says what the evidence says."""

from __future__ import annotations

import io
import re
from functools import lru_cache
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise
from typing import Any

import pytest
from PIL import Image

from ringbalance.reports.figure import DARK, LIGHT
from ringbalance.reports.page import render
from ringbalance.reports.traced import evidence_at

Record = dict[str, Any]
VOID = {"meta", "link", "img", "br", "source", "col", "input", "hr"}


class Reader(HTMLParser):
    """Collects tags, and complains when they do not balance."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.faults: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> at {self.getpos()}")

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in {"style", "script"}:
            self.text.append(data)


@lru_cache(maxsize=8)
def read(page: str) -> Reader:
    """A page as read, shared: not to be changed."""
    reader = Reader()
    reader.feed(page)
    reader.close()
    return reader


def words(page: str) -> str:
    """All text of a page, spaces made plain."""
    return re.sub(r"\s+", " ", " ".join(read(page).text))


def ids_of(page: str) -> list[str]:
    return [str(attributes["id"]) for _, attributes in read(page).tags if "id" in attributes]


def both(evidence: Record) -> str:
    """Everything that report and annex say."""
    return " ".join(words(page) for page in render(evidence).values())


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_the_page_is_well_formed(pages: dict[str, str], name: str) -> None:
    reader = read(pages[name])
    assert reader.faults == []
    assert reader.open == []
    ids = ids_of(pages[name])
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_every_link_leads_somewhere(pages: dict[str, str], name: str) -> None:
    links = [str(a["href"]) for tag, a in read(pages[name]).tags if tag in {"a", "use"} and "href" in a]
    assert links
    for link in links:
        file, _, fragment = link.partition("#")
        assert not fragment or fragment in ids_of(pages[file or name]), link
        assert (file or name) in pages or file.startswith("tables/"), link


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_the_page_needs_nothing_else(pages: dict[str, str], name: str) -> None:
    page = pages[name]
    bare = page.replace('xmlns="http://www.w3.org/2000/svg"', "").replace(
        'xmlns:xlink="http://www.w3.org/1999/xlink"', ""
    )
    assert not re.search(r"https?:|//[a-z]+\.|<script|<link|@import|@font-face|<iframe", bare)
    for tag, attributes in read(page).tags:
        for name in ("src", "srcset", "href", "xlink:href"):
            value = attributes.get(name)
            inside = value is None or value.partition("#")[0] in {"", *pages}
            assert inside or str(value).startswith("data:image/webp;base64,"), (tag, value)
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", page))


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_headings_come_in_order(pages: dict[str, str], name: str) -> None:
    levels = [int(tag[1]) for tag, _ in read(pages[name]).tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels.count(1) == 1
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


def pictures() -> tuple[Record, dict[str, bytes]]:
    """Record and bytes of two pictures in two schemes."""
    names = ("disc", "pressure")
    listed = [
        {
            "name": name,
            "light": f"{name}-light.png",
            "dark": f"{name}-dark.png",
            "width": 3,
            "height": 2,
        }
        for name in names
    ]
    png = io.BytesIO()
    Image.new("RGB", (3, 2)).save(png, format="PNG")
    contents = {f"{name}-{theme}.png": png.getvalue() for name in names for theme in ("light", "dark")}
    shown = {"chambers": 4, "fill_ratio": 0.25, "largest_fill_ratio": 0.5, "crest_radius_m": 0.0315}
    return {"drawn": True, "text": "", "files": listed, "shown": shown | {"speed_rad_s": 1047.2}}, contents


@pytest.mark.usefixtures("unwritten")
def test_pictures_come_in_both_schemes_and_can_be_read_aloud(evidence: Record) -> None:
    evidence["pictures"], contents = pictures()
    page = render(evidence, pictures=contents)["annex.html"]
    assert page.count('<source media="screen and (prefers-color-scheme: dark)"') == 2
    assert page.count("data:image/webp;base64,") == 4
    alts = [str(attributes.get("alt")) for tag, attributes in read(page).tags if tag == "img"]
    assert "chambers A to D" in alts[0]
    assert len(alts) == 2
    assert "over its siphon crest at a radius of 31.5 mm" in words(page).replace("\u202f", " ")
    evidence["pictures"]["shown"]["crest_radius_m"] = None
    assert "drawn schematically, straight across" in words(render(evidence, pictures=contents)["annex.html"])


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_tables_and_drawings_can_be_read_aloud(pages: dict[str, str], name: str) -> None:
    tags = read(pages[name]).tags
    assert all(attributes.get("scope") for tag, attributes in tags if tag == "th")
    assert all(a.get("aria-label") or a.get("aria-hidden") for tag, a in tags if tag == "svg")
    labels = [a["aria-labelledby"] for tag, a in tags if tag == "div" and a.get("role") == "img"]
    assert set(labels) <= {*ids_of(pages[name])}
    assert len(labels) == len([a for tag, a in tags if tag == "div" and a.get("class") == "drawing"]) > 0
    assert [a.get("lang") for tag, a in tags if tag == "html"] == ["en"]
    assert all(a.get("aria-labelledby") for tag, a in tags if tag == "section")


def test_without_pictures_the_page_says_so(evidence: Record, annex: str) -> None:
    assert evidence["pictures"]["text"] in words(annex)
    assert "<img" not in annex


def test_the_same_evidence_gives_the_same_pages(evidence: Record, pages: dict[str, str]) -> None:
    assert render(evidence) == pages


CHANGES: tuple[tuple[tuple[Any, ...], Any, str], ...] = (
    (("calibration", "quantities", "lambda", "value"), 0.07224, "72.24"),
    (("calibration", "quantities", "drag_coefficient", "value"), 7.77, "7.8"),
    (("calibration", "quantities", "stall_pressure", "value"), 0.379e6, "0.379"),
    (("paper", "drag_coefficient"), 41.0, "about 41"),
    (("closed_loop", "calibrated", "settling_time_s"), 9.87, "9.87"),
    (("closed_loop", "paper", "overshoots"), 1717, "1717"),
    (("closed_loop", "calibrated", "loop_factor"), 1.234, "1.23"),
    (("summary", "own", "fraction", "value"), 0.612, "61 %"),
    (("verification", 1, "quantities", 0, "value"), 2.345e5, "0.23450"),
    (("verification", 1, "consequence"), "Use the other formula.", "Use the other formula."),
    (("verification", 0, "doubts"), ["Nobody has seen it."], "Nobody has seen it."),
    (("scene", "name"), "Another disc", "Another disc"),
    (("scene", "sha256"), "cd" * 32, "cd" * 32),
    (("scene", "values_sha256"), "dc" * 32, "dc" * 32),
    (("scene", "table", 0, "origin"), "handbook", "handbook"),
    (("versions", "numpy"), "9.9.9", "9.9.9"),
    (("pressure", "mesh", "unknowns"), 12345, "12 345"),
    (("calibration", "models_used", 0, "estimated_contribution"), 0.0777, "7.8 %"),
    (("calibration", "chamber", "moment_kg_m", 3), 456.78e-6, "456.78"),
    (("times", "date"), "2031-12-24", "2031-12-24"),
)


@pytest.mark.usefixtures("unwritten")
def test_the_pages_say_what_the_evidence_says(evidence: Record) -> None:
    before = both(evidence).replace("\u202f", " ")
    for path, value, said in CHANGES:
        evidence_at(evidence, ".".join(map(str, path[:-1])))[path[-1]] = value
        assert said not in before
    after = both(evidence).replace("\u202f", " ")
    assert [said for _, _, said in CHANGES if said not in after] == []


def test_no_result_is_typed_into_a_template() -> None:
    for item in files("ringbalance.reports").joinpath("templates").iterdir():
        if item.name.endswith(".html"):
            template = re.sub(r"(?s)<(script|style)\b.*?</\1>", " ", item.read_text(encoding="utf-8"))
            # Quotations of the paper are marked as such.
            template = re.sub(r'(?s)<span class="printed">.*?</span>', " ", template)
            text = re.sub(r"(?s)\{[{%#].*?[}%#]\}|<[^>]+>", " ", template)
            # Nor are numbers of equations, figures, standards, valves and levels of credibility.
            text = re.sub(r"(?:Eq|Fig)s?\. \d+(?: (?:and|to) \d+)?|API \d+|\b[35]/2 valve|\b\d ::", " ", text)
            numbers = re.findall(r"(?<![\w-])\d+(?:\.\d+)?(?![\w-])", text)
            # Levels of confidence and numbers of dimensions are no results.
            assert set(numbers) <= {"95", "5", "3"}, (item.name, numbers)


@pytest.mark.parametrize("name", ["report.html", "annex.html"])
def test_numbers_of_figures_tables_and_equations_stand_in_the_text(pages: dict[str, str], name: str) -> None:
    prefix = "A" if name == "annex.html" else ""
    for kind, form in (("Figure", r"<b>Figure ([A\d]+)\.</b>"), ("Table", r"<b>Table ([A\d]+)\.</b>")):
        found = re.findall(form, pages[name])
        assert found == [f"{prefix}{fragment}" for fragment in range(1, len(found) + 1)], kind
    sections = re.findall(r'<h2 id="[\w]+-title"><span class="no">([A\d]+)</span>', pages[name])
    assert sections == [f"{prefix}{fragment}" for fragment in range(1, len(sections) + 1)]
    assert pages[name].count("<caption") == len(re.findall(r"<b>Table", pages[name]))


def test_a_link_to_a_case_opens_its_box(pages: dict[str, str]) -> None:
    """A place inside a closed box is opened by the browser on the way to it; one outside is not."""
    links = set(re.findall(r'href="(?:annex\.html)?#(case-[\w-]+)"', "".join(pages.values())))
    assert links
    boxes = re.findall(
        r'<details class="case-box"><summary>[^<]+</summary><div id="(case-[\w-]+)">', pages["annex.html"]
    )
    assert links <= set(boxes)


@pytest.mark.usefixtures("unwritten")
def test_what_was_not_run_is_said(evidence: Record) -> None:
    evidence["verification"][-1]["status"] = "heavy: run with --level heavy"
    evidence["closed_loop"] = {}
    text = both(evidence)
    assert "Coverage of the bars" in text
    assert "heavy: run with --level heavy" in text
    assert "Trial algorithm in 40 s" in text
    assert "The closed loop was not run." in text


@pytest.mark.usefixtures("unwritten")
def test_markup_in_texts_is_shown_not_obeyed(evidence: Record) -> None:
    evidence["scene"]["name"] = '<b onclick="x()">disc</b> & "co"'
    evidence["verification"][0]["doubts"] = ["<script>alert()</script>"]
    for page in render(evidence).values():
        assert "<b onclick" not in page
        assert "<script" not in page


@pytest.mark.usefixtures("unwritten")
def test_nothing_flows(evidence: Record) -> None:
    calibration = evidence["calibration"]
    calibration["regime"] = "blocked"
    evidence_at(evidence, "calibration.quantities.velocity")["value"] = 0.0
    calibration["quantities"] = [q for q in calibration["quantities"] if q["key"] != "drag_coefficient"]
    text = both(evidence)
    assert "nothing flows" in text
    assert "lifts the liquid over the siphon crest" not in text


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first: str, second: str) -> float:
    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def schemes() -> list[dict[str, str]]:
    """Colours of the light and of the dark page."""
    css = files("ringbalance.reports").joinpath("templates", "style.css").read_text(encoding="utf-8")
    blocks = re.findall(
        r":root \{(.*?)\}\s",
        css.replace("{{ figure_light }}", "").replace("{{ figure_dark }}", ""),
        re.DOTALL,
    )
    return [dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6});", block)) for block in blocks]


def test_text_stands_out_from_its_ground() -> None:
    for scheme, figure in zip(schemes(), (LIGHT, DARK), strict=True):
        for ground in ("--bg", "--panel"):
            for ink in ("--ink", "--soft", "--muted", "--accent"):
                assert contrast(scheme[ink], scheme[ground]) >= 4.5, (ink, ground)
        for tone in ("good", "fair", "bad", "open", "idle"):
            assert contrast(scheme[f"--{tone}"], scheme[f"--{tone}-bg"]) >= 4.5, tone
        for name, colour in figure.items():
            # No text and no line has a shade of the colour map.
            if name not in {"--fig-grid", "--fig-surface"} and not name.startswith("--fig-map-"):
                assert contrast(colour, scheme["--bg"]) >= 4.5, name
        assert contrast(figure["--fig-paper"], scheme["--panel"]) >= 4.5


def test_pictures_have_the_ground_of_the_page() -> None:
    assert [colours["--fig-surface"] for colours in (LIGHT, DARK)] == [scheme["--bg"] for scheme in schemes()]
