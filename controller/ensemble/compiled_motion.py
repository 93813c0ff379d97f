"""The disc of one member whose liquid, gas and valves have dynamics of their own, in plain numbers."""

from __future__ import annotations

import math
from typing import Any

from ringbalance.controller.compilation.compiled import in_place
from ringbalance.controller.ensemble.compiled_disc import kept, leave_out, vibration
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.formulas import NOTICEABLE
from ringbalance.controller.liquid_ring.compiled_events import command, rests
from ringbalance.controller.liquid_ring.compiled_gas import gas_volume
from ringbalance.controller.liquid_ring.compiled_march import advance, least_later, opening_within
from ringbalance.controller.liquid_ring.reach import NEAR_RESIDUAL
from ringbalance.controller.liquid_ring.records import P, X
from ringbalance.scene.arrays import FloatArray


@in_place
def begin(plant: Record, motion: Record, fill: float, speed: float, residual: float) -> None:
    """A pair at rest, vented; `speed` is a factor of the law's velocity, `residual` a fill ratio."""
    y = motion.state
    for i in range(8):
        y[i] = 0.0
    y[X], y[P], y[P + 1] = fill, plant.ambient_pressure, plant.ambient_pressure
    y[P + 2] = plant.ambient_pressure * gas_volume(plant, fill) / plant.temperature
    y[P + 3] = plant.ambient_pressure * gas_volume(plant, plant.total - fill) / plant.temperature
    motion.opens, motion.closes, motion.log_speed = math.inf, math.inf, math.log(speed)
    motion.length, motion.started, motion.ran_back = plant.first_step, fill, 0.0
    motion.fill_before, motion.least_fill, motion.residual = fill, fill, residual
    motion.closing_pressure, motion.run_dry = 0.0, 0.0
    motion.primed, motion.valve_0, motion.valve_1, motion.direction = 0, 0, 0, 0
    motion.balanced, motion.stopped, motion.steps, motion.chamber = 0, 0, 0, 0
    motion.regime_start, motion.regime_end, motion.event = 0, 0, 0
    motion.front, motion.lifting, motion.side = 0.0, 0, 0


@in_place
def inject(
    shared: Record, plant: Record, run: Record, motions: Any, notes: FloatArray, w: FloatArray
) -> None:
    """Command the one or two valves of a member and let time pass until the next sample.

    A valve-open time that would take its chamber below the residual fill is shortened or left out: the motion
    is tried as commanded, and made again where that falls short.
    """
    half = shared.chambers // 2
    for i in range(half):
        motions[half + i] = motions[i]
    if not _keeps_residual(shared, plant, run, motions, notes, w):
        for i in range(half):
            motions[i] = motions[half + i]
        _shorten(shared, plant, run, motions, w)
        _open_valves(plant, run, motions)
        _pass(shared, plant, run, motions, notes, w)
    _note(shared, plant, run, motions, notes)


@in_place
def _keeps_residual(
    shared: Record, plant: Record, run: Record, motions: Any, notes: FloatArray, w: FloatArray
) -> bool:
    """Move as commanded. Returns: whether each driven chamber keeps its residual fill, tail included."""
    half, least = shared.chambers // 2, run.residual_fill
    if least > 0.0 and not (_above_residual(shared, run, False) and _above_residual(shared, run, True)):
        return False
    _open_valves(plant, run, motions)
    _pass(shared, plant, run, motions, notes, w)
    for other in range(2):
        pair = run.other_pair if other else run.pair
        if least > 0.0 and pair >= 0:
            motions[2 * half] = motions[pair]
            if least_later(plant, motions, 2 * half, w) < least:
                return False
    return True


@in_place
def _above_residual(shared: Record, run: Record, other: bool) -> bool:
    """Whether a driven chamber is above its residual fill, or there is none."""
    pair, first = (run.other_pair, run.other_first) if other else (run.pair, run.first)
    driven = math.inf if pair < 0 else run.fill[pair] if first else shared.total - run.fill[pair]
    return bool(driven > run.residual_fill + NEAR_RESIDUAL)


@in_place
def _shorten(shared: Record, plant: Record, run: Record, motions: Any, w: FloatArray) -> None:
    """Shorten the valve-open times to what leaves the residual fill; those below the minimum are left out."""
    run.duration = _permitted(shared, plant, run, motions, w, False, run.duration)
    if run.other_pair >= 0:
        run.other_duration = _permitted(shared, plant, run, motions, w, True, run.other_duration)
    leave_out(run)


@in_place
def _permitted(
    shared: Record, plant: Record, run: Record, motions: Any, w: FloatArray, other: bool, duration: float
) -> float:
    """A valve-open time, s, that leaves the residual fill; zero where it would be below the minimum."""
    pair, first = (run.other_pair, run.other_first) if other else (run.pair, run.first)
    found = 0.0
    if _above_residual(shared, run, other):
        chamber, spare = 0 if first else 1, shared.chambers // 2 * 2
        found = opening_within(plant, motions, pair, spare, chamber, duration, w)
    return kept(shared, run, found, duration, pair if first else pair + shared.chambers // 2)


@in_place
def _open_valves(plant: Record, run: Record, motions: Any) -> None:
    if run.pair >= 0:
        command(plant, motions[run.pair], 0 if run.first else 1, run.duration)
    if run.other_pair >= 0:
        command(plant, motions[run.other_pair], 0 if run.other_first else 1, run.other_duration)


@in_place
def _pass(shared: Record, plant: Record, run: Record, motions: Any, notes: FloatArray, w: FloatArray) -> None:
    """Carry all pairs to the next sample, with their fills where `simulate` records, in `notes`.

    Those are equally spaced while a valve is commanded, the earlier closing, and equally spaced after it.
    """
    length, closing, count = 0.0, math.inf, 0
    if run.pair >= 0:
        length = max(run.duration, run.other_duration) if run.other_pair >= 0 else run.duration
        closing = min(run.duration, run.other_duration) if run.other_pair >= 0 else length
        for k in range(1, shared.gas_points + 1):
            early, late = length * (k - 1) / shared.gas_points, length * k / shared.gas_points
            if early < closing < late:
                notes[0, count], count = closing, count + 1
            notes[0, count], count = late, count + 1
    run.commanded = length
    wait = max(min(shared.period, shared.time_limit - run.time - length), 0.0)
    run.wait = wait
    for k in range(1, shared.tail_points + 1):
        notes[0, count], count = length + wait * k / shared.tail_points, count + 1
    run.noted = count
    for i in range(shared.chambers // 2):
        motions[i].steps, motions[i].ran_back = 0, 0.0
        advance(plant, motions[i], length + wait, notes, i + 1, count, w)


@in_place
def _note(shared: Record, plant: Record, run: Record, motions: Any, notes: FloatArray) -> None:
    """Since when the amplitude is not above the limit, and the state at the next sample."""
    half = shared.chambers // 2
    for k in range(run.noted):
        for i in range(half):
            run.fill[i] = notes[i + 1, k]
        run.real, run.imaginary = vibration(shared, run, False)
        run.amplitude, run.stale = math.hypot(run.real, run.imaginary), 1
        late = run.amplitude > shared.limit
        run.since = math.inf if late else min(run.since, run.time + notes[0, k])
    for i in range(half):
        run.drift = max(run.drift, motions[i].ran_back)
        run.wet[i] = 0.0 if rests(plant, motions[i]) else 1.0
        moves = motions[i].primed or motions[i].direction != 0
        run.runs_back[i] = 1.0 if moves and motions[i].ran_back > NOTICEABLE else 0.0
