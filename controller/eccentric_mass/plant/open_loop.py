"""The plant alone over many steps: prescribed speed, drives switched off, no controller.

How many substeps a run takes is counted before it begins.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.plant.integrate import LONGEST, fastest_rate, plant_step
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters, speed_at
from ringbalance.controller.eccentric_mass.plant.plant import LOCKED, SIZE, STUCK, rest_state, stuck_flags
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.platform.compiled import compiled
from ringbalance.scene.units import format_quantity

MOST_SUBSTEPS: Final = 30_000_000
"""About one minute, at 2 us each."""
MOST_SAMPLES: Final = 2_000_000
"""About 500 MB of histories."""


def check_substeps(scene: EccentricScene) -> None:
    """Refuse a scene whose run would take many minutes or much memory.

    A substep lasts at most 0.1 / (|W| + sqrt(K_B / M) + C_B / M + C_add / J_least).
    Raises: SceneError: more than `MOST_SAMPLES`, or more than `MOST_SUBSTEPS`; it names the key of the
    fastest rate and what is allowed.
    """
    samples = scene.run.time_limit / scene.sensor.step + 1
    if samples > MOST_SAMPLES:
        longest = scene.sensor.step * (MOST_SAMPLES - 1)
        problem = f"the run would take {samples:.3g} samples, and {MOST_SAMPLES:.3g} are the most"
        value = format_quantity(scene.run.time_limit, "time", "s")
        allowed = f"at most {longest:.4g} s, or a longer sensor.step"
        raise SceneError([_fault(scene, ("run", "time_limit"), value, problem, allowed)])
    count = _substeps(scene)
    if count > MOST_SUBSTEPS:
        key, value, allowed = _fastest(scene)
        problem = (
            f"the run would take {count:.3g} steps of the integration, and {MOST_SUBSTEPS:.3g} are the most"
        )
        raise SceneError([_fault(scene, key, value, problem, f"{allowed}, or a shorter run.time_limit")])


def longest_run(scene: EccentricScene) -> float:
    """Longest run.time_limit that `check_substeps` allows, s, if the speed stays what it is on average."""
    by_samples = scene.sensor.step * (MOST_SAMPLES - 1)
    return min(by_samples, scene.run.time_limit * MOST_SUBSTEPS / _substeps(scene))


def _substeps(scene: EccentricScene) -> float:
    parameters, step = PlantParameters.of(scene), scene.sensor.step
    times, speeds = scene.rotor.profile
    samples = scene.samples
    # Not at every sample: close enough for a limit, and cheap.
    at = np.linspace(0.0, scene.run.time_limit, min(samples, 10_000))
    rates = np.abs(np.interp(at, times, speeds)) + fastest_rate(parameters, 0.0)
    return samples * float(np.mean(np.maximum(np.ceil(rates * step / LONGEST), 1.0)))


def _fastest(scene: EccentricScene) -> tuple[tuple[str, str], str, str]:
    """Key, present value and limit of the largest of the rates that the steps follow from."""
    plant, resistance = PlantParameters.of(scene), scene.motor.resistance
    least = plant.inertia + plant.drive_inertia - 2 * plant.moment**2 / plant.mass
    speed = max(abs(point.speed) for point in scene.rotor.speed_profile)
    whirl, damped = math.sqrt(plant.stiffness / plant.mass), plant.damping / plant.mass
    drive = plant.drive_damping / least
    # Half of what the whole run may have: the other rates take their part.
    rate = 0.5 * MOST_SUBSTEPS * LONGEST / scene.run.time_limit
    most, lowest = "at most", "at least"
    keys = [
        (whirl, ("rotor", "stiffness"), plant.stiffness, most, plant.mass * rate**2, "stiffness", "N/m"),
        (damped, ("rotor", "damping"), plant.damping, most, plant.mass * rate, "damping", "N*s/m"),
        (speed, ("rotor", "speed_profile"), speed, most, rate, "speed", "rpm"),
        (drive, ("motor", "resistance"), resistance, lowest, resistance * drive / rate, "resistance", "ohm"),
    ]
    _, key, value, bound, limit, dimension, unit = max(keys)
    shown = format_quantity(limit, dimension, unit, digits=3)
    return key, format_quantity(value, dimension, unit), f"{bound} {shown}"


def _fault(scene: EccentricScene, key: tuple[str, str], value: str, problem: str, allowed: str) -> Fault:
    return Fault(file=scene.file, table=key[0], key=key[1], value=value, problem=problem, allowed=allowed)


_FIRST: Final = 64
_MOST: Final = 10_000
_SHORT: Final = 0.05
"""A piece that took less is followed by one of twice the samples, s."""
_LONG: Final = 0.2
"""A piece that took more is followed by one of half the samples, s."""

Progress = Callable[[float, float], None]
"""Called with the simulated time and the time limit, s."""


class _PlantRun(NamedTuple):
    """History of the plant."""

    time: FloatArray
    """s, shape (steps + 1,)."""
    speed: FloatArray
    """W, rad/s, shape (steps + 1,)."""
    state: FloatArray
    """Shape (steps + 1, 8)."""

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
    first: int = 0,
) -> tuple[FloatArray, IntArray]:
    """States, shape (steps + 1, 8), and flags, shape (steps + 1, 2), over steps of equal length."""
    count = commands.shape[0]
    states, flags = np.empty((count + 1, state.size)), np.empty((count + 1, 2), np.int64)
    for place in range(count + 1):
        for entry in range(state.size):
            states[place, entry] = state[entry]
        flags[place, 0], flags[place, 1] = stuck[0], stuck[1]
        if place < count:
            speed, rate = speed_at(times, speeds, (first + place) * step)
            state, stuck = plant_step(parameters, state, stuck, commands[place], speed, rate, step)
    return states, flags


def run_plant(scene: EccentricScene, *, locked: bool = False, progress: Progress | None = None) -> _PlantRun:
    """Run a scene's plant from rest, with its drives switched off.

    Args: `locked`: whether both masses are clamped to the track. `progress`: called several times a second;
    None for silence.
    Raises: SceneError: a run that takes too many substeps.
    """
    check_substeps(scene)
    step, count = scene.sensor.step, scene.samples - 1
    times, speeds = scene.rotor.profile
    parameters, flags = PlantParameters.of(scene), stuck_flags(LOCKED if locked else STUCK)
    states = np.empty((count + 1, SIZE))
    states[0] = rest_state(scene.masses.initial_angle)
    for begin, end in stretches(count):
        off = np.zeros((end - begin, 2))
        states[begin : end + 1], passed = run_steps(
            parameters, times, speeds, states[begin], flags, off, step, begin
        )
        flags = passed[-1]
        if progress is not None:
            progress(end * step, scene.run.time_limit)
    elapsed: FloatArray = np.arange(len(states), dtype=np.float64) * step
    return _PlantRun(elapsed, np.interp(elapsed, times, speeds), states)


def stretches(samples: int) -> Iterator[tuple[int, int]]:
    """Pieces of the samples by the caller's time for each: its first number and one past its last."""
    begin, size = 0, _FIRST
    while begin < samples:
        end = min(begin + size, samples)
        started = time.perf_counter()
        yield begin, end
        elapsed = time.perf_counter() - started
        if elapsed > _LONG:
            size = max(size // 2, 1)
        elif elapsed < _SHORT:
            size = min(2 * size, _MOST)
        begin = end
