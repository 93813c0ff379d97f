"""Plant, sensors and strategy together, sample by sample, all compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.plant.integrate import plant_step
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.plant.plant import electrical_energy
from ringbalance.controller.eccentric_mass.plant.speed import speed_at, turned
from ringbalance.controller.eccentric_mass.strategy.records import (
    EccentricMeasurement,
    StrategySettings,
    StrategyState,
)
from ringbalance.controller.eccentric_mass.strategy.step import strategy_step
from ringbalance.scene.arrays import FloatArray, IntArray

NOISES = 8
"""Random numbers that one sample takes: four of vibration, two angles, two rates."""


class SensorNoise(NamedTuple):
    """Standard deviations of the sensors."""

    position: float
    velocity: float
    angle: float
    rate: float


class Profile(NamedTuple):
    """The rotor's speed over time."""

    times: FloatArray
    """Of the corners, s."""
    speeds: FloatArray
    """At the corners, rad/s."""


class Record(NamedTuple):
    """What one run leaves, a row for each sample."""

    state: FloatArray
    """Of the plant, shape (n, 8)."""
    voltage: FloatArray
    """V, from this sample on, shape (n, 2)."""
    energy: FloatArray
    """Electrical, taken since the start, J, shape (n,)."""
    stage: IntArray
    """Shape (n,)."""
    cause: IntArray
    """Shape (n,)."""
    hold: IntArray
    """Shape (n,)."""
    goal: FloatArray
    """rad, shape (n, 2)."""
    imbalance: FloatArray
    """Estimate along the rotor's axes, kg m, shape (n, 2)."""
    imbalance_covariance: FloatArray
    """kg^2 m^2, shape (n, 2, 2)."""
    friction_arm: FloatArray
    """Estimates, m, shape (n, 2)."""
    friction_variance: FloatArray
    """m^2, shape (n, 2)."""


def empty_record(samples: int) -> Record:
    """Room for a run. Returns: Record of zeros."""
    whole = [np.zeros(samples, dtype=np.int64) for _ in range(3)]
    return Record(
        np.zeros((samples, 8)),
        np.zeros((samples, 2)),
        np.zeros(samples),
        whole[0],
        whole[1],
        whole[2],
        np.zeros((samples, 2)),
        np.zeros((samples, 2)),
        np.zeros((samples, 2, 2)),
        np.zeros((samples, 2)),
        np.zeros((samples, 2)),
    )


@compiled
def measure(
    state: FloatArray,
    profile: Profile,
    time: float,
    laboratory: bool,
    noise: SensorNoise,
    numbers: FloatArray,
) -> EccentricMeasurement:
    """What the sensors show; `laboratory`: the vibration is measured in the fixed frame."""
    speed, speed_rate = speed_at(profile.times, profile.speeds, time)
    turn = turned(profile.times, profile.speeds, time)
    place, velocity = complex(state[0], state[1]), complex(state[2], state[3])
    if laboratory:
        outward = complex(math.cos(turn), math.sin(turn))
        velocity = outward * (velocity + complex(0.0, speed) * place)
        place = outward * place
    vibration = np.array(
        [
            place.real + noise.position * numbers[0],
            place.imag + noise.position * numbers[1],
            velocity.real + noise.velocity * numbers[2],
            velocity.imag + noise.velocity * numbers[3],
        ]
    )
    angle = (state[4] + noise.angle * numbers[4], state[5] + noise.angle * numbers[5])
    rate = (state[6] + noise.rate * numbers[6], state[7] + noise.rate * numbers[7])
    return EccentricMeasurement(time, speed, speed_rate, turn, vibration, angle, rate)


@compiled
def run_stretch(
    settings: StrategySettings,
    parameters: PlantParameters,
    profile: Profile,
    noise: SensorNoise,
    numbers: FloatArray,
    memory: StrategyState,
    state: FloatArray,
    stuck: IntArray,
    record: Record,
    first: int,
    after: int,
) -> tuple[StrategyState, FloatArray, IntArray]:
    """Run samples `first` to `after - 1`, each followed by a step of the plant, into the record.

    Returns: Memory of the strategy, state and flags of the plant at sample `after`.
    """
    energy = 0.0 if first == 0 else record.energy[first - 1]
    command = np.zeros(2)
    for i in range(first, after):
        time = i * settings.step
        seen = measure(state, profile, time, settings.laboratory, noise, numbers[i])
        memory, voltage = strategy_step(settings, memory, seen)
        command[0], command[1] = voltage
        _keep(record, i, memory, state, command)
        later, stuck = plant_step(
            parameters, state, stuck, command, seen.speed, seen.speed_rate, settings.step
        )
        energy += electrical_energy(parameters, state, later, command, settings.step)
        record.energy[i] = energy
        state = later
    return memory, state, stuck


@compiled
def _keep(record: Record, i: int, memory: StrategyState, state: FloatArray, command: FloatArray) -> None:
    """Write one row of the record."""
    plan, estimate = memory.plan, memory.whirl.estimate
    # An element at a time: numba compiles array assignment ten times as long.
    for place in range(state.size):
        record.state[i, place] = state[place]
    record.stage[i], record.cause[i], record.hold[i] = plan.stage, plan.cause, plan.hold
    for k in range(2):
        friction = memory.beliefs.friction[k]
        record.voltage[i, k] = command[k]
        record.goal[i, k] = plan.goal[k]
        record.imbalance[i, k] = estimate.state[4 + k]
        record.friction_arm[i, k] = friction.arm
        record.friction_variance[i, k] = friction.arm_variance
        for m in range(2):
            record.imbalance_covariance[i, k, m] = estimate.covariance[4 + k, 4 + m]
