"""Compiled interval from a command to the next sample: valves, liquid, and their rows of the trace."""

from __future__ import annotations

import math

from ringbalance.controller.liquid_ring.plant import NEAR_RESIDUAL
from ringbalance.controller.loop_records import GAS_POINTS, NOTICEABLE_CHANGE, TAIL_POINTS
from ringbalance.reduced_model.injection.dynamics import WORK, X
from ringbalance.reduced_model.injection.events import command, forget
from ringbalance.reduced_model.injection.lift import shown
from ringbalance.reduced_model.injection.march import advance, least_later, opening_within
from ringbalance.reduced_model.injection.moment import pair_moment
from ringbalance.scene.arrays import FloatArray, Record
from ringbalance.scene.platform.compiled import in_place


@in_place
def vibration(loop: Record, plant: Record, run: Record) -> complex:
    """Vibration with the disc's liquid, m."""
    moment = 0j
    for i in range(loop.chambers // 2):
        moment += loop.axis[i] * pair_moment(plant, run.fill[i])
    return complex(run.start + run.gain * moment)


@in_place
def time_left(loop: Record, run: Record) -> float:
    """Time until the run ends undecided, s; a run that came within its limit in time gets time to settle."""
    watched = min(run.since, run.held_since) <= loop.time_limit and run.settled == 0
    more = loop.hold_time + loop.watch_time + 2.0 * loop.period if watched else 0.0
    return float(loop.time_limit + more - run.time)


@in_place
def limit_to_time(loop: Record, run: Record) -> int:
    """Cut the valve-open times to the time left. Returns: the number of valves."""
    half, left, count = loop.chambers // 2, time_left(loop, run), 0
    for i in range(half):
        if run.asked[i] > 0.0:
            if count == 0:
                for chamber in range(loop.chambers):
                    run.refused[chamber] = 0
            count += 1
            run.cut = 1 if run.asked[i] > left else run.cut
            run.asked[i] = min(run.asked[i], left)
        run.drives[i] = run.asked[i]
    return count


@in_place
def move(
    loop: Record,
    plant: Record,
    run: Record,
    motions: Record,
    commanded: int,
    notes: FloatArray,
    w: FloatArray,
) -> None:
    """Integrate to the next sample; at its residual fill a driven chamber gives gas, not liquid.

    The motion is integrated as commanded, and again with shorter driving times where a chamber would fall
    below its residual fill.
    """
    half = loop.chambers // 2
    guarded = commanded > 0 and run.residual_fill > 0.0
    if guarded:
        for i in range(half):
            motions[half + i] = motions[i]
            at_residual = _driven_fill(plant, run, i) <= run.residual_fill + NEAR_RESIDUAL
            if run.asked[i] > 0.0 and at_residual:
                _gas_in_port(loop, run, i, 0.0)
    drift = _pass(loop, plant, run, motions, notes, w)
    if guarded and not _keeps_residual(loop, plant, run, motions, w):
        for i in range(half):
            motions[i] = motions[half + i]
        # Shorter times that drive liquid, so that the residual fill remains.
        for i in range(half):
            if run.drives[i] > 0.0:
                driving, side, lowest = run.drives[i], run.side[i], run.lowest[i]
                time = opening_within(plant, motions, i, 2 * half, side, driving, lowest, w)
                if time != driving:
                    _gas_in_port(loop, run, i, time)
        drift = _pass(loop, plant, run, motions, notes, w)
    run.drift = max(run.drift, drift)


@in_place
def _driven_fill(plant: Record, run: Record, pair: int) -> float:
    return float(plant.total - run.fill[pair] if run.side[pair] else run.fill[pair])


@in_place
def _keeps_residual(loop: Record, plant: Record, run: Record, motions: Record, w: FloatArray) -> bool:
    """True if each driven chamber keeps its residual fill, the tail of its injection included."""
    spare, keeps = loop.chambers // 2 * 2, True
    for i in range(loop.chambers // 2):
        if run.drives[i] > 0.0:
            motions[spare] = motions[i]
            run.lowest[i] = least_later(plant, motions, spare, w)
            keeps = keeps and run.lowest[i] >= run.residual_fill
    return keeps


@in_place
def _gas_in_port(loop: Record, run: Record, pair: int, time: float) -> None:
    """Set the time for which a pair's gas drives liquid, s; then gas enters the driven chamber's port."""
    run.shortened += 1
    run.refused[pair + loop.chambers // 2 * run.side[pair]] = 1
    run.drives[pair] = time


@in_place
def _pass(
    loop: Record, plant: Record, run: Record, motions: Record, notes: FloatArray, w: FloatArray
) -> float:
    """Integrate all pairs over the valve-open times and the wait, with fills at the instants in `notes`.

    Returns: largest fill of any pair and interval that ran back with the gas off.
    """
    half, on, drift = loop.chambers // 2, 0.0, 0.0
    for i in range(half):
        on = max(on, run.asked[i])
    off = max(min(loop.period, time_left(loop, run) - on), 0.0)
    run.on, run.off, run.off_points = on, off, TAIL_POINTS if off > 0.0 else 0
    run.on_points = _gas_instants(loop, run, notes) if on > 0.0 else 0
    for k in range(run.off_points):
        notes[1, 0, k] = off * (k + 1) / TAIL_POINTS
    for i in range(half):
        motion, ran_back = motions[i], 0.0
        if run.drives[i] > 0.0:
            command(plant, motion, run.side[i], run.drives[i])
        if on > 0.0:
            motion.steps, motion.ran_back = 0, 0.0
            advance(plant, motion, on, notes[0], i + 1, run.on_points, w)
            ran_back = motion.ran_back
        if off > 0.0:
            motion.steps, motion.ran_back = 0, 0.0
            advance(plant, motion, off, notes[1], i + 1, run.off_points, w)
        drift = max(drift, ran_back, motion.ran_back)
    return float(drift)


@in_place
def _gas_instants(loop: Record, run: Record, notes: FloatArray) -> int:
    """Equally spaced instants of the valve-open time and the closing of each valve, ascending."""
    count = GAS_POINTS
    for k in range(count):
        notes[0, 0, k] = run.on * (k + 1) / GAS_POINTS
    for i in range(loop.chambers // 2):
        if 0.0 < run.drives[i] < run.on:
            k = count
            while k > 0 and notes[0, 0, k - 1] > run.drives[i]:
                notes[0, 0, k] = notes[0, 0, k - 1]
                k -= 1
            notes[0, 0, k] = run.drives[i]
            count += 1
    return count


@in_place
def note_stretch(
    loop: Record,
    plant: Record,
    run: Record,
    notes: FloatArray,
    count: int,
    start: float,
    instants: FloatArray,
) -> None:
    """Record the trace of an interval from `start` on, and since when the amplitude is within the limit."""
    lowest, largest = plant.lowest_fill, plant.total - plant.lowest_fill
    for k in range(count):
        for i in range(loop.chambers // 2):
            run.fill[i] = min(max(notes[i + 1, k], lowest), largest)
        time = start + notes[0, k]
        above = abs(vibration(loop, plant, run)) > loop.limit
        run.since = math.inf if above else min(run.since, time)
        keep_instant(loop, run, instants, time)


@in_place
def look(loop: Record, plant: Record, run: Record, motions: Record) -> None:
    """Record the disc at the next sample, and if liquid still runs back that would lead above the limit."""
    half, back = loop.chambers // 2, False
    for i in range(half):
        motion = motions[i]
        moves = motion.primed > 0 or motion.direction != 0 or (run.floods > 0 and plant.inertia == 0)
        run.runs_back[i] = 1 if moves and motion.ran_back > NOTICEABLE_CHANGE else 0
        run.fill[i] = plant.total / 2.0 if run.runs_back[i] > 0 else shown(plant, motion, motion.state[X])
        back = back or run.runs_back[i] > 0
    run.drains = 1 if back and abs(vibration(loop, plant, run)) > loop.limit else 0
    for i in range(half):
        run.fill[i] = shown(plant, motions[i], motions[i].state[X])
    run.vibration = vibration(loop, plant, run)
    run.amplitude = abs(run.vibration)


@in_place
def keep_instant(loop: Record, run: Record, instants: FloatArray, time: float) -> None:
    """Add a row to the trace, one for each time: a valve may open for less than the clock resolves."""
    if run.instants < instants.shape[0] and (time > run.noted or run.samples == 0):
        instants[run.instants, 0] = time
        for i in range(loop.chambers // 2):
            instants[run.instants, 1 + i] = run.fill[i]
        run.instants, run.noted = run.instants + 1, time


@in_place
def keep_injections(
    loop: Record, plant: Record, run: Record, motions: Record, start: float, injections: Record
) -> bool:
    """Add the last command to the trace. Returns: true if its longest injection has moved liquid."""
    half, longest, working = loop.chambers // 2, 0.0, False
    for chamber in range(loop.chambers):
        pair = chamber % half
        if run.asked[pair] == 0.0 or run.side[pair] != chamber // half:
            continue
        motion, fill = motions[pair], _driven_fill(plant, run, pair)
        if run.drives[pair] == 0.0:
            forget(motion, fill)
        run.least_driven = min(run.least_driven, motion.fill_before)
        moved = abs(fill - motion.fill_before) > NOTICEABLE_CHANGE
        filled = (1.0 - fill) * plant.chamber_volume + plant.dead_volume
        leaked = plant.leak_to_ambient * run.asked[pair]
        leaked *= motion.closing_pressure + plant.ambient_pressure
        run.gas += motion.closing_pressure * filled
        run.gas, run.leaked = run.gas + leaked, run.leaked + leaked
        # Shorter injections do not count: noise keeps opening the other valve a little.
        if run.asked[pair] > longest:
            longest, working = run.asked[pair], moved
        if run.injections < injections.size:
            row = injections[run.injections]
            row.time, row.chamber, row.duration = start, chamber, run.asked[pair]
            row.fill_before, row.fill_after = motion.fill_before, fill
            row.regime_start, row.regime_end = motion.regime_start, motion.regime_end
            row.event, row.energy = motion.event, motion.state[WORK + motion.chamber]
            row.closing_pressure, row.run_dry = motion.closing_pressure, motion.run_dry
            run.injections += 1
    return working
