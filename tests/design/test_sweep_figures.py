"""Figures of a sweep: maps over two keys and more, feasible points and the nearest."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba_array
from PIL import Image

import ringbalance as rb
from ringbalance.design.static import EMPTY
from ringbalance.design.sweep import Sweep
from ringbalance.reports.figure import LIGHT_RAMP
from ringbalance.reports.sweep_figures import sweep_drawings
from ringbalance.scene.models import Scene

VARY = {"tube.bore": [1e-3, 1.2e-3, 2e-3], "gas.pressure": "0.2MPa:0.8MPa:4"}
STEMS = ["sweep-reach", "sweep-velocity", "sweep-loop-factor"]
MOST_BYTES = 80_000
"""Of a map of 2,000 points: ten fit a page of 1 MB; one number of four digits a point takes 10 kB."""


@pytest.fixture(scope="module")
def sweep(paper_scene: Scene) -> Sweep:
    return rb.sweep(paper_scene, VARY, intervals=False)


def embedded(svg: str) -> list[Image.Image]:
    """Pictures in an SVG text, the map before its colour bar."""
    packed = re.findall(r'href="data:image/png;base64,([^"]+)"', svg)
    return [Image.open(io.BytesIO(base64.b64decode(each))) for each in packed]


def texts(svg: str) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


def test_a_map_is_drawn_for_the_page_and_for_a_column(sweep: Sweep, tmp_path: Path) -> None:
    files = sweep.plot(tmp_path)
    assert [path.stem for path in files] == [*STEMS, *(f"{stem}-85mm" for stem in STEMS), "figures"]
    assert "not feasible: no flow" in texts(files[0].read_text())
    for file, inches in zip(files[:-1], [7.5] * 3 + [85 / 25.4] * 3, strict=True):
        width = re.search(r'<svg [^>]*width="([\d.]+)pt"', file.read_text())
        assert width is not None
        # The viewBox is written with six digits.
        assert float(width[1]) == pytest.approx(72 * inches, abs=1e-3)
        sizes = re.findall(r"font(?:-size)?: (?:\w+ )?([\d.]+)px", file.read_text())
        assert min(map(float, sizes)) >= 7, "smaller letters are hard to read in print"


def test_long_labels_stay_within_a_column(paper_scene: Scene) -> None:
    """Labels of y-axes and colour bars, over several lines where one is too long, and notes on other axes."""
    runs = {"devices": 64, "fraction": 0.5, "settling_time": 12.0, "verdict": "not met", "finding": None}
    for vary in (VARY, {"tube.bore": "1mm:2mm:3", "tube.entrance": ["sharp", "rounded"]}):
        still = rb.sweep(paper_scene, vary, intervals=False)
        driven = tuple({**EMPTY, **runs, "fraction": i / 99} for i in range(len(still.points)))
        for drawing in sweep_drawings(replace(still, runs=64, driven=driven), width=85 / 25.4):
            svg = drawing.standalone()
            upright = re.findall(r'"translate\(([\d.]+) ([\d.]+)\) rotate\(-90\)">([^<]+)<', svg)
            middle = re.findall(r' x="([\d.]+)" y="([\d.]+)" transform="rotate\(-90[^>]+>([^<]+)<', svg)
            assert upright or middle
            for x, bottom, text in upright:
                assert 8 <= float(x) <= 72 * 85 / 25.4 - 2, text
                # Letters are about half as wide as they are high.
                assert float(bottom) - 0.6 * 8.8 * len(text) > 0, text
            assert all(8 <= float(x) <= 72 * 85 / 25.4 - 2 for x, _, _ in middle)
            assert max(map(len, texts(svg))) <= 46


def test_each_cell_has_the_colour_of_its_value_and_the_bar_one_unit(sweep: Sweep) -> None:
    svg = sweep_drawings(sweep)[0].standalone()
    values = np.array(sweep.columns()["reach [kg m]"]).reshape(3, 4)
    low, high = values.min(), values.max()
    picture = np.asarray(embedded(svg)[0].convert("RGB"), dtype=float)
    # Cells lie half-way between 1, 1.2 and 2 mm: they end at 0.9, 1.1, 1.6 and 2.4 mm.
    for column, bore in enumerate((1.0, 1.2, 2.0)):
        for row in range(4):
            pixel = int(len(picture) * (row + 0.5) / 4), int(picture.shape[1] * (bore - 0.9) / 1.5)
            expected = 255 * to_rgba_array(LIGHT_RAMP((values[column, row] - low) / (high - low)))[0, :3]
            # Half a step of 256 colours and of a byte each.
            assert np.abs(picture[pixel] - expected).max() <= 2, (bore, row)
    assert [text for text in texts(svg) if text.endswith(" in g\u202fmm")]
    assert not re.search(r"light|dark|kg m", " ".join(texts(svg)))


def test_contour_lines_name_levels_of_the_bar(paper_scene: Scene) -> None:
    """Velocity grows with the pressure: lines lie at the round numbers of the bar, in its unit."""
    sweep = rb.sweep(
        paper_scene, {"tube.bore": "1mm:2mm:9", "gas.pressure": "0.5MPa:0.8MPa:9"}, intervals=False
    )
    velocities = sweep.columns()["velocity [m/s]"]
    svg = sweep_drawings(sweep)[1].svg
    bar = svg[svg.index('id="sweep-velocity-axes_2"') :]
    levels = [text for text in texts(bar) if re.fullmatch(r"[\d.]+", text)]
    lines = [text for text in texts(svg[: -len(bar)]) if text in levels]
    assert len({*lines}) >= 3
    assert all(min(velocities) < float(text) < max(velocities) for text in levels)


def test_a_map_of_many_points_stays_small(paper_scene: Scene) -> None:
    grid = {"tube.bore": "0.5mm:2mm:50", "gas.pressure": "0.2MPa:0.8MPa:40"}
    ranges = {path: text.rpartition(":")[0] for path, text in grid.items()}
    for vary, sample in ((grid, ""), (ranges, "sobol:2048")):
        table = rb.sweep(paper_scene, vary, sample=sample, intervals=False)
        for drawing in sweep_drawings(table):
            assert len(drawing.standalone()) <= MOST_BYTES, (drawing.name, sample)


def test_a_cell_without_value_is_hatched_and_explained(sweep: Sweep) -> None:
    """A scene that is refused is distinguished from one without flow."""
    rows = list(sweep.static)
    rows[5] = {**rows[5], "values": {}, "status": "point_refused"}
    svg = sweep_drawings(replace(sweep, static=tuple(rows)))[0].standalone()
    assert "no value: refused scene" in texts(svg)
    alpha = np.asarray(embedded(svg)[0].convert("RGBA"))[..., 3]
    # One cell of twelve, the second bore at the second pressure, is empty.
    assert {*alpha.ravel().tolist()} == {0, 255}
    assert alpha[int(len(alpha) * 1.5 / 4), int(alpha.shape[1] * 0.3 / 1.5)] == 0
    assert "no value" not in sweep_drawings(sweep)[0].svg


def test_figures_of_a_sweep_are_shown_without_a_folder(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"tube.bore": [1e-3, 1.5e-3, 2e-3]}, intervals=False)
    assert sweep.plot().svg().count("bore d in mm") == 3


def test_a_map_of_more_axes_shows_those_with_most_values(
    paper_scene: Scene, valves: Path, tmp_path: Path
) -> None:
    """The others are held as in the best row; colours and lines are those of a two-axis sweep."""
    vary = {"gas": valves, "tube.bore": "1mm:2mm:3", "gas.pressure": "0.2MPa:0.8MPa:4"}
    sweep = rb.sweep(paper_scene, vary, intervals=False)
    files = sweep.plot(tmp_path)
    reach = files[0].read_text()
    assert "gas: slow" in texts(reach)
    assert f"Gas: slow, as in row {sweep.best}." in files[-1].read_text()
    alone = rb.sweep(paper_scene, dict(list(vary.items())[1:]), intervals=False)
    (alone_map, _), (full_map, _) = embedded(sweep_drawings(alone)[0].standalone()), embedded(reach)
    assert alone_map.tobytes() == full_map.tobytes()


def test_a_key_that_a_map_holds_has_the_name_of_an_axis(paper_scene: Scene, tmp_path: Path) -> None:
    """For a paper's figure without the number of a row, which the page has."""
    vary = {"tube.bore": "1mm:2mm:3", "disc.axial_width": "60mm,80mm", "gas.pressure": "0.6MPa:0.8MPa:3"}
    sweep = rb.sweep(paper_scene, vary, intervals=False)
    *figures, page = sweep.plot(tmp_path)
    for figure in figures:
        assert "axial width B = 80 mm" in " ".join(texts(figure.read_text()))
        assert "row" not in figure.read_text().split()
    assert f"Axial width B = 80 mm, as in row {sweep.best}." in page.read_text().replace("\u202f", " ")


@pytest.mark.parametrize(("count", "sample"), [("", "sobol:64"), (":4", "")])
def test_a_map_of_three_axes_is_over_those_that_decide(paper_scene: Scene, count: str, sample: str) -> None:
    """The width decides the moment that is usable, and has no part in the velocity of a sample's map."""
    vary = {"tube.bore": "1mm:2mm", "gas.pressure": "0.5MPa:0.8MPa", "disc.axial_width": "30mm:90mm"}
    grid = {path: f"{text}{count}" for path, text in vary.items()}
    sweep = rb.sweep(paper_scene, grid, sample=sample, intervals=False)
    reach, velocity, _ = (each.standalone() for each in sweep_drawings(sweep))
    assert any("width" in text for text in texts(reach))
    assert any("width" in text for text in texts(velocity)) != bool(sample)
    few = rb.sweep(paper_scene, vary, sample="sobol:16", intervals=False)
    assert not any("width" in text for text in texts(sweep_drawings(few)[0].standalone()))


def test_points_that_do_not_meet_show_their_values_too_and_the_nearest_is_marked(
    paper_scene: Scene, tmp_path: Path
) -> None:
    scene = paper_scene.with_values({"requirement.fraction": 0.999})
    vary = {"gas.pressure": "0.42MPa:0.62MPa", "tube.bore": "1mm:2mm"}
    sweep = rb.sweep(scene, vary, sample="sobol:8", runs=8, intervals=False)
    assert sweep.best is None
    reach = next(path for path in sweep.plot(tmp_path) if path.name == "sweep-reach.svg").read_text()
    assert "nearest" in reach
    colours = re.findall(r'style="fill: none; stroke: (#[0-9a-f]{6}); stroke-width: 4;', reach)
    assert len({*colours}) > 4
