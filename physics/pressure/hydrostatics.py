"""Liquid at rest in the rotating frame, and the most that gravity could do to it."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

Radius = TypeVar("Radius", float, FloatArray)


def hydrostatic_pressure(*, density: float, angular_velocity: float, inner: Radius, outer: float) -> Radius:
    """Rise of pressure from radius a to b, rho omega^2 (b^2 - a^2)/2, Pa; negative where a is larger."""
    # The factors keep full relative accuracy for a film of a micrometre, where b^2 - a^2 cancels.
    return density * angular_velocity**2 * ((outer - inner) * (outer + inner)) / 2


def column_radius(*, density: float, angular_velocity: float, pressure: float, outer: float) -> float:
    """Inner radius of the column that a pressure at its outer radius supports, m; zero beyond the axis."""
    return math.sqrt(max(outer**2 - pressure / (density * angular_velocity**2 / 2), 0.0))


def displaced_by_gravity(*, disc: Disc, density: float, gravity: float, fill_ratio: FloatArray) -> FloatArray:
    """Bound of what gravity could do to a chamber's liquid: take it from the middle to a corner, or back.

    Returns: Changes of wall pressure (Pa), moment (kg m) and dU/dV' (kg/m^2), shape (3, n).
    """
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    # An imported chamber may have corners beyond the half-angle that is as large as its surface.
    corner = half_angle(disc=disc, radius=a) if disc.geometry is None else disc.central_angle / 2
    reach = disc.outer_radius - a * np.cos(corner)
    pressure = np.full_like(a, 2 * density * gravity * disc.outer_radius)
    return np.array([pressure, density * fill_ratio * chamber_volume(disc=disc) * reach, density * reach])
