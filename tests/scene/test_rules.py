"""The rules at their very limits, and the shortest path from port to port against paths by points."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.models import Bend
from ringbalance.scene.rules import shape, working

RULES = {each.rule.__name__.removeprefix("_"): each.rule for each in (*shape.CHECKS, *working.CHECKS)}
BENDS = (Bend(angle=1.5, radius=0.004), Bend(angle=1.0, radius=0.002))


@pytest.mark.parametrize(
    ("rule", "beyond", "within"),
    [
        ("radii_in_order", (0.03, 0.03), (0.0299, 0.03)),
        ("plates_leave_room", (0.03, 0.03, math.pi), (0.0299, 0.03, math.pi)),
        ("chamber_has_depth", (0.03, 0.03 * (1 + 0.9e-8)), (0.03, 0.03 * (1 + 1.1e-8))),
        ("fill_has_depth", (2e-9, 0.0205, 0.0445), (3e-8, 0.0205, 0.0445)),
        ("chamber_wide_enough", (1.99e-3, 0.0, 0.01, 0.05), (2.01e-3, 0.0, 0.01, 0.05)),
        ("chamber_wide_enough", (0.1985, 0.0099, 0.1, 0.2), None),
        ("chambers_fit", (1.5709, 4), (math.pi / 2, 4)),
        ("chambers_fit", None, (1.5708, 4)),
        ("fills_share_the_liquid", (0.2501, 0.5), (0.15, 0.3)),
        ("port_in_chamber", (0.02, 0.02, 0.04), (0.04, 0.02, 0.04)),
        ("crest_in_disc", (0.04, 0.04), (0.0399, 0.04)),
        ("crest_inside_port", (0.04, 0.04), (0.0399, 0.04)),
        ("bore_fits_bends", (0.0041, BENDS), (0.004, BENDS)),
        ("bore_fits_bends", None, (1.0, ())),
        ("bore_fits_chamber", (0.0201, 0.01, 0.02, 0.04), (0.02, 0.01, 0.02, 0.04)),
        ("roughness_fits_bore", (0.001, 0.002), (0.0, 0.002)),
        ("length_holds_bends", (0.0079, BENDS), (0.008, BENDS)),
        ("length_reaches", (0.0799, 0.0, 0.04), (0.08, 0.0, 0.04)),
        ("length_reaches_over_crest", None, (0.08, math.pi, 0.04, 0.01)),
        ("entrance_has_radius", (0.001, "sharp"), (0.0, "sharp")),
        ("liquid_stays_liquid", (1e5, 1e5), (0.0, 1e5)),
        ("temperature_below_boiling", (373.0, 1e5, 1e5), (373.0, 0.99e5, 1e5)),
        ("gas_times_in_order", (0.1, 0.1), (0.0999, 0.1)),
        ("period_covers_lag", (0.0999, 0.1), (0.1, 0.1)),
        ("trial_time_executed", (0.0999, 0.1, 0.2), (0.1, 0.1, 0.2)),
        ("trial_time_executed", (0.2001, 0.1, 0.2), (0.2, 0.1, 0.2)),
        ("steps_in_order", (0.1001, 0.1), (0.1, 0.1)),
        ("limit_above_noise", (1e-8, 1e-8), (1.01e-8, 1e-8)),
        ("sequence_complete", (("A", "C", "B", "E"), 4), (("D", "C", "B", "A"), 4)),
    ],
)
def test_a_rule_at_its_limit(
    rule: str, beyond: tuple[Any, ...] | None, within: tuple[Any, ...] | None
) -> None:
    """Arguments that a rule refuses, and that it lets pass."""
    if beyond is not None:
        finding = RULES[rule](*beyond)
        assert finding is not None
        assert finding.problem
        assert finding.allowed
    assert within is None or RULES[rule](*within) is None


def test_plates_close_where_the_opening_angle_vanishes() -> None:
    """asin(t/R1) = theta/2 at the limit that the message names."""
    for angle in (0.3, math.pi / 2, math.pi):
        limit = 0.02 * math.sin(angle / 2)
        assert RULES["plates_leave_room"](limit * (1 + 1e-12), 0.02, angle) is not None
        assert RULES["plates_leave_room"](limit * (1 - 1e-12), 0.02, angle) is None
        assert math.asin(limit / 0.02) == pytest.approx(angle / 2, rel=1e-7)


def _chamber_at(radius: float, *, thickness: float) -> float:
    """Fill ratio of a surface, by summing thin rings of the paper's chamber between two plates."""
    inner, outer, angle, count = 0.0205, 0.0445, math.pi / 2, 200_000

    def area(start: float) -> float:
        step = (outer - start) / count
        radii = (start + (place + 0.5) * step for place in range(count))
        return math.fsum(2 * r * (angle / 2 - math.asin(thickness / r)) * step for r in radii)

    return area(radius) / area(inner)


@pytest.mark.parametrize("thickness", [0.0, 0.002777])
@pytest.mark.parametrize(("rule", "radius"), [("port_under_liquid", 0.041), ("inlet_above_liquid", 0.03)])
def test_what_lies_at_the_surface_is_found_by_its_fill(rule: str, radius: float, thickness: float) -> None:
    """A port just under the surface is allowed, one just above it not; of a gas inlet the other way round."""
    fill = _chamber_at(radius, thickness=thickness)
    chamber = (0.0205, 0.0445, math.pi / 2, thickness)
    below, above = (RULES[rule](radius, fill * factor, *chamber) for factor in (1 - 1e-6, 1 + 1e-6))
    assert (above is None) == (rule == "port_under_liquid")
    assert (below is None) == (rule == "inlet_above_liquid")


PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
SHAPES = {
    "hump": st.floats(0.05, 0.99),
    "separation": st.floats(0.05, math.pi),
}


def _polyline(points: list[tuple[float, float]]) -> float:
    """Length through points given as (radius, angle)."""
    plane = [(r * math.cos(phi), r * math.sin(phi)) for r, phi in points]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(plane))


@given(**SHAPES)
@PROPERTY
def test_taut_string_is_a_path(hump: float, separation: float) -> None:
    """Where the chord is blocked, tangent, arc and tangent in small steps are as long as the bound."""
    assume(math.cos(separation / 2) < hump)
    tangent = math.acos(hump)
    arc = [tangent + (separation - 2 * tangent) * i / 2000 for i in range(2001)]
    path = [(1.0, 0.0), *((hump, phi) for phi in arc), (1.0, separation)]
    bound = shortest_path(port_radius=1.0, hump_radius=hump, separation=separation)
    assert _polyline(path) == pytest.approx(bound, rel=1e-6)


@given(**SHAPES, knots=st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=6))
@PROPERTY
def test_no_path_is_shorter(hump: float, separation: float, knots: list[tuple[float, float]]) -> None:
    """A path through any radii between crest and port that touches the crest is no shorter than the bound."""
    radii = [hump + (1 - hump) * share for share, _ in knots]
    angles = sorted(separation * share for _, share in knots)
    radii[len(radii) // 2] = hump
    knotted = [(1.0, 0.0), *zip(radii, angles, strict=True), (1.0, separation)]
    fine: list[tuple[float, float]] = []
    for (r0, phi0), (r1, phi1) in itertools.pairwise(knotted):
        fine += [(r0 + (r1 - r0) * i / 200, phi0 + (phi1 - phi0) * i / 200) for i in range(200)]
    length = _polyline([*fine, knotted[-1]])
    bound = shortest_path(port_radius=1.0, hump_radius=hump, separation=separation)
    assert length >= bound * (1 - 1e-5)
