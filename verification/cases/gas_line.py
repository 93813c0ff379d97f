"""The gas line's mouth: the fills that leave it dry, and a chamber that its tube reaches into."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np
from scipy.integrate import quad_vec
from scipy.optimize import brentq, minimize_scalar

from ringbalance.mesh.faceting import drawing_shares
from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    liquid_area,
    liquid_first_moment,
    surface_radius,
)
from ringbalance.mesh.quadratic_tetrahedra import derivatives, shapes, tetrahedra
from ringbalance.mesh.wall_integrals import gauss
from ringbalance.reduced_model.chamber.values import chamber_closed_forms
from ringbalance.reduced_model.crater import Crater, crater_range
from ringbalance.scene import liquid_ring_scene, load_scene
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.designs import Designs, changes_of
from ringbalance.scene.errors import larger, uncertainties
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.uncertain import with_value
from ringbalance.verification.evidence import (
    Evidence,
    FigureCurve,
    Found,
    Level,
    NotRunError,
    as_found,
    figure,
)

_GRIDS: Final = ((30, 45, 4), (60, 90, 8))
"""Radial and angular cells, and of an imported cell Gauss points along each direction; coarse and fine."""
_ANGLES_RAD: Final = np.linspace(0.0, np.pi, 181)
"""Angles of the shaft; the chamber is symmetric about its centre line."""
_HOLE: Final = "gas_hole"
"""Boundary of an imported chamber that is the mouth of its gas line."""
_JUDGED: Final = ("stopped", "running", "any_speed")
_OFFSETS: Final = np.array([0.02, 0.1, 0.3, 0.6, 1.0, 2.0, 5.0, 20.0])
"""g/omega^2 in units of R2: from a centred ring to almost a plane."""
_FILE: Final = Path(__file__).parent / "gas_tube" / "data" / "scene.toml"
_TUBE_RADIUS_M, _MOUTH_RADIUS_M = 2e-3, 31e-3
"""Outer radius of the tube, and radius of its mouth, as tools/example_chambers.py draws them."""
_DEEP_FILL: Final = 0.8
"""Fill ratio at which part of the tube is under the surface."""


@dataclass(frozen=True, kw_only=True)
class _Cells:
    """The chamber cut into small cells."""

    middle: ComplexArray
    """Middles of the cells, m, centre line along the real axis."""
    share: FloatArray
    """Fraction of the chamber's area in each cell."""
    width: FloatArray
    """Distance over which the surface passes a cell, m."""


def gas_hole_ends(scene: Scene) -> Evidence:
    """Margins on the coarse grid."""
    disc, angles = scene.disc, _angles(scene.disc)
    cells = _cells(disc, *_GRIDS[0])
    safe = _safe_fills(scene, cells, _hole(disc, _safest_radius(disc, cells, angles)), angles)
    return Evidence(
        quantities=as_found(**{f"margin_{state}": safe[state] - disc.max_fill_ratio for state in _JUDGED})
    )


def gas_hole(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The largest fill that leaves a point of the chamber dry at every angle, at rest and at any speed.

    Raises: NotRunError: the shaft is vertical, or there is no gravity.
    """
    if scene.environment.shaft != "horizontal" or scene.environment.gravity == 0:
        raise NotRunError("the claim is about a horizontal shaft under gravity")
    disc = scene.disc
    angles = _ANGLES_RAD[:1] if defect == "upright_only" else _angles(disc)
    coarse, fine = (_cells(disc, *grid) for grid in _GRIDS)
    best = _safest_radius(disc, fine, angles)
    hole = _hole(disc, best)
    rough, safe = (_safe_fills(scene, cells, hole, angles) for cells in (coarse, fine))
    ring = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio))
    radius = np.linspace(disc.inner_radius, disc.outer_radius, 61)
    points, all_angles = [_on_centre_line(r) for r in radius], _angles(disc)
    rest = np.array([_safe_at_rest(fine, point, all_angles[::4]) for point in points])
    running = np.array([_safe_turning(fine, point, _offset(scene), all_angles[::30]) for point in points])
    over_radius = figure(
        "largest fill that leaves the gas hole dry",
        ("radius of the hole on the centre line", "m", radius),
        FigureCurve("running", "1", running),
        FigureCurve("stopped, worst angle", "1", rest),
        FigureCurve("largest fill", "1", np.full(radius.shape, disc.max_fill_ratio), style="paper"),
    )
    return Evidence(
        quantities={
            f"margin_{state}": Found.within(
                safe[state] - disc.max_fill_ratio, abs(safe[state] - rough[state])
            )
            for state in _JUDGED
        },
        numbers={
            "best_radius": best,
            "hole_radius": np.abs(hole).mean(),
            "max_fill": disc.max_fill_ratio,
            "safe_running": safe["running"],
            "safe_stopped": safe["stopped"],
            "ring_radius": ring,
            "safe_at_ring": _safe_at_rest(fine, _on_centre_line(ring), angles),
            "between_margin": safe["turning"] - safe["stopped"],
        },
        series=(over_radius,),
    )


def gas_jet(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Crater and blowing number of the gas jet at equal fills: of the scene's hole, or over those that are
    built."""
    fill = scene.disc.max_fill_ratio / 2
    if scene.disc.gas_hole_diameter is None:
        built = crater_range(scene)
        ends = np.array([(each.min(), each.max()) for each in (built.ratio, built.blowing_number)])
        judged = [
            Found(value=value, reach=(low - value, high - value))
            for (low, high), value in zip(ends.tolist(), np.sqrt(ends.prod(axis=1)).tolist(), strict=True)
        ]
    else:

        def values(designs: Designs) -> FloatArray:
            crater = Crater.of(designs.scene, np.full(designs.size, fill))
            return np.array([crater.ratio, crater.blowing_number])

        nominal, changes = changes_of(scene, values, uncertainties(scene))
        widths = np.sqrt(np.sum(larger(changes) ** 2, axis=0))
        # Of a hole that does not blow at the ring the numbers are upper bounds.
        bound = 0.0 if scene.disc.gas_hole_direction == "outward" else 1.0
        judged = [
            Found.within(value, width).moved(-bound * value, 0.0)
            for value, width in zip(nominal.tolist(), widths.tolist(), strict=True)
        ]
        ends = np.array([np.maximum((1 - bound) * nominal - widths, 0.0), nominal + widths]).T
    names = ("crater_ratio", "blowing_number")
    depth = scene.disc.outer_radius - surface_radius(disc=scene.disc, fill_ratio=fill)
    numbers = dict(
        zip(("share_low", "share_high", "blowing_low", "blowing_high"), ends.ravel().tolist(), strict=True)
    )
    return Evidence(
        quantities=dict(zip(names, judged, strict=True)), numbers={**numbers, "ring_depth": float(depth)}
    )


def _angles(disc: Disc) -> FloatArray:
    """Angles of the shaft, rad: an imported chamber need not be symmetric."""
    return _ANGLES_RAD if disc.geometry is None else np.linspace(-np.pi, np.pi, _ANGLES_RAD.size)


def _hole(disc: Disc, best: float) -> ComplexArray:
    """Points of the hole, m: that of an imported chamber, or the safest point of the centre line."""
    facets = {} if disc.geometry is None else disc.geometry.boundaries
    if disc.geometry is None or _HOLE not in facets:
        return _on_centre_line(best)
    points = disc.geometry.points[np.unique(facets[_HOLE])]
    return np.asarray(np.unique(np.round(points[:, 0] + 1j * points[:, 1], 6)), dtype=np.complex128)


def _on_centre_line(radius: float) -> ComplexArray:
    return np.array([radius], dtype=np.complex128)


def _safe_fills(scene: Scene, cells: _Cells, hole: ComplexArray, angles: FloatArray) -> Mapping[str, float]:
    """Safe fills with a hole: at full speed, at rest, at any speed between, at the worst."""
    stopped = _safe_at_rest(cells, hole, angles)
    turning = _safe_turning(cells, hole, _OFFSETS * scene.disc.outer_radius, angles)
    return {
        "running": _safe_turning(cells, hole, _offset(scene), angles),
        "stopped": stopped,
        "turning": turning,
        "any_speed": min(stopped, turning),
    }


def _offset(scene: Scene) -> FloatArray:
    return np.array([scene.environment.gravity / scene.rotor.speed**2])


def _cells(disc: Disc, radial: int, angular: int, points: int) -> _Cells:
    if disc.geometry is not None:
        # Cells, each with the volume of a column along the shaft, at the centroid of the column.
        # Gauss points of all cells across the shaft, m, and the volume at each, m^3.
        body = tetrahedra(disc.geometry)
        line, weights = gauss(points)
        u, v, w = (grid.ravel() for grid in np.meshgrid(*3 * [line], indexing="ij"))
        weight = np.prod([grid.ravel() for grid in np.meshgrid(*3 * [weights], indexing="ij")], axis=0)
        # A cube collapsed to a tetrahedron: its Jacobian is (1 - v)(1 - w)^2.
        second, third, fourth = u * (1 - v) * (1 - w), v * (1 - w), w
        local = np.stack([1 - second - third - fourth, second, third, fourth], axis=1)
        corners = body.nodes[body.cells]
        jacobians = np.linalg.det(derivatives(corners, local))
        volume = np.asarray(jacobians * weight * (1 - v) * (1 - w) ** 2).ravel()
        across = np.einsum("pn,enx->epx", shapes(local), corners[..., :2], optimize=True)
        point = np.asarray(across[..., 0] + 1j * across[..., 1]).ravel()
        parts = []
        for value, count in ((np.abs(point), radial), (np.angle(point), angular)):
            step = np.ptp(value) / count
            parts.append((np.minimum(((value - value.min()) / step).astype(np.int64), count - 1), step))
        (ring, depth), (ray, angle) = parts
        cell, size = ring * angular + ray, radial * angular
        share = np.bincount(cell, volume, size)
        sums = np.bincount(cell, volume * point.real, size) + 1j * np.bincount(
            cell, volume * point.imag, size
        )
        filled = share > 0
        middle = np.asarray(sums[filled] / share[filled], dtype=np.complex128)
        return _Cells(
            middle=middle,
            share=share[filled] / share.sum(),
            width=np.sqrt(depth * angle * np.abs(middle)),
        )
    depth = disc.outer_radius - disc.inner_radius
    radius = disc.inner_radius + depth * (np.arange(radial) + 0.5) / radial
    alpha = half_angle(disc=disc, radius=radius)
    angle = np.outer(alpha, 2 * (np.arange(angular) + 0.5) / angular - 1)
    area = np.broadcast_to((radius * 2 * alpha * depth / (radial * angular))[:, None], angle.shape).ravel()
    middle = np.asarray(radius[:, None] * np.exp(1j * angle), dtype=np.complex128).ravel()
    return _Cells(middle=middle, share=area / area.sum(), width=np.sqrt(area))


def _liquid_share(cells: _Cells, height: FloatArray) -> FloatArray:
    """Fraction of the chamber that holds liquid.

    Args: `height`: distance of the cells from the surface, m, positive in the liquid, shape (states, cells).
    """
    inside = np.clip(0.5 + height / cells.width, 0.0, 1.0)
    return np.asarray(inside @ cells.share, dtype=np.float64)


def _safe_at_rest(cells: _Cells, hole: ComplexArray, angles: FloatArray) -> float:
    """Smallest fraction below the level of the hole's lowest point, over directions of gravity."""
    down = np.exp(1j * angles)[:, None]
    depth = np.real(cells.middle * np.conj(down))
    # The lowest point is reached first.
    level = np.real(hole * np.conj(down)).max(axis=1, keepdims=True)
    return float(_liquid_share(cells, depth - level).min())


def _safe_turning(cells: _Cells, hole: ComplexArray, offsets: FloatArray, angles: FloatArray) -> float:
    """Smallest fraction in the liquid, its surface a circle about -g/omega^2 through the hole."""
    shares = []
    for offset in offsets:
        centre = -offset * np.exp(1j * angles)[:, None]
        level = np.abs(hole - centre).max(axis=1, keepdims=True)
        shares.append(_liquid_share(cells, np.abs(cells.middle - centre) - level).min())
    return float(min(shares))


def _safest_radius(disc: Disc, cells: _Cells, angles: FloatArray) -> float:
    inner, outer = disc.inner_radius, disc.outer_radius
    scan = np.linspace(inner, outer, 25)
    best = scan[int(np.argmax([_safe_at_rest(cells, _on_centre_line(r), angles) for r in scan]))]
    step = scan[1] - scan[0]
    result = minimize_scalar(
        lambda r: -_safe_at_rest(cells, _on_centre_line(r), angles),
        bounds=(max(inner, best - step), min(outer, best + step)),
        method="bounded",
        options={"xatol": 1e-4 * (outer - inner)},
    )
    return float(result.x)


def _outside(scene: Scene, radius: float, a: float) -> FloatArray:
    """Totals of the sector between plates less a cylinder of a radius along x, outside a surface at a.

    Volume, m^3, moment along x, kg m, and lambda, twice the mean of x over the surface, m. By quadrature over
    y = radius sin(angle), which removes the root at the cylinder's sides; no mesh.
    """
    disc, alpha = scene.disc, float(half_angle(disc=scene.disc, radius=a))

    def tube(angle: float) -> FloatArray:
        surface = math.sqrt(a * a - (radius * math.sin(angle)) ** 2)
        parts = [
            _MOUTH_RADIUS_M - surface,
            (_MOUTH_RADIUS_M**2 - surface**2) / 2,
            a / surface,
            a,
        ]
        return 2 * (radius * math.cos(angle)) ** 2 * np.array(parts) * (surface < _MOUTH_RADIUS_M)

    arc = 2 * a * np.array([alpha, a * math.sin(alpha)])
    areas = [liquid_area(disc=disc, surface_radius=a), liquid_first_moment(disc=disc, surface_radius=a)]
    sector = disc.axial_width * np.array([*areas, *arc])
    totals = sector - quad_vec(tube, -math.pi / 2, math.pi / 2, epsrel=1e-12)[0]
    volume, moment_area, surface_area, surface_moment = totals
    return np.array([volume, scene.liquid.density * moment_area, 2 * surface_moment / surface_area])


def _exact(scene: Scene, radius: float, fills: FloatArray) -> dict[str, float]:
    """Volume, lambda at equal fills, moment at the largest fill and at a deep one."""
    inner, outer = scene.disc.inner_radius, scene.disc.outer_radius
    volume = _outside(scene, radius, inner)[0]

    def at(fill: float) -> FloatArray:
        surface = brentq(lambda a: _outside(scene, radius, a)[0] - fill * volume, inner, outer, xtol=1e-14)
        return _outside(scene, radius, surface)

    half, full, deep = map(at, fills)
    return {"volume": volume, "moment": full[1], "moment_deep": deep[1], "lever": half[2]}


def gas_tube(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The paper's chamber with a real gas tube: a mesh from CAD against the sector less a cylinder.

    Raises: SceneError: the file of the case is damaged.
    """
    with_tube = replace(scene, disc=_disc_with_tube())
    meshed = scene if defect == "without_the_tube" else with_tube
    if defect == "drawn_too_wide":
        meshed = with_value(scene=meshed, quantity="axial_width", value=1.001 * meshed.disc.axial_width)
    largest = scene.disc.max_fill_ratio
    fills = np.array([largest / 2, largest, _DEEP_FILL])
    _, moment, ratio = chamber_closed_forms(scene=meshed, fill_ratio=fills)
    shares = drawing_shares(meshed.disc, fills)
    values = {
        "volume": (chamber_volume(disc=meshed.disc), shares.volume),
        "moment": (moment[1], shares.moment[1]),
        "moment_deep": (moment[2], shares.moment[2]),
        "lever": (ratio[0], shares.moment[0]),
    }
    bare, exact = (_exact(scene, radius, fills) for radius in (0.0, _TUBE_RADIUS_M))
    hole = gas_hole(with_tube, level).numbers
    return Evidence(
        quantities={
            name: Found.within(value, (share + 1e-8) * abs(value)).against(exact[name])
            for name, (value, share) in values.items()
        },
        numbers={
            **{f"{name}_change": exact[name] / bare[name] - 1 for name in ("volume", "moment", "lever")},
            "thickness": 2 * _TUBE_RADIUS_M,
            "tip": _MOUTH_RADIUS_M,
            "ring_radius": surface_radius(disc=scene.disc, fill_ratio=largest),
            "safe_stopped": hole["safe_stopped"],
            "safe_running": hole["safe_running"],
        },
    )


@lru_cache(maxsize=1)
def _disc_with_tube() -> Disc:
    return liquid_ring_scene(load_scene(_FILE)).disc
