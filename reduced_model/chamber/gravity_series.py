"""Gravity's effect on a chamber as a series in g/(omega^2 a): ripple to first order, means to second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.reduced_model.chamber.gravity import gravity_effect
from ringbalance.scene.models import Scene

_STEP: Final = 1e-4
"""Of the fill ratio, for the slope of the moment's change."""


@dataclass(frozen=True, kw_only=True)
class SecondOrder:
    """What gravity adds to a chamber at one fill ratio."""

    wall_pressure: float
    """To the mean over a turn, Pa."""
    moment: float
    """To the mean over a turn, kg m."""
    moment_per_mass: float
    """To lambda of added liquid, m."""
    wall_pressure_ripple: float
    """First harmonic over a turn, Pa zero-to-peak."""
    moment_ripple: float
    """First harmonic over a turn, kg m zero-to-peak."""


def second_order(*, scene: Scene, fill_ratio: float) -> SecondOrder:
    """Series of the tilted free surface |r + g/omega^2| = b at constant volume.

    With delta = g/omega^2, alpha the half-angle at the surface a, s = sin(alpha)/alpha (s_2 at R2): ripple of
    the wall pressure rho omega^2 delta |R2 s_2 - a s|, of the moment
    rho B a^2 delta |alpha + sin(alpha) cos(alpha) - 2 sin^2(alpha)/alpha|; the means as in `gravity_effect`,
    lambda by the slope of the moment's change.  On a vertical shaft there is no ripple.
    Args: `fill_ratio`: x, above zero.
    Range: delta small against a, and a ring that covers the whole outer wall.
    Source: expansion of the free surface; first order exact with plates, second order with radial ones.
    """
    disc, rho, omega = scene.disc, scene.liquid.density, scene.rotor.speed
    step = _STEP * fill_ratio
    fills = np.array([fill_ratio - step, fill_ratio, min(fill_ratio + step, 1.0)])
    effect = gravity_effect(
        disc=disc,
        density=rho,
        angular_velocity=omega,
        gravity=scene.environment.gravity,
        vertical=scene.environment.shaft == "vertical",
        fill_ratio=fills,
    )
    mass = rho * chamber_volume(disc=disc) * float(fills[2] - fills[0])
    pressure, moment = _ripple(scene, fill_ratio)
    return SecondOrder(
        wall_pressure=float(effect.wall_pressure[1]),
        moment=float(effect.moment[1]),
        moment_per_mass=2 * float(effect.moment[2] - effect.moment[0]) / mass,
        wall_pressure_ripple=pressure,
        moment_ripple=moment,
    )


def _ripple(scene: Scene, fill: float) -> tuple[float, float]:
    if scene.environment.shaft == "vertical":
        return 0.0, 0.0
    disc, rho, omega = scene.disc, scene.liquid.density, scene.rotor.speed
    delta = scene.environment.gravity / omega**2
    a, outer = float(surface_radius(disc=disc, fill_ratio=fill)), disc.outer_radius
    alpha, at_wall = (float(half_angle(disc=disc, radius=r)) for r in (a, outer))
    s, wall = np.sin(alpha) / alpha, np.sin(at_wall) / at_wall
    shape = alpha + np.sin(alpha) * np.cos(alpha) - 2 * np.sin(alpha) ** 2 / alpha
    pressure = rho * omega**2 * delta * abs(outer * wall - a * s)
    return float(pressure), float(rho * disc.axial_width * a**2 * delta * abs(shape))
