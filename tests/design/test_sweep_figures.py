"""Figures of a sweep: maps over two keys and more, feasible points and the nearest."""

from __future__ import annotations

import math
import re
from pathlib import Path

import ringbalance as rb
from ringbalance.results.numbers import format_given
from ringbalance.scene.models import Scene


def test_a_map_is_drawn_with_its_boundary(paper_scene: Scene, tmp_path: Path) -> None:
    sweep = rb.sweep(
        paper_scene, {"tube.bore": "1mm:2mm:3", "gas.pressure": "0.2MPa:0.8MPa:4"}, intervals=False
    )
    names = [path.name for path in sweep.plot(tmp_path)]
    assert names == ["sweep-reach.svg", "sweep-velocity.svg", "sweep-loop-factor.svg"]
    assert sweep.best is not None
    assert math.isfinite(sweep.static[sweep.best]["values"]["reach"][0])
    assert "not feasible" in (tmp_path / names[0]).read_text()


def test_figures_of_a_sweep_are_shown_without_a_folder(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"tube.bore": [1e-3, 1.5e-3, 2e-3]}, intervals=False)
    assert sweep.plot().svg().count("tube.bore in mm") == 3


def test_a_map_of_more_axes_shows_those_with_most_values(
    paper_scene: Scene, valves: Path, tmp_path: Path
) -> None:
    """The others are held as in the best row; the boundary between shades is that of a two-axis sweep."""
    vary = {"gas": valves, "tube.bore": "1mm:2mm:3", "gas.pressure": "0.2MPa:0.8MPa:4"}
    sweep = rb.sweep(paper_scene, vary, intervals=False)
    reach = sweep.plot(tmp_path)[0].read_text()
    assert "gas.name = slow as in row" in reach
    values = [value for value in sweep.columns()["reach [kg m]"][:12] if value is not None]
    assert f"{format_given(max(values), 'kg m', digits=3)} (dark)" in reach
    alone = rb.sweep(paper_scene, dict(list(vary.items())[1:]), intervals=False)
    assert reach.count("<use") == alone.plot(tmp_path / "alone")[0].read_text().count("<use")


def test_points_that_do_not_meet_show_their_values_too_and_the_nearest_is_marked(
    paper_scene: Scene, tmp_path: Path
) -> None:
    scene = paper_scene.with_values({"requirement.fraction": 0.999})
    vary = {"gas.pressure": "0.42MPa:0.62MPa", "tube.bore": "1mm:2mm"}
    sweep = rb.sweep(scene, vary, sample="sobol:8", runs=8, intervals=False)
    assert sweep.best is None
    reach = next(path for path in sweep.plot(tmp_path) if path.name == "sweep-reach.svg").read_text()
    assert "nearest" in reach
    colours = re.findall(r'<use [^>]*style="fill: (#[0-9a-f]{6}); stroke', reach)
    assert len({*colours}) > 4
