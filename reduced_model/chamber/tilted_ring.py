"""The ring under gravity at rest in the rotating frame, to all orders and without a mesh, by quadrature.

Its free surface is the circle |r + g/omega^2| = b (horizontal shaft) or the paraboloid r^2 = c^2 + 2 G z
(vertical), G = g/omega^2, with b or c from the liquid's volume.  With phi = eta alpha(r) every integral over
the chamber is smooth in eta, plates and all, so that few Gauss points give all digits, as long as no part of
the outer wall runs dry.  An imported chamber is integrated over its walls instead, `mesh.chamber_table`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from ringbalance.mesh.chamber_table import TiltedLiquid, tilted_liquid
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
from ringbalance.scene.models import Disc, Scene

POINTS: Final = 20
"""Gauss points along the angle or the axis."""
RADIAL_POINTS: Final = 14
_NEWTON_STEPS: Final = 12
_TURN_SAMPLES: Final = (8, 96)
"""Fewest and most angles of gravity over a turn."""
_AVERAGING_ERROR: Final = 1e-12
_AREA_ROUND_OFF: Final = 4 * float(np.finfo(np.float64).eps)
"""Error of an area by rounding, over R2^2."""


@cache
def _rule(points: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points within [-1, 1] and their weights; most runs need no rule of many points."""
    abscissae, weights = np.polynomial.legendre.leggauss(points)
    return np.asarray(abscissae, dtype=np.float64), np.asarray(weights, dtype=np.float64)


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
    """True where the liquid covers the whole outer wall; elsewhere values of a sector are invalid."""

    @classmethod
    def of(cls, scene: Scene, fill_ratio: FloatArray) -> TiltedRing:
        """Wall pressure, moment and dU/dV' of a chamber under gravity, exactly for liquid at rest.

        p = rho omega^2 (|r + g/omega^2|^2 - b^2)/2; dU/dV' = rho int x w / int w on the surface,
        w = 1/|grad p|.  On a horizontal shaft gravity turns across the chamber.  At a point fixed in the disc
        its mean over a turn is rho omega^2 (r^2 - a^2)/2, with a^2 the mean of b^2 - (g/omega^2)^2, which
        both chambers of a pair share.  The tube is driven by that mean; a swing about it of e times the
        driving pressure reduces the mean velocity by the fraction e^2/16.
        Args: `fill_ratio`: x, shape (n,), above zero.
        Range: a surface that stays outside the plates' inner edge; the inner radius is not checked.
        Source: Eqs. 9 to 11 of the liquid-ring paper with gravity and exact plates; hydrostatics.
        """
        disc, density, square = scene.disc, scene.liquid.density, scene.rotor.speed**2
        length, turn, shaft = scene.environment.gravity / square, turn_samples(scene), scene.environment.shaft
        if (table := imported_table(disc)) is not None:
            samples = turn if shaft == "horizontal" else 0
            fills = tuple(float(x) for x in fill_ratio)
            liquid = tilted_liquid(table, length=length, vertical=samples == 0, turn=samples, fills=fills)
            turned = replace(liquid, moment=liquid.moment / disc.axial_width)
        elif shaft == "vertical":
            turned = _on_vertical_shaft(disc, length, fill_ratio)
        else:
            turned = _on_horizontal_shaft(disc, length, fill_ratio, turn)
        scale = density * square / 2
        return cls(
            wall_pressure=scale * turned.wall_square.mean(axis=1),
            hydrostatic_pressure=scale * (disc.outer_radius**2 - turned.surface_square.mean(axis=1)),
            moment=density * disc.axial_width * turned.moment.mean(axis=1),
            moment_per_volume=density * turned.centroid.mean(axis=1),
            wall_pressure_ripple=scale * _first_harmonic(turned.wall_square),
            moment_ripple=density * disc.axial_width * _first_harmonic(turned.moment),
            closed=np.all(turned.closed, axis=1),
        )


def turn_samples(scene: Scene) -> int:
    """Number of angles of gravity for means to twelve digits: harmonics fall like (g/(omega^2 R1))^n."""
    tilt = scene.environment.gravity / (scene.rotor.speed**2 * scene.disc.inner_radius)
    if tilt < 1e-12:
        return _TURN_SAMPLES[0]
    wanted = np.log(_AVERAGING_ERROR) / np.log(min(tilt, 0.9))
    return 2 * int(np.clip(np.ceil(wanted / 2), _TURN_SAMPLES[0] // 2, _TURN_SAMPLES[1] // 2))


def _first_harmonic(values: FloatArray) -> FloatArray:
    count = values.shape[1]
    if count == 1:
        return np.zeros(values.shape[0])
    turn = np.exp(2j * np.pi * np.arange(count) / count)
    return np.asarray(2 / count * np.abs(values @ turn))


def _held(disc: Disc, radius: FloatArray) -> FloatArray:
    """Clip radii to the range of the chamber's formulas."""
    return np.asarray(np.clip(radius, disc.plate_thickness * 1.001 + 1e-12, disc.outer_radius))


def _on_vertical_shaft(disc: Disc, length: float, fills: FloatArray) -> TiltedLiquid:
    abscissa, weights = _rule(POINTS)
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills) ** 2
    rise, weight = length * disc.axial_width * abscissa[None, :], weights[None, :] / 2
    target = liquid_area(disc=disc, surface_radius=np.sqrt(start))
    reach, square = length * disc.axial_width + outer**2 * 1e-12, start
    for step in range(_NEWTON_STEPS + 1):
        radius = _held(disc, np.sqrt(np.maximum(square[:, None] + rise, 0.0)))
        alpha = half_angle(disc=disc, radius=radius)
        excess = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=1) - target
        if step < _NEWTON_STEPS:
            square = np.clip(square + excess / np.sum(weight * alpha, axis=1), start - reach, start + reach)
    level = square[:, None] + rise
    moment = np.sum(weight * liquid_first_moment(disc=disc, surface_radius=radius), axis=1)
    centroid = np.sum(weight * radius * np.sin(alpha), axis=1) / np.sum(weight * alpha, axis=1)
    return TiltedLiquid(
        wall_square=np.sum(weight * (outer**2 - level), axis=1)[:, None],
        surface_square=square[:, None],
        moment=moment[:, None],
        centroid=centroid[:, None],
        closed=np.all(level < outer**2, axis=1)[:, None],
    )


def _on_horizontal_shaft(disc: Disc, length: float, fills: FloatArray, turn: int) -> TiltedLiquid:
    abscissa, weights = _rule(POINTS)
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills)[:, None]
    psi = (2 * np.pi * np.arange(turn) / turn)[None, :, None]
    eta, weight = abscissa[None, None, :], weights[None, None, :] / 2
    target = liquid_area(disc=disc, surface_radius=start)
    radius = np.broadcast_to(start[..., None], (fills.size, turn, weights.size)).copy()
    # b^2, started from the first order in g/omega^2.
    alpha = half_angle(disc=disc, radius=start)
    square = (start + length * np.sin(alpha) / alpha * np.cos(psi[..., 0])) ** 2
    reach = length**2 + 2 * outer * length + outer**2 * 1e-12
    for _ in range(_NEWTON_STEPS):
        for _ in range(3):
            level, slope = _level(disc, length, radius, eta, psi)
            radius = _held(disc, radius - (level - square[..., None]) / slope)
        opening = np.sum(weight * 2 * half_angle(disc=disc, radius=radius) * radius / slope, axis=2)
        excess = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=2) - target
        if np.all(np.abs(excess) <= _AREA_ROUND_OFF * outer**2):
            break
        square = np.clip(square + excess / opening, start**2 - reach, start**2 + reach)
    _, slope = _level(disc, length, radius, eta, psi)
    half = half_angle(disc=disc, radius=radius)
    share = weight * half * radius / slope
    wall = outer**2 + 2 * outer * length * np.cos(eta * half_angle(disc=disc, radius=outer) - psi) + length**2
    depth = wall - square[..., None]
    # 2 int r^2 cos(eta alpha) alpha dr from the surface to the wall; its mean over eta is int x dA.
    points, radial_weights = _rule(RADIAL_POINTS)
    middle = (outer - radius)[..., None] / 2
    r = radius[..., None] + middle * (1 + points)
    alpha = half_angle(disc=disc, radius=r)
    levers = middle * radial_weights * r**2 * np.cos(eta[..., None] * alpha) * alpha
    moment_on_rays = 2 * np.sum(levers, axis=-1)
    return TiltedLiquid(
        wall_square=np.sum(weight * depth, axis=2),
        surface_square=square - length**2,
        moment=np.sum(weight * moment_on_rays, axis=2),
        centroid=np.sum(share * radius * np.cos(eta * half), axis=2) / np.sum(share, axis=2),
        closed=np.all(depth > 0, axis=2),
    )


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


def check_ring(scene: Scene) -> None:
    """Refuse a horizontal rotor too slow for the liquid to form a ring, omega^2 a <= g.

    a is the smallest free-surface radius, that of the largest fill.
    Raises: SceneError: naming the speed and the lowest one allowed.
    Source: the free surface |r + g/omega^2| = const of a liquid at rest in the rotating frame.
    """
    gravity = scene.environment.gravity if scene.environment.shaft == "horizontal" else 0.0
    if abs(scene.rotor.speed) > math.sqrt(gravity / scene.disc.inner_radius):
        # Fast enough for a surface at the inner radius, the innermost one possible.
        return
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
    """True where the liquid still covers the whole outer wall under gravity, and for an empty chamber.

    Source: `TiltedRing.of`.
    """
    closed, wet = np.ones(fill_ratio.shape, dtype=np.bool_), fill_ratio > 0
    closed[wet] = TiltedRing.of(scene, fill_ratio[wet]).closed
    return closed
