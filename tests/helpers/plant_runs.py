"""The plant with eccentric masses under given voltages, without the strategy."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.integration import plant_step
from ringbalance.controller.eccentric_mass.plant import (
    STUCK,
    PlantParameters,
    rest_state,
    speed_at,
    stuck_flags,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray, IntArray


def run_steps(
    parameters: PlantParameters,
    times: FloatArray,
    speeds: FloatArray,
    state: FloatArray,
    stuck: IntArray,
    commands: FloatArray,
    step: float,
) -> tuple[FloatArray, IntArray]:
    """States, shape (steps + 1, 8), and flags, shape (steps + 1, 2), over steps of equal length."""
    states, flags = [state], [stuck]
    for place, command in enumerate(commands):
        speed, rate = speed_at(times, speeds, place * step)
        state, stuck = plant_step(parameters, state, stuck, command, speed, rate, step)
        states.append(state)
        flags.append(stuck)
    return np.array(states), np.array(flags)


def run_free(scene: EccentricScene) -> FloatArray:
    """States of a scene's plant from rest with its drives switched off, shape (samples, 8)."""
    states, _ = run_steps(
        PlantParameters.of(scene),
        *scene.rotor.profile,
        rest_state(scene.masses.initial_angle),
        stuck_flags(STUCK),
        np.zeros((scene.samples - 1, 2)),
        scene.sensor.step,
    )
    return states
