"""One run of a scene with two eccentric masses: plant, sensors and strategy, sample by sample."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringbalance.controller.balancer import Progress
from ringbalance.controller.eccentric_mass.integration import check_substeps, plant_step, run_plant, stretches
from ringbalance.controller.eccentric_mass.plan import (
    RELEASED,
    Cause,
    EccentricMeasurement,
    Findings,
    StrategyState,
)
from ringbalance.controller.eccentric_mass.plant import (
    STUCK,
    PlantParameters,
    electrical_energy,
    rest_state,
    speed_at,
    stuck_flags,
    turned,
)
from ringbalance.controller.eccentric_mass.run_facts import Record
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import strategy_start, strategy_step
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.platform.compiled import compiled

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


class _SensorNoise(NamedTuple):
    """Standard deviations of the sensors."""

    position: float
    velocity: float
    angle: float
    rate: float


class _Profile(NamedTuple):
    """The rotor's speed over time."""

    times: FloatArray
    """Of the corners, s."""
    speeds: FloatArray
    """At the corners, rad/s."""


def _recorded(
    scene: EccentricScene,
    seed: Seed,
    progress: Progress,
    settings: StrategySettings,
) -> tuple[Record, Findings, float | None]:
    """Every sample before the first that means nothing, and what the strategy found.

    Returns: Last, the mean square of the imbalance filter's normalised innovations; None without any.
    """
    samples = scene.samples
    if scene.supervisor.strategy == "locked":
        return _locked(scene, _empty_record(samples), progress), Findings(False, 0.0, np.inf, 0.0, 0, 0), None
    numbers = np.random.default_rng(scene.run.seed if seed is None else seed)
    return _driven(scene, settings, numbers.standard_normal((samples, NOISES)), progress)


def _locked(scene: EccentricScene, record: Record, progress: Progress) -> Record:
    """The masses clamped to the track, no drive, no filter."""
    states = run_plant(scene, locked=True, progress=progress).state
    record.state[:], record.goal[:] = states, states[:, 4:6]
    record.cause[:], record.hold[:] = int(Cause.LOCKED), RELEASED
    return _meaningful(record, scene)


def _driven(
    scene: EccentricScene, settings: StrategySettings, numbers: FloatArray, progress: Progress
) -> tuple[Record, Findings, float | None]:
    parameters, record = PlantParameters.of(scene), _empty_record(len(numbers))
    state, stuck = rest_state(scene.masses.initial_angle), stuck_flags(STUCK)
    profile, sensor = _Profile(*scene.rotor.profile), scene.sensor
    noise = _SensorNoise(
        sensor.position_noise, sensor.velocity_noise, sensor.encoder_noise, sensor.encoder_rate_noise
    )
    first = _measure(state, profile, 0.0, settings.laboratory, noise, numbers[0])
    memory = strategy_start(settings, first)
    for begin, end in stretches(len(numbers)):
        memory, state, stuck = _run_stretch(
            settings,
            parameters,
            profile,
            noise,
            numbers,
            memory,
            state,
            stuck,
            record,
            begin,
            end,
        )
        progress(end * settings.step, scene.run.time_limit)
        kept = _meaningful(_cut(record, slice(end)), scene, since=begin)
        if len(kept.state) < end:
            record = kept
            break
    whirl = memory.whirl
    innovation = whirl.surprise / (4 * whirl.judged) if whirl.judged else None
    return _shifted(record), memory.plan.findings, innovation


def _shifted(record: Record) -> Record:
    """The energy of the last sample's voltage would be spent after the run."""
    record.energy[1:] = record.energy[:-1]
    record.energy[0] = 0.0
    return record


def _meaningful(record: Record, scene: EccentricScene, *, since: int = 0) -> Record:
    """The rows before the first that has diverged.

    Returns: The record when nothing in it has diverged; else a shorter one, of at least one row: at the start
    everything rests.
    """
    bad = np.flatnonzero(_diverged(_cut(record, slice(since, None)), scene))
    return _cut(record, slice(max(since + int(bad[0]), 1))) if bad.size else record


def _cut(record: Record, part: slice) -> Record:
    return Record._make(values[part] for values in record)


def _diverged(record: Record, scene: EccentricScene) -> BoolArray:
    state = record.state
    whirl = np.max(np.abs(state[:, :2]), axis=1)
    turn = np.max(np.abs(state[:, 6:8]), axis=1) * scene.sensor.step
    # A comparison with NaN is false.
    usual = (whirl <= _LARGEST_WHIRL * scene.masses.guide_radius) & (turn <= _LARGEST_TURN)
    for values in record:
        if values.dtype == np.float64:
            usual &= np.all(np.abs(values.reshape(len(values), -1)) <= _LARGEST, axis=1)
    return np.asarray(~usual)


def _empty_record(samples: int) -> Record:
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
def _measure(
    state: FloatArray,
    profile: _Profile,
    time: float,
    laboratory: bool,
    noise: _SensorNoise,
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
def _run_stretch(
    settings: StrategySettings,
    parameters: PlantParameters,
    profile: _Profile,
    noise: _SensorNoise,
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
        seen = _measure(state, profile, time, settings.laboratory, noise, numbers[i])
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
    record, findings, innovation = _recorded(
        scene, seed, progress or (lambda _, __: None), settings or StrategySettings.of(scene)
    )
    return EccentricRun(scene=scene, estimates=record, findings=findings, innovation=innovation)


def locked_run(scene: EccentricScene) -> EccentricRun:
    """The run of the same rotor with the masses clamped where they start: without balancing."""
    return simulate_eccentric(replace(scene, supervisor=replace(scene.supervisor, strategy="locked")))
