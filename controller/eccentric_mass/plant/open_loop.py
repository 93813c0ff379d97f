"""The plant alone over many steps: prescribed speed, prescribed voltages, no controller."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.eccentric_mass.plant.friction import LOCKED, STUCK
from ringbalance.controller.eccentric_mass.plant.integrate import plant_step
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.controller.eccentric_mass.plant.plant import SIZE, rest_state, stuck_flags
from ringbalance.controller.eccentric_mass.plant.speed import speed_at
from ringbalance.controller.eccentric_mass.plant.substep_limit import check_substeps
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.eccentric_models import EccentricScene

_FIRST: Final = 64
_MOST: Final = 10_000
_SHORT: Final = 0.05
"""A piece that took less is followed by one of twice the samples, s."""
_LONG: Final = 0.2
"""A piece that took more is followed by one of half the samples, s."""

Progress = Callable[[float, float], None]
"""Called with the simulated time and the time limit, s."""


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


def run_plant(
    scene: EccentricScene,
    *,
    commands: FloatArray | None = None,
    locked: bool = False,
    progress: Progress | None = None,
) -> PlantRun:
    """Run a scene's plant from rest, with the voltages given.

    Args: `commands`: V, shape (steps, 2); None for drives switched off. `locked`: whether both masses are
    clamped to the track. `progress`: called several times a second; None for silence.
    Raises: SceneError: a run that takes too many substeps.
    """
    check_substeps(scene)
    step = scene.sensor.step
    count = scene.samples - 1
    voltages = np.zeros((count, 2)) if commands is None else np.ascontiguousarray(commands, dtype=np.float64)
    times, speeds = scene.rotor.profile
    parameters = PlantParameters.of(scene)
    states, flags = np.empty((count + 1, SIZE)), np.empty((count + 1, 2), dtype=np.int64)
    states[0], flags[0] = rest_state(scene.masses.initial_angle), stuck_flags(LOCKED if locked else STUCK)
    for begin, end in stretches(count):
        states[begin : end + 1], flags[begin : end + 1] = run_steps(
            parameters, times, speeds, states[begin], flags[begin], voltages[begin:end], step, begin
        )
        if progress is not None:
            progress(end * step, scene.run.time_limit)
    elapsed: FloatArray = np.arange(len(states), dtype=np.float64) * step
    return PlantRun(elapsed, np.interp(elapsed, times, speeds), states, flags)


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
