"""The ring under gravity at rest in the rotating frame, to all orders and without a mesh, by quadrature.

Its free surface is the circle |r + g/omega^2| = b (horizontal shaft) or the paraboloid r^2 = c^2 + 2 G z
(vertical), G = g/omega^2, with b or c from the liquid's volume.  With phi = eta alpha(r) every integral over
the chamber is smooth in eta, plates and all, so that few Gauss points give all digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import half_angle, liquid_area, liquid_first_moment, surface_radius
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Disc, Shaft

POINTS: Final = 20
"""Gauss points along the angle or the axis."""
RADIAL_POINTS: Final = 14
NEWTON_STEPS: Final = 12
_TURN: Final = (8, 96)
"""Fewest and most angles of gravity over a turn."""
_AVERAGING: Final = 1e-12
_ABSCISSA, _WEIGHT = np.polynomial.legendre.leggauss(POINTS)
_RADIAL, _RADIAL_WEIGHT = np.polynomial.legendre.leggauss(RADIAL_POINTS)


@dataclass(frozen=True, kw_only=True)
class TiltedRing:
    """Means over a turn and first harmonics, along the fill ratio, shape (n,)."""

    wall_pressure: FloatArray
    """Mean over the outer wall and over a turn, Pa."""
    moment: FloatArray
    """U, mean over a turn, kg m."""
    moment_per_volume: FloatArray
    """dU/dV', mean over a turn, kg/m^2."""
    wall_pressure_ripple: FloatArray
    """First harmonic over a turn, Pa zero-to-peak."""
    moment_ripple: FloatArray
    """First harmonic over a turn, kg m zero-to-peak."""
    closed: BoolArray
    """Whether the liquid covers the whole outer wall; values hold only there."""
    points: int
    """Quadrature points of one fill ratio, for the count of work."""


@dataclass(frozen=True, kw_only=True)
class _Turned:
    """One quantity at every angle of gravity, shape (n, turn)."""

    wall_pressure: FloatArray
    moment: FloatArray
    moment_per_volume: FloatArray
    closed: BoolArray


def turn_samples(*, disc: Disc, angular_velocity: float, gravity: float) -> int:
    """Angles of gravity over a turn for means good to twelve digits.

    Args: `angular_velocity`: omega, rad/s. `gravity`: g across the shaft, m/s^2.
    Returns: An even number.
    Source: harmonics fall like (g/(omega^2 R1))^n.
    """
    tilt = gravity / (angular_velocity**2 * disc.inner_radius)
    if tilt < 1e-12:
        return _TURN[0]
    wanted = np.log(_AVERAGING) / np.log(min(tilt, 0.9))
    return 2 * int(np.clip(np.ceil(wanted / 2), _TURN[0] // 2, _TURN[1] // 2))


def tilted_ring(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    gravity: float,
    shaft: Shaft,
    fill_ratio: FloatArray,
) -> TiltedRing:
    """Wall pressure, moment and dU/dV' of a chamber under gravity, exactly for liquid at rest.

    p = rho omega^2 (|r + g/omega^2|^2 - b^2)/2; dU/dV' = rho int x w / int w on the surface, w = 1/|grad p|.
    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s, not zero. `gravity`: g, m/s^2. `shaft`:
        "horizontal" turns gravity across the chamber. `fill_ratio`: x, shape (n,), above zero.
    Range: a ring that covers the whole outer wall; `closed` says where.
    Source: Eqs. 9 to 11 of the liquid-ring paper with gravity and exact plates; hydrostatics.
    """
    length = gravity / angular_velocity**2
    if shaft == "vertical":
        turned, turn = _along(disc, length, fill_ratio), 1
    else:
        turn = turn_samples(disc=disc, angular_velocity=angular_velocity, gravity=gravity)
        turned = _across(disc, length, fill_ratio, turn)
    scale = density * angular_velocity**2 / 2
    return TiltedRing(
        wall_pressure=scale * turned.wall_pressure.mean(axis=1),
        moment=density * disc.axial_width * turned.moment.mean(axis=1),
        moment_per_volume=density * turned.moment_per_volume.mean(axis=1),
        wall_pressure_ripple=scale * _first_harmonic(turned.wall_pressure),
        moment_ripple=density * disc.axial_width * _first_harmonic(turned.moment),
        closed=np.all(turned.closed, axis=1),
        points=turn * POINTS * RADIAL_POINTS,
    )


def _first_harmonic(values: FloatArray) -> FloatArray:
    count = values.shape[1]
    if count == 1:
        return np.zeros(values.shape[0])
    turn = np.exp(2j * np.pi * np.arange(count) / count)
    return np.asarray(2 / count * np.abs(values @ turn))


def _along(disc: Disc, length: float, fills: FloatArray) -> _Turned:
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills) ** 2
    rise = length * disc.axial_width * _ABSCISSA[None, :]
    target = liquid_area(disc=disc, surface_radius=np.sqrt(start))
    weight = _WEIGHT[None, :] / 2
    square = start.copy()
    for _ in range(NEWTON_STEPS):
        radius = _held(disc, np.sqrt(np.maximum(square[:, None] + rise, 0.0)))
        area = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=1)
        square = square + (area - target) / np.sum(weight * half_angle(disc=disc, radius=radius), axis=1)
    radius = _held(disc, np.sqrt(np.maximum(square[:, None] + rise, 0.0)))
    alpha = half_angle(disc=disc, radius=radius)
    centre = np.sum(weight * radius * np.sin(alpha), axis=1) / np.sum(weight * alpha, axis=1)
    moment = np.sum(weight * liquid_first_moment(disc=disc, surface_radius=radius), axis=1)
    return _Turned(
        wall_pressure=(outer**2 - square)[:, None],
        moment=moment[:, None],
        moment_per_volume=centre[:, None],
        closed=np.all(square[:, None] + rise < outer**2, axis=1)[:, None],
    )


def _held(disc: Disc, radius: FloatArray) -> FloatArray:
    """Within what the chamber's formulas take; a surface beyond the wall or the hub is flagged by
    `closed`."""
    return np.asarray(np.clip(radius, disc.plate_thickness * 1.001 + 1e-12, disc.outer_radius))


def _across(disc: Disc, length: float, fills: FloatArray, turn: int) -> _Turned:
    outer, start = disc.outer_radius, surface_radius(disc=disc, fill_ratio=fills)
    psi = (2 * np.pi * np.arange(turn) / turn)[None, :, None]
    eta, weight = _ABSCISSA[None, None, :], _WEIGHT[None, None, :] / 2
    target = liquid_area(disc=disc, surface_radius=start)[:, None]
    radius = np.broadcast_to(start[:, None, None], (fills.size, turn, POINTS)).copy()
    # b^2, started from the first order in g/omega^2.
    alpha = half_angle(disc=disc, radius=start)[:, None]
    square = (start[:, None] + length * np.sin(alpha) / alpha * np.cos(psi[..., 0])) ** 2
    for _ in range(NEWTON_STEPS):
        for _ in range(3):
            level, slope = _level(disc, length, radius, eta, psi)
            radius = _held(disc, radius - (level - square[..., None]) / slope)
        opening = 2 * half_angle(disc=disc, radius=radius) * radius / slope
        area = np.sum(weight * liquid_area(disc=disc, surface_radius=radius), axis=2)
        square = square + (area - target) / np.sum(weight * opening, axis=2)
    _, slope = _level(disc, length, radius, eta, psi)
    share = weight * half_angle(disc=disc, radius=radius) * radius / slope
    place = radius * np.cos(eta * half_angle(disc=disc, radius=radius))
    wall = outer**2 + 2 * outer * length * np.cos(eta * half_angle(disc=disc, radius=outer) - psi) + length**2
    return _Turned(
        wall_pressure=np.sum(weight * wall, axis=2) - square,
        moment=np.sum(weight * _moment_on_rays(disc, radius, eta), axis=2),
        moment_per_volume=np.sum(share * place, axis=2) / np.sum(share, axis=2),
        closed=np.all(wall > square[..., None], axis=2),
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


def _moment_on_rays(disc: Disc, radius: FloatArray, eta: FloatArray) -> FloatArray:
    """2 int r^2 cos(eta alpha) alpha dr from the surface to the wall, m^3; its mean over eta is int x dA."""
    half = (disc.outer_radius - radius)[..., None] / 2
    r = radius[..., None] + half * (1 + _RADIAL)
    alpha = half_angle(disc=disc, radius=r)
    return np.asarray(
        2 * np.sum(half * _RADIAL_WEIGHT * r**2 * np.cos(eta[..., None] * alpha) * alpha, axis=-1)
    )
