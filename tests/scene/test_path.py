"""The shortest path from port to port, against paths that are laid out point by point."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ringbalance.scene.keys.derivations import shortest_path

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
