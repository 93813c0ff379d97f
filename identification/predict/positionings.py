"""Way of one eccentric mass under a constant voltage of its motor, the other one clamped.

The first mass starts at rest from its place in the scene, on a rotor that whirls steadily at constant speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.controller.compilation.signals import signals_deferred
from ringbalance.controller.eccentric_mass.plant.friction import LOCKED, STUCK
from ringbalance.controller.eccentric_mass.plant.integrate import plant_step, substeps
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters, plant_parameters
from ringbalance.controller.eccentric_mass.plant.plant import rest_state
from ringbalance.controller.eccentric_mass.plant.whirl import steady_whirl
from ringbalance.identification.data.observations import Observations
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.eccentric_models import EccentricScene

MOST_STEPS: Final = 300_000
"""Of all motions of a file, some 0.2 s a prediction: a fit takes a minute or two."""
_MOST_SUBSTEPS: Final = 20_000
"""Of one call of the plant, some 0.02 s: a signal, such as that of Ctrl-C, acts only between calls."""


def predict(scene: EccentricScene, observations: Observations) -> FloatArray:
    """Angles moved, rad, shape (n,), by the plant's equations of motion.

    Rows of one series, voltage and speed are one motion.
    """
    plant = plant_parameters(scene)
    found = np.empty(len(observations))
    for voltage, speed, rows in _motions(observations):
        times = observations.columns["time"][rows]
        found[rows] = _moved(plant, scene.masses.initial_angle, voltage=voltage, speed=speed, times=times)
    return found


def too_long(scene: EccentricScene, observations: Observations) -> str:
    """Why these motions would take too long to integrate, as a fit does some hundred times; else empty."""
    plant, times = plant_parameters(scene), observations.columns["time"]
    steps = sum(substeps(plant, speed, 0.0, times[rows[-1]]) for _, speed, rows in _motions(observations))
    if steps <= MOST_STEPS:
        return ""
    return (
        f"the motions take {steps} steps of integration, and a fit at most {MOST_STEPS}: check the units of "
        "time and speed, or leave out the latest times and some of the voltages"
    )


def _motions(observations: Observations) -> Iterator[tuple[float, float, IntArray]]:
    """Voltage and speed of every motion, and its rows in the order of their times."""
    columns = observations.columns
    motions: dict[tuple[str, float, float], list[int]] = {}
    for row in range(len(observations)):
        key = str(observations.series[row]), float(columns["voltage"][row]), float(columns["speed"][row])
        motions.setdefault(key, []).append(row)
    for (_, voltage, speed), rows in motions.items():
        order = np.argsort(columns["time"][rows], kind="stable")
        yield voltage, speed, np.array(rows)[order]


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
        parts = math.ceil(substeps(plant, speed, 0.0, time - now) / _MOST_SUBSTEPS) if time > now else 0
        for _ in range(parts):
            # Numba hands arrays over through a Python function, in which an interrupt would be an error.
            with signals_deferred():
                state, flags = plant_step(plant, state, flags, command, speed, 0.0, (time - now) / parts)
        now = time
        found[place] = state[4] - angles[0]
    return found
