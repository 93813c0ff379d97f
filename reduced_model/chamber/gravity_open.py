"""What gravity does to a ring so thin that it no longer covers the whole outer wall, by quadrature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.reduced_model.chamber.gravity import GravityEffect
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

_POINTS: Final = 400
_TURN: Final = 24
_BISECTIONS: Final = 60


@dataclass(frozen=True, kw_only=True)
class _Tilted:
    """A chamber under gravity: r^2 of its surface for a level b^2, at points along the angle or the axis."""

    surface: Callable[[FloatArray], FloatArray]
    """From b^2, shape (n, turn), to r^2, shape (n, turn, points), between zero and R2^2."""
    wall: FloatArray
    """|r + g/omega^2|^2 on the outer wall, m^2, shape (turn, points)."""
    direction: FloatArray
    """Cosine of the angle from the chamber's centre line, shape (turn, points)."""
    reach: float
    """How far b^2 can lie from the r^2 of the untilted surface, m^2."""


def open_ring_effect(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    gravity: float,
    vertical: bool,
    fill_ratio: FloatArray,
) -> GravityEffect:
    """Change of wall pressure and moment by gravity, means over a turn, with parts of the wall dry.

    The free surface |r + g/omega^2| = b, b from the liquid's volume, is cut off where it would lie beyond the
    outer wall; the plates are taken as radial.
    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `gravity`: g, m/s^2. `vertical`: whether
        gravity points along the shaft. `fill_ratio`: x, shape (n,).
    Returns: GravityEffect, shape (n,); zero for an empty chamber.
    Source: hydrostatics in the rotating frame; agrees with `gravity_effect` where the ring is closed.
    """
    outer, alpha = disc.outer_radius, float(half_angle(disc=disc, radius=disc.outer_radius))
    delta = gravity / angular_velocity**2
    tilted = _along_shaft(disc, alpha, delta) if vertical else _across_shaft(disc, alpha, delta)
    depth = (outer**2 - surface_radius(disc=disc, fill_ratio=fill_ratio) ** 2)[:, None]
    wanted = np.broadcast_to(depth, (fill_ratio.size, tilted.wall.shape[0]))
    level = _level(tilted, wanted, outer)
    pressure = np.maximum(tilted.wall - level[..., None], 0.0) - wanted[..., None]
    flat = ((outer**2 - wanted) ** 1.5)[..., None]
    moment = (flat - tilted.surface(level) ** 1.5) * tilted.direction
    return GravityEffect(
        wall_pressure=np.asarray(density * angular_velocity**2 / 2 * pressure.mean(axis=(1, 2))),
        moment=np.asarray(density * disc.axial_width * 2 * alpha / 3 * moment.mean(axis=(1, 2))),
    )


def _along_shaft(disc: Disc, alpha: float, delta: float) -> _Tilted:
    outer, rise = disc.outer_radius, delta * disc.axial_width * _midpoints()[None, :]

    def surface(level: FloatArray) -> FloatArray:
        return np.asarray(np.clip(level[..., None] + rise, 0.0, outer**2))

    return _Tilted(
        surface=surface,
        wall=outer**2 - rise,
        direction=np.full(rise.shape, np.sin(alpha) / alpha),
        reach=delta * disc.axial_width,
    )


def _across_shaft(disc: Disc, alpha: float, delta: float) -> _Tilted:
    outer, phi = disc.outer_radius, alpha * _midpoints()[None, :]
    psi = phi - 2 * np.pi * np.arange(_TURN)[:, None] / _TURN

    def surface(level: FloatArray) -> FloatArray:
        across = np.maximum(level[..., None] - (delta * np.sin(psi)) ** 2, 0.0)
        return np.asarray(np.clip(np.sqrt(across) - delta * np.cos(psi), 0.0, outer) ** 2)

    return _Tilted(
        surface=surface,
        wall=outer**2 + delta**2 + 2 * outer * delta * np.cos(psi),
        direction=np.broadcast_to(np.cos(phi), psi.shape),
        reach=delta**2 + 2 * outer * delta,
    )


def _midpoints() -> FloatArray:
    return np.asarray((2 * np.arange(_POINTS) + 1) / _POINTS - 1, dtype=np.float64)


def _level(tilted: _Tilted, wanted: FloatArray, outer: float) -> FloatArray:
    """b^2 at which the mean of R2^2 - r^2 is the wanted one, by bisection."""
    low, high = outer**2 - wanted - tilted.reach, outer**2 - wanted + tilted.reach
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        deep = (outer**2 - tilted.surface(middle)).mean(axis=-1) > wanted
        low, high = np.where(deep, middle, low), np.where(deep, high, middle)
    return np.asarray((low + high) / 2)
