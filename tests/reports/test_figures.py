"""Figures are reproduced to the byte, carry no colour of their own, and show the evidence's numbers."""

from __future__ import annotations

import re
from typing import Any, get_args
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from ringbalance.reports.figure import LIGHT, MUTED, Drawing, decade, plain_number
from ringbalance.reports.figure import curve as band_of
from ringbalance.reports.page import page_content
from ringbalance.reports.pages.cases import _series_plot
from ringbalance.verification.evidence import CurveStyle

Record = dict[str, Any]


@pytest.fixture(scope="module")
def drawings(sample: Record) -> dict[str, Drawing]:
    found = page_content(sample).drawings
    assert len({drawing.name for drawing in found}) == len(found)
    return {drawing.name: drawing for drawing in found}


def curve(drawing: Drawing, stroke: str) -> list[tuple[float, float]]:
    """Points of the longest line of a colour, in the figure's own coordinates."""
    pattern = rf'<path d="([^"]+)"[^>]*style="[^"]*stroke: var\({stroke}\)'
    lines = [re.findall(r"[ML] ([\d.-]+) ([\d.-]+)", path) for path in re.findall(pattern, drawing.svg)]
    return [(float(x), float(y)) for x, y in max(lines, key=len)]


def test_no_colour_font_date_or_size_is_fixed(drawings: dict[str, Drawing]) -> None:
    for drawing in drawings.values():
        assert not re.search(
            r"#[0-9a-fA-F]{3,8}\b(?![-\w])", re.sub(r'(href="|url\()#[^")]+', "", drawing.svg)
        ), drawing.name
        assert not re.search(r"\bblack\b|\bwhite\b|rgb\(|DejaVu|<dc:date|<metadata", drawing.svg), (
            drawing.name
        )
        assert not re.search(r"<svg[^>]* (width|height)=", drawing.svg)


@pytest.mark.parametrize(
    ("medium", "least", "widths"), [("screen", 12.0, (356, 740)), ("print", 8.0, (238, 498))]
)
def test_the_smallest_letters_can_be_read(
    drawings: dict[str, Drawing], medium: str, least: float, widths: tuple[int, int]
) -> None:
    """In px at the least width that the style sheet leaves a figure, in pt on A4; half and whole width."""
    for drawing in drawings.values():
        box = re.search(r'viewBox="0 0 ([\d.]+)', drawing.svg)
        sizes = [float(size) for size in re.findall(r"font(?:-size)?: (?:\w+ )?([\d.]+)px", drawing.svg)]
        if box and sizes:
            assert min(sizes) * widths[drawing.wide] / float(box[1]) >= least, (drawing.name, medium)


def test_every_figure_is_well_formed(drawings: dict[str, Drawing]) -> None:
    for drawing in drawings.values():
        ElementTree.fromstring(drawing.svg)
        ElementTree.fromstring(drawing.standalone().encode())


def test_ids_are_unique_across_the_page(drawings: dict[str, Drawing]) -> None:
    ids = [found for drawing in drawings.values() for found in re.findall(r'\bid="([^"]+)"', drawing.svg)]
    assert len(ids) == len(set(ids))
    for drawing in drawings.values():
        wanted = re.findall(r'(?:href="|url\()#([^")]+)', drawing.svg)
        assert set(wanted) <= set(ids)


def test_a_file_of_its_own_has_its_colours(drawings: dict[str, Drawing]) -> None:
    """Outside a browser nothing knows style sheet variables: such a figure is drawn black."""
    for drawing in drawings.values():
        text = drawing.standalone()
        assert "var(" not in text, drawing.name
        used = {name for name in LIGHT if f"var({name})" in drawing.svg}
        assert {name for name in used if LIGHT[name] not in text} == set(), drawing.name
        root = ElementTree.fromstring(text.encode())
        assert {"width", "height", "viewBox"} <= set(root.attrib)
    assert LIGHT["--fig-found"] in drawings["drag"].standalone()


def test_equation_12_lies_below_the_finite_elements(drawings: dict[str, Drawing]) -> None:
    found, printed = (curve(drawings["pressure-profile"], name) for name in ("--fig-found", "--fig-paper"))
    # SVG counts downward; both end at the wall, and both rise towards it.
    assert found[-1][0] == pytest.approx(printed[-1][0])
    assert found[-1][1] < printed[-1][1]
    assert found[0][0] < printed[0][0]


def test_the_points_are_the_evidence(evidence: Record, drawings: dict[str, Drawing]) -> None:
    line = curve(drawings["moment"], "--fig-found")
    values = evidence["calibration"]["chamber"]["moment_kg_m"]
    heights = [line[0][1] - y for _, y in line]
    assert len(line) == len(values)
    assert [h / heights[-1] for h in heights] == pytest.approx([v / values[-1] for v in values], abs=1e-3)


CHANGES: dict[str, tuple[Any, ...]] = {
    "drag": ("calibration", "tube", "k", 5),
    "flow-law-0": ("flow_law", "velocity_m_s", 0, 5),
    "amplitude": ("closed_loop", "paper", "amplitude_m", 12),
    "order-manufactured-pressure": ("verification", 6, "convergence", 0, "error", 1),
}


def test_other_numbers_are_other_figures(evidence: Record, drawings: dict[str, Drawing]) -> None:
    for path in CHANGES.values():
        parent: Any = evidence
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] *= 1.3
    changed = {
        drawing.name
        for drawing in page_content(evidence).drawings
        if drawing.svg != drawings[drawing.name].svg
    }
    assert set(CHANGES) <= changed
    assert "moment" not in changed


def test_a_gap_in_a_series_is_no_number() -> None:
    series = {
        "name": "speed",
        "x": {"name": "time", "unit": "s", "values": [0.0, 1.0, 2.0, 3.0]},
        "y": [{"name": "found", "unit": "m/s", "values": [1.0, None, 2.0, 3.0], "style": "found"}],
        "log": False,
    }
    drawing = _series_plot("some-case", series)
    assert "nan" not in drawing.svg.lower()


@pytest.mark.parametrize("kind", get_args(CurveStyle))
def test_every_style_of_a_curve_can_be_drawn(kind: str) -> None:
    series = {
        "name": "speed",
        "x": {"name": "time", "unit": "s", "values": [0.0, 1.0]},
        "y": [{"name": "found", "unit": "m/s", "values": [1.0, 2.0], "style": kind}],
    }
    drawing = _series_plot("some-case", series)
    assert "found" in drawing.svg


def test_tick_labels_are_plain_text() -> None:
    assert [plain_number(v) for v in (0.0, 0.05, -8.0, 250.0, 1e-7)] == [
        "0",
        "0.05",
        "−8",
        "250",
        "1\u202f×\u202f10⁻⁷",
    ]
    assert [decade(v) for v in (1e-3, 2e-3, 1.0)] == ["10⁻³", "", "10⁰"]


def test_every_figure_has_its_caption(pages: dict[str, str]) -> None:
    captions = re.findall(
        r"<figcaption[^>]*><b>[^<]*</b> (.*?)</figcaption>", "".join(pages.values()), flags=re.DOTALL
    )
    assert captions
    assert all(len(caption) > 10 for caption in captions)


def test_a_band_is_one_half_width_to_either_side() -> None:
    """About a line at three, two down and one up where that is the half-width."""
    axes = Figure().add_subplot()
    band_of([0.0, 1.0], [3.0, 3.0], band=[2.0, 1.0], color=MUTED)(axes)
    corners = {tuple(corner) for corner in np.asarray(axes.collections[0].get_paths()[0].vertices)}
    assert corners == {(0.0, 1.0), (0.0, 5.0), (1.0, 2.0), (1.0, 4.0)}
