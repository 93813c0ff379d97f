"""The largest fill that leaves a point of the chamber dry at every angle, at rest and at every speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.comparison import from_half_width
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, NotRunError, Series, figure

_GRIDS = ((30, 45), (60, 90))
"""Radial and angular cells, coarse and fine."""
_ANGLES = np.linspace(0.0, np.pi, 181)
"""Of the shaft; the chamber is symmetric about its centre line."""
_JUDGED = ("stopped", "running", "any_speed")
_DOWNWARD = _ANGLES[:1]
_OFFSETS = np.array([0.02, 0.1, 0.3, 0.6, 1.0, 2.0, 5.0, 20.0])
"""g/omega^2 in units of R2: from a centred ring to almost a plane."""


@dataclass(frozen=True, kw_only=True)
class _Cells:
    """The chamber cut into small cells."""

    place: ComplexArray
    """Their middles, m, centre line along the real axis."""
    share: FloatArray
    """Of the chamber's area."""
    width: FloatArray
    """Distance over which the surface passes a cell, m."""


def values(scene: Scene) -> dict[str, float]:
    return _margins(scene, _ANGLES, _GRIDS[0])


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Safe fills at rest, at full speed and between.

    Raises: NotRunError: the shaft is vertical, or there is no gravity.
    """
    if scene.environment.shaft != "horizontal" or scene.environment.gravity == 0:
        raise NotRunError("the claim is about a horizontal shaft under gravity")
    disc = scene.disc
    angles = _DOWNWARD if defect == "upright_only" else _ANGLES
    coarse, fine = (_cells(disc, *grid) for grid in _GRIDS)
    best = _safest_radius(disc, fine, angles)
    offset = scene.environment.gravity / scene.rotor.speed**2
    rough, safe = (_safe_fills(disc, cells, best, offset, angles) for cells in (coarse, fine))
    found = {
        f"margin_{state}": Found(
            value=fill - disc.max_fill_ratio, numerical=from_half_width(abs(fill - rough[state]))
        )
        for state, fill in safe.items()
        if state in _JUDGED
    }
    ring = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio))
    return Evidence(
        found=found,
        numbers={
            "best_radius": best,
            "max_fill": disc.max_fill_ratio,
            "safe_running": safe["running"],
            "safe_stopped": safe["stopped"],
            "ring_radius": ring,
            "safe_at_ring": _safe_at_rest(fine, ring, angles),
            "between_margin": safe["turning"] - safe["stopped"],
        },
        series=(_figure(disc, fine, offset),),
    )


def _margins(scene: Scene, angles: FloatArray, grid: tuple[int, int]) -> dict[str, float]:
    disc, offset = scene.disc, scene.environment.gravity / scene.rotor.speed**2
    cells = _cells(disc, *grid)
    safe = _safe_fills(disc, cells, _safest_radius(disc, cells, angles), offset, angles)
    return {f"margin_{state}": safe[state] - disc.max_fill_ratio for state in _JUDGED}


def _safe_fills(
    disc: Disc, cells: _Cells, radius: float, offset: float, angles: FloatArray
) -> Mapping[str, float]:
    """Safe fills with the hole at a radius: at full speed, at rest, at any speed between, at the worst."""
    stopped = _safe_at_rest(cells, radius, angles)
    turning = _safe_turning(cells, radius, _OFFSETS * disc.outer_radius, angles)
    return {
        "running": _safe_turning(cells, radius, np.array([offset]), angles),
        "stopped": stopped,
        "turning": turning,
        "any_speed": min(stopped, turning),
    }


def _cells(disc: Disc, radial: int, angular: int) -> _Cells:
    depth = disc.outer_radius - disc.inner_radius
    radius = disc.inner_radius + depth * (np.arange(radial) + 0.5) / radial
    alpha = half_angle(disc=disc, radius=radius)
    angle = np.outer(alpha, 2 * (np.arange(angular) + 0.5) / angular - 1)
    area = np.broadcast_to((radius * 2 * alpha * depth / (radial * angular))[:, None], angle.shape).ravel()
    place = np.asarray(radius[:, None] * np.exp(1j * angle), dtype=np.complex128).ravel()
    return _Cells(place=place, share=area / area.sum(), width=np.sqrt(area))


def _liquid_share(cells: _Cells, height: FloatArray) -> FloatArray:
    """Share of the chamber below a level; height = distance of each cell beyond it, shape (states, cells)."""
    inside = np.clip(0.5 + height / cells.width, 0.0, 1.0)
    return np.asarray(inside @ cells.share, dtype=np.float64)


def _safe_at_rest(cells: _Cells, radius: float, angles: FloatArray) -> float:
    """Smallest share below the level through a point of the centre line, over directions of gravity."""
    down = np.exp(1j * angles)[:, None]
    return float(_liquid_share(cells, np.real((cells.place - radius) * np.conj(down))).min())


def _safe_turning(cells: _Cells, radius: float, offsets: FloatArray, angles: FloatArray) -> float:
    """The same with the surface a circle about -g/omega^2."""
    shares = []
    for offset in offsets:
        centre = -offset * np.exp(1j * angles)[:, None]
        shares.append(_liquid_share(cells, np.abs(cells.place - centre) - np.abs(radius - centre)).min())
    return float(min(shares))


def _safest_radius(disc: Disc, cells: _Cells, angles: FloatArray) -> float:
    inner, outer = disc.inner_radius, disc.outer_radius
    scan = np.linspace(inner, outer, 25)
    best = scan[int(np.argmax([_safe_at_rest(cells, r, angles) for r in scan]))]
    step = scan[1] - scan[0]
    result = minimize_scalar(
        lambda r: -_safe_at_rest(cells, r, angles),
        bounds=(max(inner, best - step), min(outer, best + step)),
        method="bounded",
        options={"xatol": 1e-4 * (outer - inner)},
    )
    return float(result.x)


def _figure(disc: Disc, cells: _Cells, offset: float) -> Series:
    radius = np.linspace(disc.inner_radius, disc.outer_radius, 61)
    rest = np.array([_safe_at_rest(cells, r, _ANGLES[::4]) for r in radius])
    running = np.array([_safe_turning(cells, r, np.array([offset]), _ANGLES[::30]) for r in radius])
    return figure(
        "largest fill that leaves the gas hole dry",
        ("radius of the hole on the centre line", "m", radius),
        Curve("running", "1", running),
        Curve("stopped, worst angle", "1", rest),
        Curve("largest fill", "1", np.full(radius.shape, disc.max_fill_ratio), style="paper"),
    )
