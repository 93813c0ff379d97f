"""The ring under gravity at rest in the rotating frame, to all orders and without a mesh, by quadrature.

Its free surface is the circle |r + g/omega^2| = b (horizontal shaft) or the paraboloid r^2 = c^2 + 2 G z
(vertical), G = g/omega^2, with b or c from the liquid's volume.  With phi = eta alpha(r) every integral over
the chamber is smooth in eta, plates and all, so that few Gauss points give all digits.  Where part of the
outer wall runs dry the surface is cut off there; the integrals have kinks and take more points.  An imported
chamber is integrated over its walls instead, `mesh.cut`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.chamber_table import ChamberTable, tilted_liquid
from ringbalance.mesh.geometry import (
    half_angle,
    imported_table,
    liquid_area,
    liquid_first_moment,
    surface_radius,
)
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loop_models import Shaft
from ringbalance.scene.models import Disc, Scene

POINTS: Final = 20
"""Gauss points along the angle or the axis."""
RADIAL_POINTS: Final = 14
_OPEN_POINTS: Final = 200
"""The same where part of the wall is dry: about four digits of gravity's effect."""
_STEPS: Final = (12, 60)
"""At most, of Newton's method on a closed ring, and within bounds where the wall is dry."""
_KINKED: Final = 12
"""Steps after which bounds are halved, should kinks keep Newton's method from arriving."""
_DRY_ROUND_OFF: Final = 1e-13
"""Of an area, over R2^2, where the wall is dry."""
_TURN: Final = (8, 96)
"""Fewest and most angles of gravity over a turn."""
_AVERAGING: Final = 1e-12
_ROUND_OFF: Final = 4 * float(np.finfo(np.float64).eps)
"""Of an area, over R2^2."""


@cache
def _rule(points: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points within [-1, 1] and their weights; most runs need no rule of many points."""
    places, weights = np.polynomial.legendre.leggauss(points)
    return np.asarray(places, dtype=np.float64), np.asarray(weights, dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class TiltedRing:
    """Means over a turn and first harmonics, along the fill ratio, shape (n,)."""

    wall_pressure: FloatArray
    """Mean over the outer wall and over a turn, Pa."""
    hydrostatic_pressure: FloatArray
    """Mean over a turn at the outer radius R2, half-way along the chamber, whatever the walls, Pa."""
    moment: FloatArray
    """U, mean over a turn, kg m."""
    moment_per_volume: FloatArray
    """dU/dV', mean over a turn, kg/m^2."""
    wall_pressure_ripple: FloatArray
    """First harmonic over a turn, Pa zero-to-peak."""
    moment_ripple: FloatArray
    """First harmonic over a turn, kg m zero-to-peak."""
    closed: BoolArray
    """Whether the liquid covers the whole outer wall; where not, values of a sector have four digits."""

    @classmethod
    def of(cls, scene: Scene, fill_ratio: FloatArray) -> TiltedRing:
        """Wall pressure, moment and dU/dV' of a chamber under gravity, exactly for liquid at rest.

        p = rho omega^2 (|r + g/omega^2|^2 - b^2)/2; dU/dV' = rho int x w / int w on the surface,
        w = 1/|grad p|.  On a horizontal shaft gravity turns across the chamber.  At a place that turns with
        the disc the mean of that over a turn is rho omega^2 (r^2 - a^2)/2, with a^2 the mean of
        b^2 - (g/omega^2)^2, which both chambers of a pair share.  The tube is driven by that mean; what the
        swing about it, of a share e of the driving pressure, takes off the mean velocity is e^2/16.
        Args: `fill_ratio`: x, shape (n,), above zero.
        Range: a surface that stays outside the plates' inner edge; the inner radius is not looked at.
        Source: Eqs. 9 to 11 of the liquid-ring paper with gravity and exact plates; hydrostatics.
        """
        disc, density, square = scene.disc, scene.liquid.density, scene.rotor.speed**2
        length, turn, shaft = scene.environment.gravity / square, turn_samples(scene), scene.environment.shaft
        table = imported_table(disc)

        def turned(fills: FloatArray) -> _Turned:
            if table is not None:
                return _imported(disc, table, length, fills, turn if shaft == "horizontal" else 0)
            return _of_sector(disc, length, fills, turn, shaft, cut=False)

        found = turned(fill_ratio)
        is_open = ~np.all(found.closed, axis=1)
        for place in np.flatnonzero(is_open) if table is None else ():
            part = _over_dry_wall(disc, length, float(fill_ratio[place]), turn, shaft)
            for name in ("wall_pressure", "surface_square", "moment", "moment_per_volume"):
                getattr(found, name)[place] = getattr(part, name)[0]
        scale = density * square / 2
        return cls(
            wall_pressure=scale * found.wall_pressure.mean(axis=1),
            hydrostatic_pressure=scale * (disc.outer_radius**2 - found.surface_square.mean(axis=1)),
            moment=density * disc.axial_width * found.moment.mean(axis=1),
            moment_per_volume=density * found.moment_per_volume.mean(axis=1),
            wall_pressure_ripple=scale * _first_harmonic(found.wall_pressure),
            moment_ripple=density * disc.axial_width * _first_harmonic(found.moment),
            closed=~is_open,
        )


@dataclass(frozen=True, kw_only=True)
class _Turned:
    """One quantity at every angle of gravity, shape (n, turn)."""

    wall_pressure: FloatArray
    surface_square: FloatArray
    """b^2 - G^2 or c^2, m^2."""
    moment: FloatArray
    moment_per_volume: FloatArray
    closed: BoolArray


def _of_sector(
    disc: Disc, length: float, fills: FloatArray, turn: int, shaft: Shaft, *, cut: bool
) -> _Turned:
    if shaft == "vertical":
        return _along(disc, length, fills, cut)
    return _across(disc, length, fills, turn, cut)


@lru_cache(maxsize=128)
def _over_dry_wall(disc: Disc, length: float, fill: float, turn: int, shaft: Shaft) -> _Turned:
    """At one fill, and once for all who ask for it: each takes a tenth of a second."""
    return _of_sector(disc, length, np.array([fill]), turn, shaft, cut=True)


def turn_samples(scene: Scene) -> int:
    """Angles of gravity for means good to twelve digits: harmonics fall like (g/(omega^2 R1))^n."""
    tilt = scene.environment.gravity / (scene.rotor.speed**2 * scene.disc.inner_radius)
    if tilt < 1e-12:
        return _TURN[0]
    wanted = np.log(_AVERAGING) / np.log(min(tilt, 0.9))
    return 2 * int(np.clip(np.ceil(wanted / 2), _TURN[0] // 2, _TURN[1] // 2))


def _imported(disc: Disc, table: ChamberTable, length: float, fills: FloatArray, turn: int) -> _Turned:
    """By integrals over the walls of a mesh, dry parts included. Args: `turn`: 0 on a vertical shaft."""
    found = tilted_liquid(
        table, length=length, vertical=turn == 0, turn=turn, fills=tuple(float(x) for x in fills)
    )
    return _Turned(
        wall_pressure=found.wall_square.copy(),
        surface_square=found.surface_square.copy(),
        moment=found.moment / disc.axial_width,
        moment_per_volume=found.centroid.copy(),
        closed=found.closed,
    )


def _first_harmonic(values: FloatArray) -> FloatArray:
    count = values.shape[1]
    if count == 1:
        return np.zeros(values.shape[0])
    turn = np.exp(2j * np.pi * np.arange(count) / count)
    return np.asarray(2 / count * np.abs(values @ turn))


@dataclass(frozen=True, kw_only=True)
class _Search:
    """b^2 or c^2, by Newton's method; where dry parts of the wall make kinks, within bounds that close in."""

    value: FloatArray
    low: FloatArray
    high: FloatArray
    bounded: bool

    def narrowed(self, excess: FloatArray, opening: FloatArray, step: int) -> _Search:
        """After the liquid's area exceeded its target by `excess`, which falls with b^2 like `opening`."""
        # No opening: the surface has left the chamber, and the bound is the next place to look.
        newton = self.value + excess / np.maximum(opening, np.finfo(float).tiny ** 0.5)
        if not self.bounded:
            return replace(self, value=np.clip(newton, self.low, self.high))
        low = np.where(excess > 0, self.value, self.low)
        high = np.where(excess > 0, self.high, self.value)
        inside = (newton >= low) & (newton <= high) & (step < _KINKED)
        return replace(self, value=np.where(inside, newton, (low + high) / 2), low=low, high=high)

    def reached(self, excess: FloatArray, outer: float) -> bool:
        """Whether nothing but rounding is left."""
        return bool(np.all(np.abs(excess) <= (_DRY_ROUND_OFF if self.bounded else _ROUND_OFF) * outer**2))


def _held(disc: Disc, radius: FloatArray) -> FloatArray:
    """Within what the chamber's formulas take."""
    return np.asarray(np.clip(radius, disc.plate_thickness * 1.001 + 1e-12, disc.outer_radius))


def _along(disc: Disc, length: float, fills: FloatArray, cut: bool) -> _Turned:
    abscissa, weights = _rule(_OPEN_POINTS if cut else POINTS)
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills) ** 2
    rise, weight = length * disc.axial_width * abscissa[None, :], weights[None, :] / 2
    target = liquid_area(disc=disc, surface_radius=np.sqrt(start))
    reach = length * disc.axial_width + outer**2 * 1e-12
    search = _Search(value=start, low=start - reach, high=start + reach, bounded=cut)

    def surface() -> tuple[FloatArray, FloatArray]:
        """Radius, and half-angle where it is wet."""
        radius = _held(disc, np.sqrt(np.maximum(search.value[:, None] + rise, 0.0)))
        return radius, np.where(radius < outer, half_angle(disc=disc, radius=radius), 0.0)

    for step in range(_STEPS[cut]):
        radius, alpha = surface()
        excess = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=1) - target
        if cut and search.reached(excess, outer):
            break
        search = search.narrowed(excess, np.sum(weight * alpha, axis=1), step)
    radius, alpha = surface()
    level = search.value[:, None] + rise
    moment = np.sum(weight * liquid_first_moment(disc=disc, surface_radius=radius), axis=1)
    return _Turned(
        wall_pressure=np.sum(weight * np.maximum(outer**2 - level, 0.0), axis=1)[:, None],
        surface_square=search.value[:, None].copy(),
        moment=moment[:, None],
        moment_per_volume=(np.sum(weight * radius * np.sin(alpha), axis=1) / np.sum(weight * alpha, axis=1))[
            :, None
        ],
        closed=np.all(level < outer**2, axis=1)[:, None],
    )


def _across(disc: Disc, length: float, fills: FloatArray, turn: int, cut: bool) -> _Turned:
    abscissa, weights = _rule(_OPEN_POINTS if cut else POINTS)
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills)
    psi = (2 * np.pi * np.arange(turn) / turn)[None, :, None]
    eta, weight = abscissa[None, None, :], weights[None, None, :] / 2
    target = liquid_area(disc=disc, surface_radius=start)[:, None]
    radius = np.broadcast_to(start[:, None, None], (fills.size, turn, weights.size)).copy()
    # b^2, started from the first order in g/omega^2.
    alpha = half_angle(disc=disc, radius=start)[:, None]
    first = (start[:, None] + length * np.sin(alpha) / alpha * np.cos(psi[..., 0])) ** 2
    reach = length**2 + 2 * outer * length + outer**2 * 1e-12
    middle = np.broadcast_to(start[:, None] ** 2, first.shape)
    search = _Search(value=first, low=middle - reach, high=middle + reach, bounded=cut)
    for step in range(_STEPS[cut]):
        for _ in range(3):
            level, slope = _level(disc, length, radius, eta, psi)
            radius = _held(disc, radius - (level - search.value[..., None]) / slope)
        opening = np.where(radius < outer, 2 * half_angle(disc=disc, radius=radius) * radius / slope, 0.0)
        excess = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=2) - target
        if search.reached(excess, outer):
            break
        search = search.narrowed(excess, np.sum(weight * opening, axis=2), step)
    _, slope = _level(disc, length, radius, eta, psi)
    half = half_angle(disc=disc, radius=radius)
    share = np.where(radius < outer, weight * half * radius / slope, 0.0)
    wall = outer**2 + 2 * outer * length * np.cos(eta * half_angle(disc=disc, radius=outer) - psi) + length**2
    depth = wall - search.value[..., None]
    return _Turned(
        wall_pressure=np.sum(weight * np.maximum(depth, 0.0), axis=2),
        surface_square=search.value - length**2,
        moment=np.sum(weight * _moment_on_rays(disc, radius, eta), axis=2),
        moment_per_volume=_mean(radius * np.cos(eta * half), share),
        closed=np.all(depth > 0, axis=2),
    )


def _mean(values: FloatArray, share: FloatArray) -> FloatArray:
    """Weighted by shares of the surface; 0 where none of it is wet."""
    wet = np.sum(share, axis=2)
    return np.asarray(np.divide(np.sum(share * values, axis=2), wet, out=np.zeros_like(wet), where=wet > 0))


def _level(
    disc: Disc, length: float, radius: FloatArray, eta: FloatArray, psi: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """|r + g/omega^2|^2 on the ray eta, and its slope along the ray."""
    t = disc.plate_thickness
    angle = eta * half_angle(disc=disc, radius=radius) - psi
    bend = eta * t / (radius * np.sqrt(np.maximum(radius**2 - t**2, 1e-300)))
    level = radius**2 + 2 * radius * length * np.cos(angle) + length**2
    slope = 2 * radius + 2 * length * (np.cos(angle) - radius * np.sin(angle) * bend)
    return level, slope


def _moment_on_rays(disc: Disc, radius: FloatArray, eta: FloatArray) -> FloatArray:
    """2 int r^2 cos(eta alpha) alpha dr from the surface to the wall, m^3; its mean over eta is int x dA."""
    places, weights = _rule(RADIAL_POINTS)
    half = (disc.outer_radius - radius)[..., None] / 2
    r = radius[..., None] + half * (1 + places)
    alpha = half_angle(disc=disc, radius=r)
    return np.asarray(2 * np.sum(half * weights * r**2 * np.cos(eta[..., None] * alpha) * alpha, axis=-1))


def check_ring(scene: Scene) -> None:
    """Refuse a horizontal rotor too slow for the liquid to form a ring, omega^2 a <= g.

    a is the smallest free-surface radius, that of the largest fill.
    Raises: SceneError: naming the speed and the lowest one allowed.
    Source: the free surface |r + g/omega^2| = const of a liquid at rest in the rotating frame.
    """
    gravity = scene.environment.gravity if scene.environment.shaft == "horizontal" else 0.0
    radius = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    lowest = math.sqrt(gravity / radius)
    if abs(scene.rotor.speed) > lowest:
        return
    fault = scene_fault(
        scene,
        "rotor.speed",
        problem="so slow that gravity keeps the liquid from forming a ring",
        allowed=f"above {lowest * 30 / math.pi:.4g} rpm",
    )
    raise SceneError([fault])


def closed_ring(scene: Scene, fill_ratio: FloatArray) -> BoolArray:
    """Whether the liquid still covers the whole outer wall under gravity; an empty chamber counts as closed.

    Source: `TiltedRing.of`.
    """
    closed, wet = np.ones(fill_ratio.shape, dtype=np.bool_), fill_ratio > 0
    closed[wet] = TiltedRing.of(scene, fill_ratio[wet]).closed
    return closed
