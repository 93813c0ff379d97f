"""One run of a scene with two eccentric masses: plant, sensors and strategy, sample by sample."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringbalance.controller.balancer import Progress
from ringbalance.controller.eccentric_mass.integration import check_substeps, plant_step, stretches
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
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, Record, Records
from ringbalance.scene.platform.compiled import compiled, in_place

Seed = int | np.random.Generator | None
"""Of random numbers, or these themselves."""
NOISES = 8
"""Random numbers that one sample takes: four of vibration, two angles, two rates."""
_LARGEST_WHIRL = 1e3
"""Of the masses' own track.  The plant is linear in the displacement, which no bearing is far below this."""
_LARGEST_TURN = 1e3
"""Of a mass within one sample, rad: more than a hundred turns, which no sampled loop controls."""
_LARGEST = 1e100
"""Of any number, whatever its unit, so that squares and products of what is kept are finite."""


class _Machine(NamedTuple):
    """What is run beside the strategy."""

    plant: PlantParameters
    times: FloatArray
    """Of the corners of the speed profile, s."""
    speeds: FloatArray
    """At the corners, rad/s."""
    position_noise: float
    """Standard deviation, as the others."""
    velocity_noise: float
    encoder_noise: float
    encoder_rate_noise: float
    locked: bool
    """Whether the masses are clamped to the track, without drive and filter."""

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


def _recorded(
    scene: EccentricScene, seed: Seed, progress: Progress, settings: StrategySettings
) -> tuple[Records, Records]:
    """Every sample before the first that means nothing, type `HISTORY`, and the strategy's memory at the end,
    type `MEMORY`, shape (1,)."""
    machine, count = _Machine.of(scene), scene.samples
    history, memory = np.zeros(count, dtype=HISTORY), np.zeros(1, dtype=MEMORY)
    random = np.random.default_rng(scene.run.seed if seed is None else seed)
    numbers = random.standard_normal((count, NOISES))
    state = rest_state(scene.masses.initial_angle)
    stuck = stuck_flags(LOCKED if machine.locked else STUCK)
    if not machine.locked:
        begin_strategy(settings, memory[0], _measure(machine, settings, state, 0.0, numbers[0]))
    for begin, end in stretches(scene):
        state, stuck = _run_stretch(settings, machine, numbers, memory[0], state, stuck, history, begin, end)
        progress(end * settings.step, scene.run.time_limit)
        bad = np.flatnonzero(_diverged(history[begin:end], scene))
        if bad.size:
            # At the start everything rests.
            history = history[: max(begin + int(bad[0]), 1)]
            break
    # The energy of the last sample's voltage would be spent after the run.
    history["energy"] = np.concatenate([[0.0], history["energy"][:-1]])
    return history, memory


def _diverged(history: Records, scene: EccentricScene) -> BoolArray:
    state = history["state"]
    whirl = np.max(np.abs(state[:, :2]), axis=1)
    turn = np.max(np.abs(state[:, 6:8]), axis=1) * scene.sensor.step
    # A comparison with NaN is false.
    usual = (whirl <= _LARGEST_WHIRL * scene.masses.guide_radius) & (turn <= _LARGEST_TURN)
    for name in HISTORY.names or ():
        usual &= np.all(np.abs(history[name].reshape(len(history), -1)) <= _LARGEST, axis=1)
    return np.asarray(~usual)


@compiled
def _measure(
    machine: _Machine, settings: StrategySettings, state: FloatArray, time: float, numbers: FloatArray
) -> EccentricMeasurement:
    """What the sensors show. Args: `numbers`: standard normal, shape (8,)."""
    speed, speed_rate = speed_at(machine.times, machine.speeds, time)
    turn = turned(machine.times, machine.speeds, time)
    place, velocity = complex(state[0], state[1]), complex(state[2], state[3])
    if settings.laboratory:
        outward = complex(math.cos(turn), math.sin(turn))
        velocity = outward * (velocity + complex(0.0, speed) * place)
        place = outward * place
    place += complex(machine.position_noise * numbers[0], machine.position_noise * numbers[1])
    velocity += complex(machine.velocity_noise * numbers[2], machine.velocity_noise * numbers[3])
    noise, rate_noise = machine.encoder_noise, machine.encoder_rate_noise
    angle = (state[4] + noise * numbers[4], state[5] + noise * numbers[5])
    rate = (state[6] + rate_noise * numbers[6], state[7] + rate_noise * numbers[7])
    return EccentricMeasurement(time, speed, speed_rate, turn, place, velocity, angle, rate)


@compiled
def _run_stretch(
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
        seen = _measure(machine, settings, state, i * step, numbers[i])
        if machine.locked:
            memory.cause, memory.hold = LOCKED_MASSES, RELEASED
            memory.goal[0], memory.goal[1] = state[4], state[5]
        else:
            strategy_step(settings, memory, seen)
            voltage[0], voltage[1] = memory.voltage[0], memory.voltage[1]
        _keep(history[i], memory, state)
        later, stuck = plant_step(plant, state, stuck, voltage, seen.speed, seen.speed_rate, step)
        energy += electrical_energy(plant, state, later, voltage, step)
        history[i].energy = energy
        state = later
    return state, stuck


@in_place
def _keep(row: Record, memory: Record, state: FloatArray) -> None:
    """Write a sample into the history."""
    # An element at a time: numba compiles array assignment ten times as long.
    for place in range(8):
        row.state[place] = state[place]
    row.stage, row.cause, row.hold = memory.stage, memory.cause, memory.hold
    for k in range(2):
        row.voltage[k], row.goal[k] = memory.voltage[k], memory.goal[k]
        row.friction_arm[k] = memory.friction[k].arm
        row.friction_variance[k] = memory.friction[k].arm_variance
        row.imbalance[k] = memory.filter.state[4 + k]
        for m in range(2):
            row.imbalance_covariance[k, m] = memory.filter.covariance[4 + k, 4 + m]


def simulate_eccentric(
    scene: EccentricScene,
    *,
    seed: Seed = None,
    progress: Progress | None = None,
    settings: StrategySettings | None = None,
) -> EccentricRun:
    """Run a scene from a rotor at its centre and masses at rest, to its time limit.

    Args: `seed`: of numpy's default generator for the sensors' noise; default the scene's. `progress`: called
    several times a second; None for silence. `settings`: of the strategy; default those of the scene.
    Returns: EccentricRun; its status says how the run ended and what to do next. A run that diverges ends at
    the last sample that means anything.
    Raises: SceneError: a run that takes too many samples or steps.
    Source: Fig. 3 of the paper on eccentric masses.
    """
    check_substeps(scene)
    history, memory = _recorded(
        scene, seed, progress or (lambda _, __: None), settings or StrategySettings.of(scene)
    )
    presentation = Presentation(document=eccentric_document, rows=eccentric_rows)
    return EccentricRun(scene=scene, history=history, memory=memory[0], presentation=presentation)


def locked_run(scene: EccentricScene) -> EccentricRun:
    """The run of the same rotor with the masses clamped where they start: without balancing."""
    return simulate_eccentric(replace(scene, supervisor=replace(scene.supervisor, strategy="locked")))
