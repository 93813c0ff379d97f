"""The disc of one member in plain numbers: its vibration, and what is told of its pairs."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import in_place
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.formulas import piece_rise

_piece_rise: Final = in_place(piece_rise)


@in_place
def reset(shared: Record, run: Record) -> None:
    """All pairs level, no tube full."""
    for i in range(shared.chambers // 2):
        run.fill[i], run.wet[i], run.runs_back[i] = shared.initial_fill, 0.0, 0.0


@in_place
def any_wet(shared: Record, run: Record) -> bool:
    """Whether any tube holds a column or lets liquid through without one, or any pair moves."""
    found = bool(shared.floods)
    for i in range(shared.chambers // 2):
        found = found or run.wet[i] > 0.0
    return found


@in_place
def _piece(shared: Record, share: float, cell: int, column: int) -> float:
    y0, d0 = shared.moment[cell, column], shared.moment[cell, column + 1]
    rise, d1 = shared.moment[cell + 1, column] - y0, shared.moment[cell + 1, column + 1]
    return float(y0 + _piece_rise(share, rise, d0, d1))


@in_place
def _moment(shared: Record, fill: float) -> tuple[float, float]:
    """Of one pair along its axis and across it, kg m, by `moment.MomentTable`."""
    last = shared.moment.shape[0] - 1
    place = min(max((fill - shared.lowest) / shared.moment_step, 0.0), float(last))
    cell = min(int(place), last - 1)
    along = _piece(shared, place - cell, cell, 0)
    return along, _piece(shared, place - cell, cell, 2) if shared.asymmetric else 0.0


@in_place
def vibration(shared: Record, run: Record, trial: bool) -> tuple[float, float]:
    """Real and imaginary part of the vibration with the disc's liquid, m; `trial`: by the fills on trial."""
    real, imaginary = 0.0, 0.0
    for i in range(shared.chambers // 2):
        along, across = _moment(shared, (run.trial[i] if trial else run.fill[i]))
        real += shared.axis[i, 0] * along - shared.axis[i, 1] * across
        imaginary += shared.axis[i, 1] * along + shared.axis[i, 0] * across
    return (
        shared.start_real + run.gain_real * real - run.gain_imaginary * imaginary,
        shared.start_imaginary + run.gain_real * imaginary + run.gain_imaginary * real,
    )


@in_place
def kept(shared: Record, run: Record, found: float, duration: float, chamber: int) -> float:
    """Count a valve-open time, s, that was shortened; zero where it is below the chamber's least."""
    if found == duration:
        return duration
    run.shortened += 1
    run.at_residual[chamber] = 1
    return found if found >= shared.minimum_gas_time + shared.offset[chamber] else 0.0


@in_place
def leave_out(run: Record) -> None:
    """Do without the valves that have no time left."""
    if run.other_pair >= 0 and run.other_duration == 0.0:
        run.other_pair = -1
    if run.duration == 0.0:
        run.pair, run.first, run.duration = run.other_pair, run.other_first, run.other_duration
        run.other_pair = -1
        run.idle += 1 if run.pair < 0 else 0


@in_place
def drains(shared: Record, run: Record) -> bool:
    """Whether what still runs back would take the vibration above the limit, as `LiquidRing.drains`."""
    found = False
    for i in range(shared.chambers // 2):
        back = run.runs_back[i] > 0.0
        run.trial[i] = shared.total / 2.0 if back else run.fill[i]
        found = found or bool(back)
    if not found:
        return False
    real, imaginary = vibration(shared, run, True)
    return bool(math.hypot(real, imaginary) > shared.limit)
