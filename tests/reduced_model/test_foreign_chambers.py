"""Chambers of foreign shape against quadratures of their own: volume, moment, lambda, head and stall."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from block_discs import welded
from drawn_chamber import drawing_of, loaded, msh_2
from quantities import by_key, half_width

import ringbalance as rb
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.elements import boundary_facets
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.reference.chambers import block_chamber

OUTER, INNER, WIDTH, HALF = 44.5, 20.5, 62.0, float(np.radians(34.0))
"""mm and rad, of all chambers but for what each says."""
PILLARS: Final = ((34.0, float(np.radians(17.0)), 3.0), (34.0, float(np.radians(-17.0)), 3.0))
"""Radius and angle of the middle, and radius of each, mm and rad."""
_FEW, _MANY = 3, 500
"""Panels of four Gauss points; many where the surface may leave the outer wall."""
_STEP: Final = 0.05
"""Of the surface's radius, mm, for the derivative dU/dV: a relative error of (step/radius)^2."""
MESH_FINDINGS = ("off_axis", "outer_wall_faces_inward", "coarse_curves")
_CLOSE: Final = 1e-4
"""What chambers of second-order cells of a few millimetres are asked for."""

Radius = Callable[[FloatArray, FloatArray], FloatArray]


@cache
def gauss(panels: int) -> tuple[FloatArray, FloatArray]:
    """Places and weights on [-1, 1], four points a panel."""
    places, weights = np.polynomial.legendre.leggauss(4)
    middles = (2 * np.arange(panels) + 1) / panels - 1
    return (middles[:, None] + places / panels).ravel(), np.tile(weights / panels, panels)


def even(radius: float) -> Radius:
    return lambda angle, z: np.full(np.broadcast(angle, z).shape, radius)


_OUTSIDE, _INSIDE = even(OUTER), even(INNER)


@dataclass(frozen=True, kw_only=True)
class Shape:
    """R_in <= r <= R_out within an angle about a middle that may turn along the shaft, less pillars; mm."""

    outer: Radius = _OUTSIDE
    """R_out of the angle from the middle and of z."""
    inner: Radius = _INSIDE
    twist: float = 0.0
    """Of the middle over the width, rad."""
    pillars: tuple[tuple[float, float, float], ...] = ()
    panels: tuple[int, int] = (_FEW, _MANY)
    """Of the quadrature, along the angle and the shaft."""
    cells: tuple[int, int, int] = (6, 12, 4)

    def place(self, cube: FloatArray) -> FloatArray:
        """From the unit cube."""
        angle, z = HALF * (2 * cube[..., 1] - 1), WIDTH * (cube[..., 2] - 0.5)
        low, high = self.inner(angle, z), self.outer(angle, z)
        radius, turned = low + cube[..., 0] * (high - low), angle + self.twist * z / WIDTH
        return np.stack([radius * np.cos(turned), radius * np.sin(turned), z], axis=-1)

    def totals(self, surface: float) -> FloatArray:
        """V, mm^3, and int x dV, mm^4, outside a surface."""
        (phi, by_angle), (z, by_width) = (gauss(n) for n in self.panels)
        angle, along = HALF * phi[:, None], WIDTH / 2 * z[None, :]
        weight = HALF * WIDTH / 2 * by_angle[:, None] * by_width
        high, low = self.outer(angle, along), self.inner(angle, along)
        start = np.minimum(np.maximum(surface, low), high)
        across = np.cos(angle + self.twist * along / WIDTH)
        found = [(high**2 - start**2) / 2, (high**3 - start**3) / 3 * across]
        return np.array([(weight * each).sum() for each in found]) - sum(
            (_pillar(surface, *each) for each in self.pillars), start=np.zeros(2)
        )

    def surface(self, volume: float) -> float:
        """Radius outside which a volume lies, mm."""
        low, high = INNER, OUTER
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if self.totals(middle)[0] > volume else (low, middle)
        return (low + high) / 2


def _pillar(surface: float, radius: float, angle: float, size: float) -> FloatArray:
    """The part of a pillar outside a surface, by rings about the shaft: r 2 beta(r) WIDTH."""
    low, high = max(surface, radius - size), radius + size
    if low >= high:
        return np.zeros(2)
    # The square-root ends of beta(r) by a cosine: only a smooth integrand is left but for the surface's end.
    start = np.arccos(np.clip((low - radius) / size, -1, 1))
    t, weight = gauss(20)
    turn = start / 2 * (1 + t)
    r, share = radius + size * np.cos(turn), start / 2 * weight * size * np.sin(turn)
    beta = np.arccos(np.clip((r**2 + radius**2 - size**2) / (2 * r * radius), -1, 1))
    return WIDTH * np.array(
        [(share * 2 * beta * r).sum(), (share * 2 * np.sin(beta) * np.cos(angle) * r**2).sum()]
    )


def cone(least: float) -> Radius:
    """From OUTER at one end to a smaller radius at the other."""
    return lambda angle, z: (OUTER + least) / 2 + (OUTER - least) * z / WIDTH + 0 * angle


def elliptic(angle: FloatArray, z: FloatArray) -> FloatArray:
    """An ellipse about x = 20 mm, 24.5 mm long and 22 mm wide to either side."""
    middle, length, width = 20.0, OUTER - 20.0, 22.0
    a = (np.cos(angle) / length) ** 2 + (np.sin(angle) / width) ** 2
    b, c = middle * np.cos(angle) / length**2, (middle / length) ** 2 - 1
    return (b + np.sqrt(b**2 - a * c)) / a + 0 * z


def neck(angle: FloatArray, z: FloatArray) -> FloatArray:
    """A hump of the inner wall between two lobes, which leaves 4 mm of the depth open."""
    return INNER + 20.0 * np.exp(-((angle / 0.25) ** 2)) + 0 * z


SHAPES: Final = {
    "cone": Shape(outer=cone(41.0)),
    "taper": Shape(outer=cone(44.1)),
    "elliptic pocket": Shape(outer=elliptic, panels=(_MANY, _FEW)),
    "twisted": Shape(twist=float(np.radians(20.0))),
    "pillars": Shape(pillars=PILLARS, cells=(4, 24, 4)),
    "neck": Shape(inner=neck, panels=(_MANY, _FEW), cells=(6, 20, 2)),
}

OFTEN: Final = ("cone", "pillars")


def mesh(shape: Shape, kind: CellKind = "hexahedron27") -> ChamberGeometry:
    """A chamber's mesh in mm, its outer wall and the rest named."""
    if not shape.pillars:
        return block_chamber(shape.cells, shape.place, kind=kind)
    parts = [block_chamber(shape.cells, partial(_round, each), kind=kind) for each in PILLARS]
    points = np.concatenate([part.points for part in parts])
    cells = np.concatenate([parts[0].cells, parts[1].cells + len(parts[0].points)])
    whole = welded(parts[0], points, cells)
    facets = boundary_facets(whole)
    outer = np.all(np.abs(np.hypot(*whole.points[facets, :2].T.swapaxes(1, 2)) - OUTER) < 1e-6, axis=1)
    return replace(whole, boundaries={"outer_wall": facets[outer], "walls": facets[~outer]})


def _round(pillar: tuple[float, float, float], cube: FloatArray) -> FloatArray:
    """From the unit cube to half of a chamber round its pillar; the second coordinate goes round."""
    radius, angle, size = pillar
    side, along = np.divmod(4 * cube[..., 1] % 4, 1)
    low, high = (0.0, HALF) if angle > 0 else (-HALF, 0.0)
    r = np.choose(
        side.astype(int), [OUTER, OUTER - along * (OUTER - INNER), INNER, INNER + along * (OUTER - INNER)]
    )
    phi = np.choose(side.astype(int), [low + along * (high - low), high, high - along * (high - low), low])
    rim = np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)
    middle = radius * np.array([np.cos(angle), np.sin(angle)])
    # The circle's angles as those of the rim's corners, a quarter of a turn each.
    turn = angle - np.pi / 4 + np.pi / 2 * (side + along)
    circle = middle + size * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    u = cube[..., :1]
    return np.concatenate([(1 - u) * circle + u * rim, WIDTH * (cube[..., 2:] - 0.5)], axis=-1)


def scene_of(folder: Path, geometry: ChamberGeometry) -> Scene:
    """The paper's scene with a chamber in mm in the place of its own."""
    return liquid_ring_scene(loaded(folder, msh_2(drawing_of(geometry))))


def calibrated(folder: Path, geometry: ChamberGeometry) -> tuple[Scene, dict[str, Any]]:
    """The scene without gravity, whose waves would widen all, and what `calibrate --json` prints."""
    scene = scene_of(folder, geometry).with_values({"environment.gravity": "0 m/s^2"})
    return scene, calibration_document(rb.calibrate(scene))


def mesh_findings(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Findings on the mesh."""
    return [each for each in document["findings"] if each["code"] in MESH_FINDINGS]


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=() if each in OFTEN else pytest.mark.heavy) for each in SHAPES]
)
def test_a_foreign_chamber_meets_its_own_quadrature(name: str, tmp_path: Path) -> None:
    """Volume, moment, lambda, head and stall, within what is printed with each and within 1e-4."""
    shape = SHAPES[name]
    scene, found = calibrated(tmp_path, mesh(shape))
    known, chamber = by_key(found), found["chamber"]
    rho, half = scene.liquid.density, scene.liquid.density * scene.rotor.speed**2 / 2
    volume = shape.totals(0.0)[0]
    at = [chamber["fill_ratio"].index(x) for x in (0.05, 0.25, 0.5)]
    _, equal, full = surfaces = [shape.surface(chamber["fill_ratio"][i] * volume) for i in at]
    inside, outside = shape.totals(equal - _STEP), shape.totals(equal + _STEP)
    slope = (inside[1] - outside[1]) / (inside[0] - outside[0])
    heads = half * 1e-6 * (OUTER**2 - np.array(surfaces) ** 2)
    expected = {
        "chamber_volume": volume * 1e-9,
        "moment": rho * shape.totals(full)[1] * 1e-12,
        "lambda": 2 * slope * 1e-3,
        "stall_pressure": heads[-1],
    }
    for quantity, value in expected.items():
        off = abs(known[quantity]["value"] - value)
        assert off <= half_width(known[quantity]), quantity
        assert off <= _CLOSE * value, quantity
        assert half_width(known[quantity]) <= 1e-3 * value, quantity
    off = np.abs(np.array(chamber["hydrostatic_pressure_Pa"])[at] - heads)
    assert np.all(off <= np.array(chamber["hydrostatic_pressure_uncertainty"])[at])
    assert np.all(off <= _CLOSE * heads)
    assert found["check"]["agrees"]
    assert found["status"]["code"] == known["lambda"]["status"] == "ok"
    assert mesh_findings(found) == []


@pytest.mark.parametrize("name", ["cone", pytest.param("neck", marks=pytest.mark.heavy)])
def test_the_law_holds_the_head_between_its_nodes(name: str, tmp_path: Path) -> None:
    """In the edge of a cone the head goes with the root of the fill."""
    shape = SHAPES[name]
    scene = scene_of(tmp_path, mesh(shape))
    calibration, half = rb.calibrate(scene), scene.liquid.density * scene.rotor.speed**2 / 2
    law, curve = calibration.flow_law, calibration.chamber.hydrostatic_pressure
    widths = curve.half_widths(inputs=curve.inputs)
    volume = shape.totals(0.0)[0]
    for x in (0.0011, 0.0133, 0.112, 0.3333):
        head = half * 1e-6 * (OUTER**2 - shape.surface(x * volume) ** 2)
        ends = law.ends(fill_ratio=x)
        off = abs(float(ends.upstream_hydrostatic) - head)
        assert off <= np.interp(x, curve.table.knots, widths) + _CLOSE * head, x
        assert off <= 2e-3 * head, x


@pytest.mark.parametrize(
    ("shift", "codes"),
    [
        ((0.3, 0.2), ["off_axis"]),
        pytest.param((6.0, 0.0), ["off_axis"], marks=pytest.mark.heavy),
        pytest.param((0.0, 0.0), [], marks=pytest.mark.heavy),
    ],
)
def test_a_chamber_beside_the_shaft_is_named(
    shift: tuple[float, float], codes: list[str], tmp_path: Path
) -> None:
    """Its numbers are right for where it lies, so that nothing is widened."""
    straight = mesh(SHAPES["taper"])
    moved = replace(straight, points=straight.points + np.array([*shift, 0.0]))
    _, found = calibrated(tmp_path, moved)
    assert [each["code"] for each in mesh_findings(found)] == codes
    for each in mesh_findings(found):
        assert each["values"]["distance_m"] == pytest.approx(1e-3 * np.hypot(*shift), rel=1e-3)
    assert found["status"]["code"] == "ok"
    lever = by_key(found)["lambda"]
    assert math.hypot(lever["parts"]["numerical"], lever["parts"]["model"]) < 2e-3 * lever["value"]


def test_an_outer_wall_that_faces_inward_is_named(tmp_path: Path) -> None:
    chamber = mesh(Shape())
    named = chamber.boundaries
    both = {"outer_wall": np.concatenate([named["outer_wall"], named["inner_wall"]])}
    _, found = calibrated(tmp_path, replace(chamber, boundaries=both))
    (finding,) = mesh_findings(found)
    assert finding["code"] == "outer_wall_faces_inward"
    # Arcs of the same angle and width.
    assert finding["values"]["area_share"] == pytest.approx(INNER / (INNER + OUTER), rel=1e-4)
    assert found["check"]["agrees"]


@pytest.mark.parametrize("wall", ["end_back", "plate_left", "inner_wall"])
def test_a_wall_that_holds_no_liquid_outward_is_refused(wall: str, tmp_path: Path) -> None:
    chamber = mesh(Shape())
    with pytest.raises(rb.SceneError, match="outer_wall"):
        scene_of(tmp_path, replace(chamber, boundaries={"outer_wall": chamber.boundaries[wall]}))


@pytest.mark.parametrize("edges", [8, pytest.param(24, marks=pytest.mark.heavy)])
def test_cells_coarser_than_a_pillar_are_named_and_counted(edges: int, tmp_path: Path) -> None:
    """Straight cells that draw a pillar as a polygon: what that leaves is in every interval."""
    shape = replace(SHAPES["pillars"], cells=(4, edges, 2))
    scene, found = calibrated(tmp_path, mesh(shape, "hexahedron"))
    volume, known = shape.totals(0.0)[0], by_key(found)
    full = shape.surface(found["chamber"]["fill_ratio"][-1] * volume)
    for quantity, value in (
        ("chamber_volume", volume * 1e-9),
        ("moment", scene.liquid.density * shape.totals(full)[1] * 1e-12),
    ):
        assert abs(known[quantity]["value"] - value) <= half_width(known[quantity])
    assert [each["code"] for each in mesh_findings(found)] == (["coarse_curves"] if edges <= 12 else [])
