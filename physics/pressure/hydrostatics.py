"""Liquid at rest in the rotating frame, without gravity."""

from __future__ import annotations

import math
from typing import TypeVar

from ringbalance.scene.arrays import FloatArray

Radius = TypeVar("Radius", float, FloatArray)


def hydrostatic_pressure(*, density: float, angular_velocity: float, inner: Radius, outer: float) -> Radius:
    """Rise of pressure from radius a to b, rho omega^2 (b^2 - a^2)/2, Pa; negative where a is larger."""
    # The factors keep full relative accuracy for a film of a micrometre, where b^2 - a^2 cancels.
    return density * angular_velocity**2 * ((outer - inner) * (outer + inner)) / 2


def column_radius(*, density: float, angular_velocity: float, pressure: float, outer: float) -> float:
    """Inner radius of the column that a pressure at its outer radius supports, m; zero beyond the axis."""
    return math.sqrt(max(outer**2 - pressure / (density * angular_velocity**2 / 2), 0.0))
