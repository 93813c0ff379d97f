"""Run of a scene with two eccentric masses: plant, sensors and strategy, sample by sample."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringbalance.controller.balancer import Progress
from ringbalance.controller.eccentric_mass.integration import check_substeps, intervals, plant_step
from ringbalance.controller.eccentric_mass.memory import (
    HISTORY,
    LOCKED_MASSES,
    MEMORY,
    RELEASED,
    EccentricMeasurement,
)
from ringbalance.controller.eccentric_mass.plant import (
    LOCKED,
    STUCK,
    PlantParameters,
    electrical_energy,
    rest_state,
    speed_at,
    stuck_flags,
    turned,
)
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_rows import eccentric_document, eccentric_rows
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import begin_strategy, strategy_step
from ringbalance.results.result import Presentation
from ringbalance.scene.arrays import FloatArray, IntArray, Record
from ringbalance.scene.platform.compiled import compiled

Seed = int | np.random.Generator | None
"""Seed of random numbers, or their generator."""
SENSOR_NOISES = 8
"""Random numbers per sample: four of vibration, two of angles, two of rates."""
_MAX_WHIRL = 1e3
"""Largest ratio of displacement to track radius: the plant is linear in the displacement; real bearings are
not, far below this."""
_MAX_TURN_RAD = 1e3
"""Largest travel of a mass within one sample, more than a hundred turns: no sampled loop controls that."""
_MAX_NUMBER = 1e100
"""Largest number in a history, in any unit: its squares and products stay finite."""


class _Machine(NamedTuple):
    """Rotor, plant and sensors of a run."""

    plant: PlantParameters
    times: FloatArray
    """Times of the corners of the speed profile, s."""
    speeds: FloatArray
    """Speeds at the corners, rad/s."""
    position_noise: float
    velocity_noise: float
    encoder_noise: float
    encoder_rate_noise: float
    locked: bool
    """True if the masses are clamped to the track, without drive and filter."""

    @classmethod
    def of(cls, scene: EccentricScene) -> _Machine:
        sensor, (times, speeds) = scene.sensor, scene.rotor.profile
        return cls(
            plant=PlantParameters.of(scene),
            times=times,
            speeds=speeds,
            position_noise=sensor.position_noise,
            velocity_noise=sensor.velocity_noise,
            encoder_noise=sensor.encoder_noise,
            encoder_rate_noise=sensor.encoder_rate_noise,
            locked=scene.supervisor.strategy == "locked",
        )


@compiled
def _measure(
    machine: _Machine, settings: StrategySettings, state: FloatArray, time: float, numbers: FloatArray
) -> EccentricMeasurement:
    """Sample of the sensors, with noise. Args: `numbers`: standard normal deviates, shape (8,)."""
    speed, speed_rate = speed_at(machine.times, machine.speeds, time)
    turn = turned(machine.times, machine.speeds, time)
    position, velocity = complex(state[0], state[1]), complex(state[2], state[3])
    if settings.laboratory:
        outward = complex(math.cos(turn), math.sin(turn))
        velocity = outward * (velocity + complex(0.0, speed) * position)
        position = outward * position
    position += complex(machine.position_noise * numbers[0], machine.position_noise * numbers[1])
    velocity += complex(machine.velocity_noise * numbers[2], machine.velocity_noise * numbers[3])
    noise, rate_noise = machine.encoder_noise, machine.encoder_rate_noise
    angle = (state[4] + noise * numbers[4], state[5] + noise * numbers[5])
    rate = (state[6] + rate_noise * numbers[6], state[7] + rate_noise * numbers[7])
    return EccentricMeasurement(time, speed, speed_rate, turn, position, velocity, angle, rate)


@compiled
def _run_interval(
    settings: StrategySettings,
    machine: _Machine,
    numbers: FloatArray,
    memory: Record,
    state: FloatArray,
    stuck: IntArray,
    history: Record,
    first: int,
    after: int,
) -> tuple[FloatArray, IntArray]:
    """Run samples `first` to `after - 1`, each followed by a step of the plant, into the history.

    Returns: State and flags of the plant at sample `after`.
    """
    plant, step, voltage = machine.plant, settings.step, np.zeros(2)
    energy = 0.0 if first == 0 else history[first - 1].energy
    for i in range(first, after):
        measurement = _measure(machine, settings, state, i * step, numbers[i])
        if machine.locked:
            memory.cause, memory.hold = LOCKED_MASSES, RELEASED
            memory.goal[0], memory.goal[1] = state[4], state[5]
        else:
            strategy_step(settings, memory, measurement)
            voltage[0], voltage[1] = memory.voltage[0], memory.voltage[1]
        row = history[i]
        row.stage, row.cause, row.hold = memory.stage, memory.cause, memory.hold
        # Element by element: numba takes ten times as long to compile an array assignment.
        for k in range(8):
            row.state[k] = state[k]
        for k in range(2):
            row.voltage[k], row.goal[k] = memory.voltage[k], memory.goal[k]
            row.friction_arm[k] = memory.friction[k].arm
            row.friction_variance[k] = memory.friction[k].arm_variance
            row.imbalance[k] = memory.filter.state[4 + k]
            for m in range(2):
                row.imbalance_covariance[k, m] = memory.filter.covariance[4 + k, 4 + m]
        speed, rate = measurement.speed, measurement.speed_rate
        later, stuck = plant_step(plant, state, stuck, voltage, speed, rate, step)
        energy += electrical_energy(plant, state, later, voltage, step)
        row.energy = energy
        state = later
    return state, stuck


def simulate_eccentric(
    scene: EccentricScene,
    *,
    seed: Seed = None,
    progress: Progress | None = None,
    settings: StrategySettings | None = None,
) -> EccentricRun:
    """Run a scene from a rotor at its centre and masses at rest, to its time limit.

    Args: `seed`: seed of numpy's default generator for the sensors' noise; default the scene's. `progress`:
    called several times a second. `settings`: constants of the strategy; default those of the scene.
    Returns: EccentricRun; its status says how the run ended and what to do next. A run that diverges ends at
    its last valid sample.
    Raises: SceneError: a run that takes too many samples or steps.
    Source: Fig. 3 of the paper on eccentric masses.
    """
    check_substeps(scene)
    settings, machine = settings or StrategySettings.of(scene), _Machine.of(scene)
    history, memory = np.zeros(scene.samples, dtype=HISTORY), np.zeros(1, dtype=MEMORY)
    random = np.random.default_rng(scene.run.seed if seed is None else seed)
    numbers = random.standard_normal((scene.samples, SENSOR_NOISES))
    state = rest_state(scene.masses.initial_angle)
    stuck = stuck_flags(LOCKED if machine.locked else STUCK)
    if not machine.locked:
        begin_strategy(settings, memory[0], _measure(machine, settings, state, 0.0, numbers[0]))
    for begin, end in intervals(scene):
        state, stuck = _run_interval(settings, machine, numbers, memory[0], state, stuck, history, begin, end)
        if progress is not None:
            progress(end * settings.step, scene.run.time_limit)
        part = history[begin:end]
        whirl = np.max(np.abs(part["state"][:, :2]), axis=1)
        turn = np.max(np.abs(part["state"][:, 6:8]), axis=1) * scene.sensor.step
        # A comparison with NaN is false.
        bounded = (whirl <= _MAX_WHIRL * scene.masses.guide_radius) & (turn <= _MAX_TURN_RAD)
        for name in HISTORY.names or ():
            bounded &= np.all(np.abs(part[name].reshape(len(part), -1)) <= _MAX_NUMBER, axis=1)
        if not bounded.all():
            # At the start everything rests.
            history = history[: max(begin + int(np.argmin(bounded)), 1)]
            break
    # The energy of the last sample's voltage would be spent after the run.
    history["energy"] = np.concatenate([[0.0], history["energy"][:-1]])
    presentation = Presentation(document=eccentric_document, rows=eccentric_rows)
    return EccentricRun(scene=scene, history=history, memory=memory[0], presentation=presentation)


def locked_run(scene: EccentricScene) -> EccentricRun:
    """Run the rotor without balancing: masses clamped at their initial angles."""
    return simulate_eccentric(replace(scene, supervisor=replace(scene.supervisor, strategy="locked")))
