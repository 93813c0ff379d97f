"""The steady whirl with masses at rest on the track, in closed form, and what friction holds against it."""

from __future__ import annotations

import cmath
from collections.abc import Sequence

from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters


def moment_vector(parameters: PlantParameters, angles: Sequence[float]) -> complex:
    """Unbalance of rotor and eccentric masses, U exp(j phi_m) + b sum exp(j phi_i), kg m, rotor-fixed."""
    masses = sum(cmath.exp(1j * angle) for angle in angles)
    return parameters.unbalance * cmath.exp(1j * parameters.phase) + parameters.moment * masses


def influence(parameters: PlantParameters, speed: float) -> complex:
    """Steady vibration per unbalance.

    alpha = W^2 / (K_B - M W^2 + j C_B W).
    Returns: m/(kg m), complex: the lag is minus its phase.
    Raises: ValueError: no damping, at the critical speed.
    """
    stiffness = complex(parameters.stiffness - parameters.mass * speed**2, parameters.damping * speed)
    if stiffness == 0:
        raise ValueError("a rotor without damping has no steady whirl at its critical speed")
    return speed**2 / stiffness


def steady_whirl(parameters: PlantParameters, speed: float, angles: Sequence[float]) -> complex:
    """Displacement x + j y in the rotor's frame at constant speed, masses at rest on the track.

    Returns: m, complex; its magnitude is the zero-to-peak vibration.
    Raises: ValueError: no damping, at the critical speed.
    """
    return influence(parameters, speed) * moment_vector(parameters, angles)
