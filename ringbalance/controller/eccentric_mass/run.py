"""Run of a scene with two eccentric masses: plant, sensors and strategy, sample by sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.balancer import Progress
from ringbalance.controller.eccentric_mass.memory import (
    HISTORY,
    MEMORY,
    Cause,
    EccentricMeasurement,
    Hold,
)
from ringbalance.controller.eccentric_mass.plant import (
    ANGLE,
    LOCKED,
    MAX_RATE_PRODUCT,
    SIZE,
    STUCK,
    TURN,
    VOLTAGE,
    X_RATE,
    Y_RATE,
    PlantParameters,
    X,
    Y,
    fastest_rate,
    plant_row,
    plant_step,
    speed_at,
    turned,
)
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_rows import (
    eccentric_document,
    eccentric_history,
    eccentric_rows,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import begin_strategy, strategy_step
from ringbalance.results.result import Presentation
from ringbalance.scene.arrays import FloatArray, Record
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.origins import value_at, with_values_at
from ringbalance.scene.platform.compiled import compiled
from ringbalance.scene.units import format_quantity

Seed = int | np.random.Generator | None
"""Seed of random numbers, or their generator."""
_MAX_WHIRL = 1e3
"""Largest ratio of displacement to track radius: the plant is linear in the displacement; real bearings are
not, far below this."""
_MAX_TURN_RAD = 1e3
"""Largest travel of a mass within one sample, more than a hundred turns: no sampled loop controls that."""
_MAX_NUMBER = 1e100
"""Largest number in a history, in any unit: its squares and products stay finite."""


class Machine(NamedTuple):
    """Plant, speed profile and mode of a run."""

    plant: PlantParameters
    times: FloatArray
    """Times of the corners of the speed profile, s."""
    speeds: FloatArray
    """Speeds at the corners, rad/s."""
    locked: bool
    """True if the masses are clamped to the track, without drive and filter."""

    @classmethod
    def of(cls, scene: EccentricScene) -> Machine:
        """Derive plant and profile from a scene."""
        return cls(PlantParameters.of(scene), *scene.rotor.profile, scene.supervisor.strategy == "locked")


SENSOR_NOISES: Final = 8
"""Random numbers per sample: four of vibration, two of angles, two of rates."""


def sensor_noise(scene: EccentricScene, seed: Seed) -> FloatArray:
    """Noise of the sensors in all samples of a run, m, m/s, rad and rad/s, shape (n, 8)."""
    sensor, random = scene.sensor, np.random.default_rng(seed)
    of_vibration = (sensor.position_noise, sensor.velocity_noise)
    deviations = np.repeat((*of_vibration, sensor.encoder_noise, sensor.encoder_rate_noise), 2)
    return np.asarray(random.standard_normal((scene.samples, SENSOR_NOISES)) * deviations)


@compiled
def measure(
    machine: Machine, laboratory: bool, row: FloatArray, time: float, noise: Sequence[float] | FloatArray
) -> EccentricMeasurement:
    """Sample of the sensors, along fixed axes if `laboratory`.

    Args: `noise`: of two displacements, m, velocities, m/s, angles, rad, and rates, rad/s.
    """
    speed, speed_rate = speed_at(machine.times, machine.speeds, time)
    turn = turned(machine.times, machine.speeds, time)
    position, velocity = complex(row[X], row[Y]), complex(row[X_RATE], row[Y_RATE])
    if laboratory:
        outward = complex(math.cos(turn), math.sin(turn))
        velocity = outward * (velocity + complex(0.0, speed) * position)
        position = outward * position
    position, velocity = position + complex(noise[0], noise[1]), velocity + complex(noise[2], noise[3])
    angle = (row[ANGLE] + noise[4], row[ANGLE + 1] + noise[5])
    rate = (row[TURN] + noise[6], row[TURN + 1] + noise[7])
    return EccentricMeasurement(time, speed, speed_rate, turn, position, velocity, angle, rate)


@compiled
def _run_interval(
    settings: StrategySettings,
    machine: Machine,
    noise: FloatArray,
    memory: Record,
    row: FloatArray,
    history: Record,
    first: int,
    after: int,
) -> None:
    """Run samples `first` to `after - 1`, each followed by a step of the plant, into the history."""
    energy = 0.0 if first == 0 else history[first - 1].energy
    for i in range(first, after):
        measurement = measure(machine, settings.laboratory, row, i * settings.step, noise[i])
        if machine.locked:
            memory.cause, memory.hold = Cause.LOCKED, Hold.RELEASED
            memory.travel.goal[0], memory.travel.goal[1] = row[ANGLE], row[ANGLE + 1]
        else:
            strategy_step(settings, memory, measurement)
        sample = history[i]
        sample.stage, sample.cause, sample.hold = memory.stage, memory.cause, memory.hold
        # Element by element: numba takes ten times as long to compile an array assignment.
        for k in range(SIZE):
            sample.state[k] = row[k]
        for k in range(2):
            sample.voltage[k], sample.goal[k] = memory.voltage[k], memory.travel.goal[k]
            sample.friction_arm[k] = memory.friction.filter[k].arm
            sample.friction_variance[k] = memory.friction.filter[k].arm_variance
            sample.imbalance[k] = memory.estimation.filter.state[4 + k]
            for m in range(2):
                sample.imbalance_covariance[k, m] = memory.estimation.filter.covariance[4 + k, 4 + m]
            row[VOLTAGE + k] = memory.voltage[k]
        energy += plant_step(machine.plant, row, measurement.speed, measurement.speed_rate, settings.step)
        sample.energy = energy


MAX_SUBSTEPS: Final = 30_000_000
"""Substeps of a run of about one minute, at 2 us each."""
MAX_SAMPLES: Final = 2_000_000
"""Samples whose histories take about 500 MB."""
_INTERVAL_SUBSTEPS: Final = 50_000
"""Substeps between two reports of progress, some 0.1 s."""


def _substeps_of(scene: EccentricScene) -> float:
    """Substeps of a whole run, estimated from the speed at no more than 10,000 instants.

    Raises: SceneError: more than `MAX_SAMPLES`, or more than `MAX_SUBSTEPS`; it names the key of the fastest
    rate and what is allowed.
    """
    duration, step, plant = scene.run.time_limit, scene.sensor.step, PlantParameters.of(scene)
    times, speeds = scene.rotor.profile
    instants = np.linspace(0.0, duration, min(scene.samples, 10_000))
    rates = np.abs(np.interp(instants, times, speeds)) + fastest_rate(plant, 0.0)
    count = scene.samples * float(np.mean(np.maximum(np.ceil(rates * step / MAX_RATE_PRODUCT), 1.0)))
    if scene.samples <= MAX_SAMPLES and count <= MAX_SUBSTEPS:
        return count
    if scene.samples > MAX_SAMPLES:
        path, value, dimension, unit = "run.time_limit", duration, "time", "s"
        taken = f"{scene.samples:.3g} samples, and {MAX_SAMPLES:.3g}"
        allowed = f"at most {step * (MAX_SAMPLES - 1):.4g} s, or a longer sensor.step"
    else:
        # Half of the allowed substeps: the other rates need the rest.
        rate, mass = 0.5 * MAX_SUBSTEPS * MAX_RATE_PRODUCT / duration, plant.mass
        drive = plant.drive_damping / (plant.inertia + plant.drive_inertia - 2 * plant.moment**2 / mass)
        fastest = float(np.max(np.abs(speeds)))
        rates_and_limits = {
            "rotor.stiffness": (math.sqrt(plant.stiffness / mass), mass * rate**2, "N/m"),
            "rotor.damping": (0.5 * plant.damping / mass, mass * rate, "N*s/m"),
            "rotor.speed_profile": (fastest, rate, "rpm"),
            "motor.resistance": (drive, scene.motor.resistance * drive / rate, "ohm"),
        }
        path = max(rates_and_limits, key=lambda each: rates_and_limits[each][0])
        _, limit, unit = rates_and_limits[path]
        value = fastest if unit == "rpm" else value_at(scene, path)
        dimension = "speed" if unit == "rpm" else path.partition(".")[2]
        taken = f"{count:.3g} steps of the integration, and {MAX_SUBSTEPS:.3g}"
        bound = "at least" if unit == "ohm" else "at most"
        allowed = f"{bound} {format_quantity(limit, dimension, unit, digits=3)}, or a shorter run.time_limit"
    table, _, key = path.partition(".")
    problem, text = f"the run would take {taken} are the most", format_quantity(value, dimension, unit)
    fault = Fault(file=scene.file, table=table, key=key, value=text, problem=problem, allowed=allowed)
    raise SceneError([fault])


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
    size = max(1, round(_INTERVAL_SUBSTEPS * scene.samples / _substeps_of(scene)))
    settings, machine = settings or StrategySettings.of(scene), Machine.of(scene)
    history, memory = np.zeros(scene.samples, dtype=HISTORY), np.zeros(1, dtype=MEMORY)
    noise = sensor_noise(scene, scene.run.seed if seed is None else seed)
    row = plant_row(scene.masses.initial_angle, LOCKED if machine.locked else STUCK)
    if not machine.locked:
        begin_strategy(settings, memory[0], measure(machine, settings.laboratory, row, 0.0, noise[0]))
    for begin in range(0, scene.samples, size):
        end = min(begin + size, scene.samples)
        _run_interval(settings, machine, noise, memory[0], row, history, begin, end)
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
    presentation = Presentation(document=eccentric_document, rows=eccentric_rows, history=eccentric_history)
    return EccentricRun(scene=scene, history=history, memory=memory[0], presentation=presentation)


def locked_run(scene: EccentricScene) -> EccentricRun:
    """Run the rotor without balancing: masses clamped at their initial angles."""
    return simulate_eccentric(with_values_at(scene, {"supervisor.strategy": "locked"}))
