"""One closed-loop run in plain numbers that keeps all that `simulate` records."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.compiled import compiled
from ringbalance.controller.compiled_disc import any_wet, back_at
from ringbalance.controller.compiled_member import GOES_ON, gas, judge, react, start, wait
from ringbalance.controller.compiled_records import Record

FloatArray = npt.NDArray[np.float64]

SAMPLE_COLUMNS: Final = 3
"""Time, amplitude and phase as seen."""
VALVE_COLUMNS: Final = 5
"""Time, chamber, duration, and fill before and after."""
PATH_COLUMNS: Final = 3
"""Time, real and imaginary part of the vibration; the pairs' fills follow."""


@compiled
def trace_run(
    shared: Record, run: Record, noise: FloatArray, samples: FloatArray, valves: FloatArray, path: FloatArray
) -> tuple[int, int]:
    """Run one member and keep its samples, its operations and its path.

    Args:
        shared: of type `SHARED`.
        run: the member; filled.
        noise: of amplitude and phase in standard deviations, shape (most samples, 2).
        samples: filled, shape (most samples, SAMPLE_COLUMNS).
        valves: filled, shape (twice the most samples, VALVE_COLUMNS).
        path: filled, shape (rows, PATH_COLUMNS + pairs).

    Returns:
        Rows filled of `valves` and of `path`.
    """
    start(shared, run)
    run.trial[:] = run.fill
    count, rows = 0, _keep(run, path, 0, run.real, run.imaginary, run.time)
    before = 0.0
    while run.cause == GOES_ON and run.samples < samples.shape[0]:
        i = run.samples
        run.samples += 1
        react(shared, run, (noise[i, 0], noise[i, 1]), before)
        before = noise[i, 1]
        samples[i, 0], samples[i, 1], samples[i, 2] = run.time, run.seen_amplitude, run.seen_phase
        if run.cause == GOES_ON:
            began = run.time
            if run.pair >= 0:
                length = gas(shared, run)
                count = _operations(shared, run, valves, count, began)
                rows = _stretch(shared, run, path, rows, (began, length), shared.gas_points)
            began = run.time
            points = shared.drift_points if any_wet(shared, run) else 0
            length = wait(shared, run)
            if points > 0:
                rows = _stretch(shared, run, path, rows, (began, length), points)
            elif length > 0.0:
                run.trial[:] = run.fill
                rows = _keep(run, path, rows, run.real, run.imaginary, run.time)
    judge(shared, run, samples[max(run.samples - shared.confirming, 0), 0])
    return count, rows


@compiled
def _keep(run: Record, path: FloatArray, row: int, real: float, imaginary: float, time: float) -> int:
    """One instant with the fills on trial."""
    path[row, 0], path[row, 1], path[row, 2] = time, real, imaginary
    for i in range(path.shape[1] - PATH_COLUMNS):
        path[row, PATH_COLUMNS + i] = run.trial[i]
    return row + 1


@compiled
def _stretch(
    shared: Record, run: Record, path: FloatArray, row: int, span: tuple[float, float], points: int
) -> int:
    """The instants that `simulate` records of a stretch: equally spaced, and where a valve closes."""
    began, length = span
    closing = length if run.other_pair < 0 else min(run.duration, run.other_duration)
    for k in range(1, points + 1):
        early, late = length * (k - 1) / points, length * k / points
        if early < closing < late:
            real, imaginary = back_at(shared, run, closing)
            row = _keep(run, path, row, real, imaginary, began + closing)
        real, imaginary = back_at(shared, run, late)
        row = _keep(run, path, row, real, imaginary, began + late)
    return row


@compiled
def _operations(shared: Record, run: Record, valves: FloatArray, row: int, began: float) -> int:
    """What the open valves have done."""
    for k in range(2):
        pair = run.pair if k == 0 else run.other_pair
        if pair >= 0:
            first = (run.first if k == 0 else run.other_first) != 0
            before, after = run.fill_before[pair], run.fill[pair]
            valves[row, 0], valves[row, 1] = began, pair if first else pair + shared.chambers // 2
            valves[row, 2] = run.duration if k == 0 else run.other_duration
            valves[row, 3] = before if first else shared.total - before
            valves[row, 4] = after if first else shared.total - after
            row += 1
    return row
