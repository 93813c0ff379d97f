"""Answers without a run of a scene with eccentric masses: reach, stall, run-up, holding and resolution.

W_0 is the speed at which balancing starts.  The run-up is taken as a sequence of steady states, with the load
of its rate; a fast one passes a critical speed with less vibration.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import DriveLaw
from ringbalance.controller.eccentric_mass.plant import PlantParameters, speed_at
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.results.rows import Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.keys.derivations import permissible_unbalance

_SPEEDS: Final = 400
"""Number of speeds between two corners of the profile; those of the largest vibration are added."""


def whirl_per_imbalance(scene: EccentricScene, speed: float) -> float:
    """|alpha| at a speed, m/(kg m); infinite at the critical speed of a rotor without damping."""
    try:
        return abs(PlantParameters.of(scene).influence(speed))
    except ValueError:
        return math.inf


def largest_whirl_per_imbalance(scene: EccentricScene, *, after: float = 0.0) -> float:
    """Largest |alpha| over the speeds of the profile from a time on, m/(kg m)."""
    return max(whirl_per_imbalance(scene, speed) for speeds, _ in _ramps(scene, after) for speed in speeds)


def starting_speed(scene: EccentricScene) -> float:
    """W_0, rad/s."""
    return speed_at(*scene.rotor.profile, scene.supervisor.start)[0]


def required_residual(scene: EccentricScene) -> float | None:
    """Vibration that may remain at the end of the run, m: the smaller of `residual` and that of the grade.

    |alpha(W)| G m_r/W at the last speed W; a rotor that rests in the end has no such grade.
    """
    requirement, speed = scene.requirement, abs(speed_at(*scene.rotor.profile, scene.run.time_limit)[0])
    limits = [] if requirement.residual is None else [requirement.residual]
    if requirement.grade is not None and speed:
        left = permissible_unbalance(grade=requirement.grade, mass=scene.rotor.mass, speed=speed)
        limits.append(whirl_per_imbalance(scene, speed) * left)
    return min(limits, default=None)


def stall_ratio(scene: EccentricScene) -> float | None:
    """Torque of a stalled drive at the largest voltage over what it has to overcome at W_0; None: no limit.

    B_add V_max / (b W_0^2 (mu_f + |z|)), with the larger friction arm and the vibration before balancing.
    """
    plant, speed = PlantParameters.of(scene), starting_speed(scene)
    if math.isinf(plant.maximum_voltage) or speed == 0:
        return None
    arm = max(plant.friction_arm) + abs(plant.steady_whirl(speed, scene.masses.initial_angle))
    return plant.drive_gain * plant.maximum_voltage / (plant.moment * speed**2 * arm)


def holding_margin(scene: EccentricScene) -> float | None:
    """Friction over the load on masses at their goals, the smallest from W_0 on; None: a resting rotor.

    mu_f b W^2 / (b W^2 |z| + J |W'|), with the smaller arm and |z| = z_limit |alpha(W)/alpha(W_0)|, what is
    left within the limit at W_0.
    """
    plant, start = PlantParameters.of(scene), starting_speed(scene)
    if start == 0:
        return None
    left = scene.supervisor.limit / whirl_per_imbalance(scene, start)
    margins = []
    for speeds, rate in _ramps(scene, scene.supervisor.start):
        for speed in speeds:
            pull = plant.moment * speed**2
            load = pull * left * whirl_per_imbalance(scene, speed) + plant.inertia * abs(rate)
            margins.append(min(plant.friction_arm) * pull / load if load > 0 else 0.0)
    return float(min(margins))


def static_quantities(scene: EccentricScene) -> Iterator[Quantity]:
    """Answers that need no run."""
    plant, reach = PlantParameters.of(scene), reach_of(scene)
    vector = cmath.rect(plant.unbalance, plant.phase) + plant.mass_vector(scene.masses.initial_angle)
    locked = largest_whirl_per_imbalance(scene) * abs(vector)
    near = 2 * plant.moment * DriveLaw.of(scene).near
    finest = whirl_per_imbalance(scene, starting_speed(scene)) * near
    ratio = reach / plant.unbalance if plant.unbalance else None
    for key, name, unit, value in (
        ("reach", "usable moment in any direction", "kg m", reach),
        ("reach_ratio", "usable moment over imbalance", "1", ratio),
        ("stall_ratio", "stall torque over need", "1", stall_ratio(scene)),
        ("holding_margin", "friction over load once balanced, at least", "1", holding_margin(scene)),
        ("locked_amplitude", "vibration with locked masses over the speed profile, at most", "m", locked),
        ("resolution", "vibration that masses at rest near their goals leave, at most", "m", finest),
    ):
        if value is not None and math.isfinite(value):
            yield Quantity(key=key, name=name, unit=unit, value=value)


def _ramps(scene: EccentricScene, after: float) -> Iterator[tuple[FloatArray, float]]:
    """Speeds, rad/s, and rate, rad/s^2, of each part of the profile from a time on.

    |alpha|^2 = W^4/((K - M W^2)^2 + C^2 W^2) is largest at W^2 = 2 K^2/(2 K M - C^2).
    """
    plant, (times, speeds) = PlantParameters.of(scene), scene.rotor.profile
    excess = 2 * plant.stiffness * plant.mass - plant.damping**2
    peak = math.sqrt(2 * plant.stiffness**2 / excess) if excess > 0 else math.inf
    first = max(after, float(times[0]))
    corners = [first, *(time for time in times.tolist() if time > first)]
    yield np.array([speed_at(times, speeds, first)[0]]), 0.0
    for begin, end in pairwise(corners):
        low, rate = speed_at(times, speeds, begin)
        high = low + rate * (end - begin)
        inner = [each for each in (peak, -peak) if min(low, high) <= each <= max(low, high)]
        yield np.array([*np.linspace(low, high, _SPEEDS), *inner]), rate
