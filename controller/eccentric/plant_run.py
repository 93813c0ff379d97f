"""The plant alone over many steps: prescribed speed, prescribed voltages, no controller."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ringbalance.controller.compiled import compiled
from ringbalance.controller.eccentric.arrays import FloatArray, IntArray
from ringbalance.controller.eccentric.friction import LOCKED, STUCK
from ringbalance.controller.eccentric.integrate import plant_step
from ringbalance.controller.eccentric.parameters import PlantParameters, plant_parameters
from ringbalance.controller.eccentric.plant import rest_state, stuck_flags
from ringbalance.controller.eccentric.plant_speed import profile_arrays, speed_at
from ringbalance.scene.eccentric_models import EccentricScene


class PlantRun(NamedTuple):
    """History of the plant."""

    time: FloatArray
    """s, shape (steps + 1,)."""
    speed: FloatArray
    """W, rad/s, shape (steps + 1,)."""
    state: FloatArray
    """Shape (steps + 1, 8)."""
    stuck: IntArray
    """Shape (steps + 1, 2)."""

    @property
    def amplitude(self) -> FloatArray:
        """Zero-to-peak vibration sqrt(x^2 + y^2), m, shape (steps + 1,)."""
        amplitude: FloatArray = np.hypot(self.state[:, 0], self.state[:, 1])
        return amplitude


@compiled
def run_steps(
    parameters: PlantParameters,
    times: FloatArray,
    speeds: FloatArray,
    state: FloatArray,
    stuck: IntArray,
    commands: FloatArray,
    step: float,
) -> tuple[FloatArray, IntArray]:
    """Carry the plant through steps of equal length.

    Args:
        parameters: of the plant.
        times: of the speed profile's corners, s, shape (corners,).
        speeds: at the corners, rad/s, shape (corners,).
        state: at time zero, shape (8,).
        stuck: SLIDING, STUCK or LOCKED, shape (2,).
        commands: voltages held in each step, V, shape (steps, 2).
        step: s; corners of the profile are best multiples of it.

    Returns:
        States, shape (steps + 1, 8), and flags, shape (steps + 1, 2).
    """
    count = commands.shape[0]
    states, flags = np.empty((count + 1, state.size)), np.empty((count + 1, 2), np.int64)
    for place in range(count + 1):
        for entry in range(state.size):
            states[place, entry] = state[entry]
        flags[place, 0], flags[place, 1] = stuck[0], stuck[1]
        if place < count:
            speed, rate = speed_at(times, speeds, place * step)
            state, stuck = plant_step(parameters, state, stuck, commands[place], speed, rate, step)
    return states, flags


def run_plant(scene: EccentricScene, *, commands: FloatArray | None = None, locked: bool = False) -> PlantRun:
    """Run a scene's plant from rest, with the voltages given.

    Args:
        scene: speed profile, time limit and step are taken from it.
        commands: V, shape (steps, 2); None for drives switched off.
        locked: whether both masses are clamped to the track.

    Returns:
        PlantRun.
    """
    step = scene.sensor.step
    count = round(scene.run.time_limit / step)
    voltages = np.zeros((count, 2)) if commands is None else np.ascontiguousarray(commands, dtype=np.float64)
    times, speeds = profile_arrays(scene.rotor)
    states, flags = run_steps(
        plant_parameters(scene),
        times,
        speeds,
        rest_state(scene.masses.initial_angle),
        stuck_flags(LOCKED if locked else STUCK),
        voltages,
        step,
    )
    elapsed: FloatArray = np.arange(len(states), dtype=np.float64) * step
    return PlantRun(elapsed, np.interp(elapsed, times, speeds), states, flags)
