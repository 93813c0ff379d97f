"""The disc of one member in plain numbers: all pairs through a command's valve-open time and through a wait.

By the flow law alone; `compiled_motion` carries on a motion of its own.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import in_place
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.ensemble.transfer import gas_off, gas_on
from ringbalance.controller.formulas import NOTICEABLE, piece_rise
from ringbalance.controller.liquid_ring.reach import FILL_ERROR, TIME_ERROR

_piece_rise: Final = in_place(piece_rise)


@in_place
def reset(shared: Record, run: Record) -> None:
    """All pairs level, no tube full."""
    for i in range(shared.chambers // 2):
        run.fill[i], run.wet[i], run.side[i], run.runs_back[i] = shared.initial_fill, 0.0, 1.0, 0.0


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
def _pair_at(shared: Record, run: Record, i: int, time: float) -> tuple[float, bool, bool, float]:
    """One pair some time into a stretch: fill, column, side, and how far liquid ran back."""
    fill, wet, first = run.fill_before[i], run.wet_before[i] > 0.0, run.side_before[i] > 0.0
    left = time
    if i == run.pair or i == run.other_pair:
        duration = run.duration if i == run.pair else run.other_duration
        first = (run.first if i == run.pair else run.other_first) != 0
        left = time - duration
        driven = fill if first else shared.total - fill
        driven, wet = gas_on(shared, driven, wet, min(time, duration) * run.speed)
        fill = driven if first else shared.total - driven
    if left <= 0.0 or not (wet or shared.floods):
        return fill, wet, first, 0.0
    driven = fill if first else shared.total - fill
    driven, wet = gas_off(shared, driven, wet, left * run.speed)
    after = driven if first else shared.total - driven
    return after, wet, first, abs(after - fill)


@in_place
def opening(shared: Record, run: Record, pair: int, first: bool, duration: float) -> float:
    """Longest valve-open time, at most `duration`, s, that leaves the driven chamber its residual fill."""
    fill = run.fill[pair] if first else shared.total - run.fill[pair]
    wet, least = run.wet[pair] > 0.0, run.residual_fill
    if gas_on(shared, fill, wet, duration * run.speed)[0] >= least:
        return duration
    low, high = 0.0, duration
    while high - low > TIME_ERROR * duration:
        middle = (low + high) / 2.0
        if gas_on(shared, fill, wet, middle * run.speed)[0] >= least + FILL_ERROR:
            low = middle
        else:
            high = middle
    return low


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
def move(shared: Record, run: Record, time: float) -> float:
    """Let a time, s, pass with some valves open from its start; the state before is kept.

    Returns: How far liquid ran back with the gas off, the most of any pair.
    """
    drift = 0.0
    for i in range(shared.chambers // 2):
        run.fill_before[i], run.wet_before[i], run.side_before[i] = run.fill[i], run.wet[i], run.side[i]
        fill, wet, first, ran = _pair_at(shared, run, i, time)
        run.fill[i], run.wet[i], run.side[i] = fill, 1.0 if wet else 0.0, 1.0 if first else 0.0
        run.runs_back[i] = 1.0 if ran > NOTICEABLE and (wet or shared.floods) else 0.0
        drift = max(drift, ran)
    run.drift = max(run.drift, drift)
    return drift


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


@in_place
def note_settling(shared: Record, run: Record, length: float, points: int) -> None:
    """Keep since when the amplitude has not been above the limit, over an interval that `simulate` records.

    `run` is as after `move`, its time still the one before; `points` equally spaced instants are recorded
    beside the closing of each valve.
    """
    if run.amplitude > shared.limit:
        run.since = math.inf
        return
    closing = length if run.other_pair < 0 else min(run.duration, run.other_duration)
    for k in range(1, points + 1):
        early, late = length * (k - 1) / points, length * k / points
        if early < closing < late:
            _note(shared, run, closing)
        _note(shared, run, late)


@in_place
def _back_at(shared: Record, run: Record, time: float) -> tuple[float, float]:
    """Vibration, m, at an instant, s, of the interval last moved through; `trial` becomes the fills then."""
    for i in range(shared.chambers // 2):
        run.trial[i] = _pair_at(shared, run, i, time)[0]
    return vibration(shared, run, True)


@in_place
def _note(shared: Record, run: Record, time: float) -> None:
    real, imaginary = _back_at(shared, run, time)
    above = math.hypot(real, imaginary) > shared.limit
    run.since = math.inf if above else min(run.since, run.time + time)
