"""What gravity does to the means over a turn, to second order, and when a ring exists at all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Disc, Scene

SAFETY: Final = 1.5
"""Factor on the estimates, for the orders above and the plates' shape."""


@dataclass(frozen=True, kw_only=True)
class GravityEffect:
    """Change of the means over a turn by gravity; arrays along the fill ratio."""

    wall_pressure: FloatArray
    """Pa."""
    moment: FloatArray
    """kg m."""


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
        scene=scene,
        table="rotor",
        key="speed",
        problem="so slow that gravity keeps the liquid from forming a ring",
        allowed=f"above {lowest * 30 / math.pi:.4g} rpm",
    )
    raise SceneError([fault])


def gravity_ratio(scene: Scene) -> float:
    """Gravity over the centrifugal acceleration at the free surface of equal fills, eps = g/(omega^2 a).

    Returns: eps; the first-order ripple at 1x that a horizontal shaft gives the liquid.
    Source: definition.
    """
    radius = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2))
    return scene.environment.gravity / (scene.rotor.speed**2 * radius)


def gravity_effect(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    gravity: float,
    vertical: bool,
    fill_ratio: FloatArray,
) -> GravityEffect:
    """Second-order change of wall pressure and moment, means over a turn.

    With delta = g/omega^2, alpha the half-angle at the free surface a and s = sin(alpha)/alpha,
    horizontal shaft: dP = rho omega^2 delta^2 (1 - s^2)/2,
    dU = -rho B a delta^2 sin(alpha) (3 s^2 - 1 - 2 s cos(alpha))/2;
    vertical shaft: dP = rho omega^2 delta^2 B^2 t/(24 alpha a^3), dU = -rho B^3 delta^2 sin(alpha)/(12 a).
    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `gravity`: g, m/s^2. `vertical`: whether
        gravity points along the shaft. `fill_ratio`: x, shape (n,).
    Returns: GravityEffect, shape (n,); zero for an empty chamber.
    Range: delta small against the liquid's depth.
    Source: expansion of the free surface |r + g/omega^2| = const at constant volume, plates taken as radial.
    """
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    alpha, delta = half_angle(disc=disc, radius=a), gravity / angular_velocity**2
    s, width = np.sin(alpha) / alpha, disc.axial_width
    wet = fill_ratio > 0
    if vertical:
        moment = -density * width**3 * delta**2 * np.sin(alpha) / (12 * a)
        opening = disc.plate_thickness / (24 * alpha * a**3)
        pressure = density * angular_velocity**2 * delta**2 * width**2 * opening
        return _where_wet(wet, pressure, moment)
    bracket = 3 * s**2 - 1 - 2 * s * np.cos(alpha)
    moment = -density * width * a * delta**2 * np.sin(alpha) * bracket / 2
    pressure = density * angular_velocity**2 * delta**2 * (1 - s**2) / 2
    return _where_wet(wet, pressure, moment)


def _where_wet(wet: BoolArray, pressure: FloatArray, moment: FloatArray) -> GravityEffect:
    return GravityEffect(wall_pressure=np.where(wet, pressure, 0.0), moment=np.where(wet, moment, 0.0))


def closed_ring(
    *, disc: Disc, angular_velocity: float, gravity: float, vertical: bool, fill_ratio: FloatArray
) -> BoolArray:
    """Whether the liquid still covers the whole outer wall under gravity.

    Horizontal shaft: R2 - a > g/omega^2; vertical: R2^2 - a^2 > g B/omega^2.
    Args: `angular_velocity`: omega, rad/s. `gravity`: g, m/s^2. `vertical`: whether gravity points along the
        shaft. `fill_ratio`: x, shape (n,).
    Returns: True where it does, shape (n,); an empty chamber counts as closed.
    Source: the free surface |r + g/omega^2| = const, to first order.
    """
    a, delta = surface_radius(disc=disc, fill_ratio=fill_ratio), gravity / angular_velocity**2
    if vertical:
        closed = disc.outer_radius**2 - a**2 > delta * disc.axial_width
    else:
        closed = disc.outer_radius - a > delta
    return np.asarray(closed | (fill_ratio == 0) | (gravity == 0))


def spilling_ring(scene: Scene, fill_ratio: FloatArray) -> BoolArray:
    """Whether gravity tilts the free surface past the inner radius, shape (n,).

    Horizontal shaft: a - delta [(cos(alpha) - s)^2 + sin^2(alpha)]^(1/2) < R1, s = sin(alpha)/alpha;
    vertical: a^2 - delta B/2 < R1^2; delta = g/omega^2.
    Args: `fill_ratio`: x, shape (n,).
    Source: the free surface |r + g/omega^2| = const, to first order.
    """
    disc, delta = scene.disc, scene.environment.gravity / scene.rotor.speed**2
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    alpha = half_angle(disc=disc, radius=a)
    if scene.environment.shaft == "vertical":
        innermost = np.sqrt(np.maximum(a**2 - delta * disc.axial_width / 2, 0.0))
    else:
        innermost = a - delta * np.hypot(np.cos(alpha) - np.sin(alpha) / alpha, np.sin(alpha))
    return np.asarray(innermost < disc.inner_radius * (1 - 1e-9))
