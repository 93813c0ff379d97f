"""The plant with eccentric masses under given voltages, without the strategy."""

from __future__ import annotations

import cmath

import numpy as np

from ringbalance.controller.eccentric_mass import plant as machine
from ringbalance.controller.eccentric_mass.plant import (
    FLAG,
    SIZE,
    STUCK,
    VOLTAGE,
    PlantParameters,
    plant_row,
    speed_at,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray


def rest_state(angles: tuple[float, float]) -> FloatArray:
    """State of a rotor at its centre with masses at rest on the track, shape (8,)."""
    return plant_row(angles)[:SIZE]


def stuck_flags(flag: float) -> FloatArray:
    """One flag for both masses, shape (2,)."""
    return np.full(2, flag)


def row_of(state: FloatArray, stuck: FloatArray, command: FloatArray) -> FloatArray:
    """Row of the plant before a step with these voltages."""
    row = plant_row((0.0, 0.0))
    row[:SIZE], row[FLAG : FLAG + 2], row[VOLTAGE : VOLTAGE + 2] = state, stuck, command
    return row


def driven_of(plant: PlantParameters, row: FloatArray, rate: float = 0.0) -> machine._Driven:
    """Plant under the voltages of a row, at this speed rate."""
    first, second = (plant.drive_gain * row[VOLTAGE : VOLTAGE + 2]).tolist()
    return machine._Driven(plant, rate, cmath.rect(plant.unbalance, plant.phase), (first, second))


def plant_step(
    plant: PlantParameters,
    state: FloatArray,
    stuck: FloatArray,
    command: FloatArray,
    speed: float,
    rate: float,
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """State and flags after one step."""
    row = row_of(state, stuck, command)
    machine.plant_step(plant, row, speed, rate, step)
    return row[:SIZE].copy(), row[FLAG : FLAG + 2].copy()


def run_steps(
    parameters: PlantParameters,
    times: FloatArray,
    speeds: FloatArray,
    state: FloatArray,
    stuck: FloatArray,
    commands: FloatArray,
    step: float,
) -> tuple[FloatArray, FloatArray]:
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
