"""Way of one eccentric mass under a constant voltage of its motor, the other one clamped.

The first mass starts at rest from its place in the scene, on a rotor that whirls steadily at constant speed.
"""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.plant.friction import LOCKED, STUCK
from ringbalance.controller.eccentric_mass.plant.integrate import plant_step
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters, plant_parameters
from ringbalance.controller.eccentric_mass.plant.plant import rest_state
from ringbalance.controller.eccentric_mass.plant.whirl import steady_whirl
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.scalars import scalar_covariance
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene


def measured(observations: Observations) -> FloatArray:
    """Angles moved, rad, shape (n,)."""
    return observations.columns["angle"]


def predict(scene: EccentricScene, observations: Observations) -> FloatArray:
    """The same by the plant's equations of motion; rows of one series, voltage and speed are one motion."""
    plant, columns = plant_parameters(scene), observations.columns
    found = np.empty(len(observations))
    motions: dict[tuple[str, float, float], list[int]] = {}
    for row in range(len(observations)):
        key = str(observations.series[row]), float(columns["voltage"][row]), float(columns["speed"][row])
        motions.setdefault(key, []).append(row)
    for (_, voltage, speed), rows in motions.items():
        times = columns["time"][rows]
        order = np.argsort(times, kind="stable")
        found[np.array(rows)[order]] = _moved(
            plant, scene.masses.initial_angle, voltage=voltage, speed=speed, times=times[order]
        )
    return found


def _moved(
    plant: PlantParameters,
    angles: tuple[float, float],
    *,
    voltage: float,
    speed: float,
    times: FloatArray,
) -> FloatArray:
    """Angle moved by the first mass at rising times, rad."""
    state, flags = rest_state(angles), np.array([STUCK, LOCKED], dtype=np.int64)
    whirl = steady_whirl(plant, speed, angles) if speed else 0j
    state[0], state[1] = whirl.real, whirl.imag
    command, found, now = np.array([voltage, 0.0]), np.empty(times.size), 0.0
    for place, time in enumerate(times.tolist()):
        if time > now:
            state, flags = plant_step(plant, state, flags, command, speed, 0.0, time - now)
            now = time
        found[place] = state[4] - angles[0]
    return found


def covariance(observations: Observations) -> FloatArray:
    """Of what was measured; unit where the noise is not given."""
    return scalar_covariance(observations, "angle")


def noise_given(observations: Observations) -> bool:
    """Whether what was measured has its uncertainty."""
    return "angle" in observations.uncertainty


def free(observations: Observations) -> FloatArray:
    """Nothing beside the parameters is fitted."""
    return np.zeros((len(observations), 0))
