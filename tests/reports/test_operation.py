"""The pictures of where the disc works: what stands in them is what they were given."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reports.figure import NARROW_IN, Drawing
from ringbalance.reports.pages.loop import LOOP
from ringbalance.reports.pages.operation import SECTION, _disc_section, _letter_radius, _operating_map
from ringbalance.reports.pages.standing import CONDITIONS
from ringbalance.reports.run_figures import _reachable, residual_polar
from ringbalance.reports.section import Work
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene

Record = dict[str, Any]
COLUMN = 238.0
"""Points of one of two columns on an A4 page with the report's margins."""


def texts(drawing: Drawing) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]+)</text>", drawing.svg)


@pytest.fixture(scope="module")
def work() -> Work:
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    return Work(scene=scene, level="light")


@pytest.fixture(scope="module")
def collected(work: Work) -> Record:
    result = SECTION.collect(work)
    assert result is not None
    return result


def test_the_map_agrees_with_the_law(work: Work, collected: Record) -> None:
    law = work.calibration.flow_law
    for row, column in ((10, 50), (60, 30), (90, 90), (119, 2)):
        regime = collected["regimes"][int(collected["regime"][row][column])]
        fill, gas = collected["fill_ratio"][column], collected["gas_pressure_Pa"][row]
        flow = law.evaluate(fill_ratio=fill, gas_pressure=gas)
        assert (regime == "blocked") == (float(flow.velocity) == 0)
        assert (regime == "siphon") == (int(flow.regime) == 1)


def test_liquid_spills_between_the_priming_pressure_and_a_full_bore(work: Work, collected: Record) -> None:
    """At the crest's priming pressure the flow begins at zero, gas on the crest until swept out."""
    half = work.ring.disc.max_fill_ratio / 2
    column = collected["fill_ratio"].index(half)
    pressure = np.asarray(collected["gas_pressure_Pa"])
    names = [collected["regimes"][int(row[column])] for row in collected["regime"]]
    order = list(dict.fromkeys(names))
    assert order[:2] == ["blocked", "spilling"]
    first = pressure[names.index("spilling")]
    lift = work.calibration.flow_law.ends(fill_ratio=half).upstream_hydrostatic
    priming = (work.calibration.flow_law.path.hump_pressure or 0.0) - float(lift)
    assert 0 < first - priming <= pressure[1]


def test_the_pressure_that_lifts_the_liquid_over_the_crest_is_hydrostatics(
    work: Work, collected: Record
) -> None:
    """p = rho w^2 (a^2 - r^2) / 2 from the free surface a to either end r of the crest's range, no flow."""
    ring, crest = work.ring, collected["crest"]
    disc, radii = ring.disc, crest["radius_m"]
    assert radii[0] < (ring.tube.hump_radius or 0.0) < radii[1]
    for column in (0, 40, 100):
        fill = collected["fill_ratio"][column]
        surface = surface_radius(disc=disc, fill_ratio=fill)
        for radius, pressures in zip(radii, crest["lifting_pressure_Pa"], strict=True):
            head = ring.liquid.density * ring.rotor.speed**2 * (surface**2 - radius**2) / 2
            # The gas brings its own column's weight, less than a thousandth of the liquid's.
            assert pressures[column] == pytest.approx(max(head, 0.0), rel=0.01)


def test_each_area_of_the_map_is_named_in_words(collected: Record) -> None:
    drawing = _operating_map(collected)
    regimes = {collected["regimes"][int(sign)] for row in collected["regime"] for sign in row}
    assert regimes <= {*texts(drawing), "undecided"}


def test_the_section_carries_its_dimensions(collected: Record) -> None:
    disc = {**collected["disc"], "free_surface_radius_m": 0.0401, "origins": {"bore": "assumed"}}
    shown = " ".join(texts(_disc_section(disc)))
    for part in ("R₂ 44.50", "R₁ 20.50", "R₁′ 40.10", "t 2.78", "B 62.00", "θ 90.0°", "rₘ 31.5", "port 44.5"):
        assert part in shown
    straight = " ".join(texts(_disc_section({**disc, "crest_radius_m": None})))
    assert "rₘ" not in straight


def test_the_tornado_begins_with_the_largest_cause() -> None:
    budget = {
        "key": "velocity",
        "value": 10.0,
        "parts": {"numerical": 1e-4, "input": 0.6, "model": 0.2},
        "causes": {"tube.bore": 0.5, "rotor.speed": -0.3, "disc.outer_radius": 0.0, "model: ends": 0.2},
    }
    quantities = [budget, {**budget, "key": "lambda", "value": 0.0}]
    view = CONDITIONS.view({"calibration": {"quantities": quantities}, "verification": []})
    assert view is not None
    shown = texts(view["tornado"])
    places = [shown.index(name) for name in ("bore", "speed", "the model", "numerics")]
    assert places == sorted(places)
    assert "λ" not in " ".join(shown)
    assert view["largest"] == {"Velocity": "bore"}
    bare = CONDITIONS.view({"calibration": {}, "verification": []})
    assert bare is not None
    assert bare["tornado"] is None


def flat(drawing: Drawing) -> str:
    return re.sub(r"\s+", " ", drawing.svg)


def test_the_residual_ends_within_its_circle() -> None:
    run = {"amplitude_m": [1e-5, 4e-6, 2e-8], "phase_rad": [1.5, 1.0, 0.2], "limit_m": 5e-8}
    reach = {"vibration_m": 1.1e-5, "direction_rad": -0.3, "pairs": 2}
    drawing = residual_polar(run, reach)
    shown = " ".join(texts(drawing))
    assert "whole run" in shown
    assert "near the limit" in shown


@pytest.mark.parametrize(("pairs", "corners"), [(1, 2), (2, 4), (3, 6)])
def test_pairs_together_cancel_the_sum_of_what_each_does(pairs: int, corners: int) -> None:
    result = _reachable(1.0, 0.4, pairs)
    assert len(result) == corners
    # The farthest corner of n equal vectors spread over half a turn lies at 1/sin(pi/2n).
    assert np.abs(result).max() == pytest.approx(1 / math.sin(math.pi / 2 / pairs))


def test_text_is_no_smaller_than_eight_points_in_print(collected: Record) -> None:
    drawing = _operating_map(collected)
    sizes = [float(size) for size in re.findall(r"font(?:-size)?: (?:bold )?([\d.]+)px", drawing.svg)]
    assert sizes
    assert min(sizes) * COLUMN / (72 * NARROW_IN) >= 8


def test_the_loop_s_reach_is_a_vibration(work: Work) -> None:
    reach = LOOP.collect(work)
    assert reach is not None
    moment = float(work.calibration.answers.usable_moment)
    assert reach["vibration_m"] == pytest.approx(moment * work.ring.rotor.influence_coefficient)


@pytest.mark.parametrize("crest", [None, 15.0, 22.0, 31.5, 38.0, 43.0])
def test_a_chambers_letter_stands_in_its_gas_beside_the_tube(crest: float | None) -> None:
    size = {"inner_radius": 20.0, "free_surface_radius": 40.0}
    result = _letter_radius(size if crest is None else {**size, "crest_radius": crest})
    assert min(result - 20.0, 40.0 - result, abs(result - (crest or 0.0))) >= 5.0
