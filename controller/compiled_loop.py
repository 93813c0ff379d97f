"""The closed loop in plain numbers: sample, command, gas on, gas off, wait, sample again.

One source for one run and for a thousand: runs are continued sample by sample, so that between two samples
Python can look at a run, note its trace, or be its sensor and its algorithm.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy.typing as npt

from ringbalance.controller.algorithms.law_based import law_based_step
from ringbalance.controller.algorithms.target_vector import target_vector_step
from ringbalance.controller.algorithms.trial import trial_step
from ringbalance.controller.formulas import (
    NONE,
    NOTICEABLE,
    SAMPLES,
    has_held,
    has_risen,
    has_turned,
    stop_cause,
)
from ringbalance.controller.liquid_ring.reach import NEAR_RESIDUAL
from ringbalance.controller.loop_records import (
    GAS_POINTS,
    LAW_BASED,
    NO_PHASE,
    OWN,
    TAIL_POINTS,
    TARGET_VECTOR,
    TOO_SHORT,
    TRIAL,
    UNUSABLE,
    USABLE,
    Record,
)
from ringbalance.controller.moment_table import pair_moment
from ringbalance.reduced_model.injection.events import command, rests, would_start
from ringbalance.reduced_model.injection.gas import gas_volume
from ringbalance.reduced_model.injection.lift import shown
from ringbalance.reduced_model.injection.march import advance, least_later, opening_within
from ringbalance.reduced_model.injection.records import WORK, P, X
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compilation.compiled import in_place

_has_held: Final = in_place(has_held)
_has_risen: Final = in_place(has_risen)
_has_turned: Final = in_place(has_turned)
_stop_cause: Final = in_place(stop_cause)


@in_place
def continue_runs(
    loop: Record,
    plant: Record,
    assumed: Record,
    runs: Record,
    motions: Record,
    liquid: Record,
    noise: npt.NDArray[Any],
    instants: FloatArray,
    injections: Record,
    samples: Record,
    notes: FloatArray,
    w: FloatArray,
) -> None:
    """Continue each run by as many samples as there is noise for, unless it ends.

    Args:
        loop: of type `LOOP`. plant: of type `PLANT`; it is given each run's gas line. assumed: the same as
            the law-based algorithm has it.
        runs: of type `RUN`, shape (n,), changed.
        motions, liquid: of type `MOTION`, shape (n, pairs), (n, pairs or 0): the pairs as they are and, with
            one more, as the law-based algorithm believes them to be.
        noise: of amplitude and phase in standard deviations, shape (n, samples, 2); without samples runs
            begin.
        instants, injections, samples: rows of the first run's trace (time and every pair's fill; `INJECTION`;
            `SAMPLE`); none are kept where they have no rows.
        notes: shape (2, 1 + pairs, points), room for the instants of a gas time and of a wait.
        w: a workspace.
    """
    for i in range(runs.size):
        run = runs[i]
        plant.passing, plant.critical_ratio = run.gas_line[0], run.gas_line[1]
        plant.dead_volume, plant.valve_lag = run.gas_line[2], run.gas_line[3]
        if noise.shape[1] == 0:
            _begin(loop, plant, run, motions[i], instants)
        for k in range(noise.shape[1]):
            if run.cause == NONE and run.samples >= loop.most_samples:
                run.cause = SAMPLES
            if run.cause != NONE:
                break
            run.samples += 1
            if loop.sensed == 0:
                _sense(loop, run, noise[i, k, 0], noise[i, k, 1])
            if loop.algorithm != OWN:
                _decide(loop, assumed, run, liquid[i], notes[0], w)
            _watch(loop, run)
            run.cause = _cause(loop, plant, run, motions[i])
            _keep_sample(loop, run, samples)
            if run.cause == NONE:
                _act(loop, plant, run, motions[i], instants, injections, notes, w)


@in_place
def _begin(loop: Record, plant: Record, run: Record, motions: Record, instants: FloatArray) -> None:
    """Level chambers, vented, no tube full."""
    half, ambient, fill = loop.chambers // 2, plant.ambient_pressure, loop.initial_fill
    for i in range(motions.size):
        motion = motions[i]
        y = motion.state
        y[X], y[P], y[P + 1] = fill, ambient, ambient
        y[P + 2] = ambient * gas_volume(plant, fill) / plant.temperature
        y[P + 3] = ambient * gas_volume(plant, plant.total - fill) / plant.temperature
        motion.opens, motion.closes, motion.log_speed = math.inf, math.inf, math.log(run.speed)
        motion.length, motion.started, motion.residual = plant.first_step, fill, run.residual_fill
        motion.fill_before, motion.least_fill = fill, fill
    for i in range(half):
        run.fill[i] = fill
    lowest = max(0.0, plant.total - plant.max_fill_ratio)
    run.floods = 1 if would_start(plant, (lowest, 0.0, ambient, ambient), False) != 0 else 0
    run.vibration = _vibration(loop, run)
    run.amplitude = abs(run.vibration)
    run.initial_amplitude, run.first_seen, run.last_seen = run.amplitude, math.nan, math.nan
    run.last_phase, run.held_since = math.nan, math.inf
    run.since = 0.0 if run.amplitude <= loop.limit else math.inf
    _keep_instant(loop, run, instants, 0.0)


@in_place
def _vibration(loop: Record, run: Record) -> complex:
    """With the disc's liquid, m."""
    moment = 0j
    for i in range(loop.chambers // 2):
        moment += loop.axis[i] * pair_moment(loop.moment, loop.lowest, loop.moment_step, run.fill[i])
    return complex(loop.start + run.gain * moment)


@in_place
def _sense(loop: Record, run: Record, amplitude_noise: float, phase_noise: float) -> None:
    """What a sensor shows; an amplitude that noise would make negative is folded back."""
    run.seen_amplitude = abs(run.amplitude + loop.amplitude_noise * amplitude_noise)
    run.seen_phase = math.atan2(run.vibration.imag, run.vibration.real) + loop.phase_noise * phase_noise
    run.usable = USABLE


@in_place
def _decide(
    loop: Record, assumed: Record, run: Record, liquid: Record, notes: FloatArray, w: FloatArray
) -> None:
    """One step of the algorithm on what the sensor shows."""
    half, opened = loop.chambers // 2, False
    for i in range(half):
        run.asked[i] = 0.0
    run.resting, run.reason = 0, 0
    if run.usable < (NO_PHASE if loop.algorithm == TRIAL else USABLE):
        run.reason = UNUSABLE
        return
    if loop.algorithm == TARGET_VECTOR:
        target_vector_step(loop, run)
    elif loop.algorithm == TRIAL:
        trial_step(loop, run)
    elif loop.algorithm == LAW_BASED:
        law_based_step(loop, assumed, run, liquid, notes, w)
    for i in range(half):
        opened = opened or run.asked[i] > 0.0
    run.reason = 0 if opened or run.resting > 0 else TOO_SHORT


@in_place
def _watch(loop: Record, run: Record) -> None:
    """Count overshoots, rises in a row and misadjustments; a sample that shows nothing is passed over."""
    if run.usable >= NO_PHASE:
        if run.samples == 1:
            run.first_seen = run.seen_amplitude
        if run.operated > 0 and not math.isnan(run.last_seen):
            higher = _has_risen(run.last_seen, run.seen_amplitude, loop.noise_floor)
            run.rises = run.rises + 1 if higher else 0
            run.misadjustments += 1 if higher else 0
        run.last_seen, run.operated = run.seen_amplitude, 0
    if run.usable == USABLE:
        if run.seen_amplitude > loop.limit and not math.isnan(run.last_phase):
            run.overshoots += 1 if _has_turned(run.last_phase, run.seen_phase) else 0
        run.last_phase = run.seen_phase


@in_place
def _cause(loop: Record, plant: Record, run: Record, motions: Record) -> int:
    """Why the loop stops cycling, if it does."""
    held = run.cut == 0 and _has_held(run.time, run.since, loop.hold_time) and run.drains == 0
    if held and run.held_since == math.inf:
        run.held_since = run.since
    ends = run.cut == 0 and loop.to_time_limit == 0 and run.resting > 0 and loop.exact > 0
    return int(
        _stop_cause(
            held and run.stays > 0 and loop.to_time_limit == 0,
            run.rises,
            loop.rises_tolerated,
            _has_risen(run.first_seen, run.last_seen, loop.noise_floor),
            run.idle,
            loop.idle_tolerated,
            ends and _rests(loop, plant, run, motions),
            loop.time_limit - run.time,
        )
    )


@in_place
def _rests(loop: Record, plant: Record, run: Record, motions: Record) -> bool:
    """Whether no liquid can move until a valve is commanded to open."""
    found = run.floods == 0
    for i in range(loop.chambers // 2):
        found = found and rests(plant, motions[i])
    return bool(found)


@in_place
def _act(
    loop: Record,
    plant: Record,
    run: Record,
    motions: Record,
    instants: FloatArray,
    injections: Record,
    notes: FloatArray,
    w: FloatArray,
) -> None:
    """All valves of the command open together; after the last one has closed the loop waits."""
    commanded, before, start = _limit_to_time(loop, run), run.vibration, run.time
    left = commanded
    if commanded > 0 or not _rests(loop, plant, run, motions):
        left = _move(loop, plant, run, motions, commanded, notes, w)
        _note_stretch(loop, run, notes[0], run.on_points, start, instants)
        _note_stretch(loop, run, notes[1], run.off_points, start + run.on, instants)
        _look(loop, plant, run, motions)
    else:
        run.on, run.off = 0.0, min(loop.period, loop.time_limit - start)
        for k in range(1, TAIL_POINTS + 1):
            _keep_instant(loop, run, instants, start + run.off * k / TAIL_POINTS)
    run.time = start + run.on + run.off
    run.cut = 1 if run.off < loop.period else run.cut
    if left > 0:
        run.operated = 1
        moved = _keep_injections(loop, run, motions, start, injections)
        run.idle = 0 if moved or abs(run.vibration - before) > loop.limit else run.idle + 1
    elif commanded > 0:
        run.idle += 1


@in_place
def _limit_to_time(loop: Record, run: Record) -> int:
    """Cut what is asked to the time left. Returns: the number of valves."""
    half, left, count = loop.chambers // 2, loop.time_limit - run.time, 0
    for i in range(half):
        if run.asked[i] > 0.0:
            if count == 0:
                for chamber in range(loop.chambers):
                    run.refused[chamber] = 0
            count += 1
            run.at_residual[i], run.at_residual[i + half] = 0, 0
            run.cut = 1 if run.asked[i] > left else run.cut
            run.asked[i] = min(run.asked[i], left)
    return count


@in_place
def _move(
    loop: Record,
    plant: Record,
    run: Record,
    motions: Record,
    commanded: int,
    notes: FloatArray,
    w: FloatArray,
) -> int:
    """Let time pass to the next sample, with valve-open times that leave each chamber its residual fill.

    The motion is tried as commanded, and made again where that falls short.
    Returns: the number of valves that opened.
    """
    half = loop.chambers // 2
    guarded = commanded > 0 and run.residual_fill > 0.0
    if guarded:
        for i in range(half):
            motions[half + i] = motions[i]
        if not _above_residual(loop, run):
            guarded = _shorten(loop, plant, run, motions, w)
    drift = _pass(loop, plant, run, motions, notes, w)
    if guarded and not _keeps_residual(loop, plant, run, motions, w):
        for i in range(half):
            motions[i] = motions[half + i]
        _shorten(loop, plant, run, motions, w)
        drift = _pass(loop, plant, run, motions, notes, w)
    run.drift = max(run.drift, drift)
    count = 0
    for i in range(half):
        count += 1 if run.asked[i] > 0.0 else 0
    return count


@in_place
def _above_residual(loop: Record, run: Record) -> bool:
    """Whether every driven chamber is above its residual fill."""
    found = True
    for i in range(loop.chambers // 2):
        found = found and (
            run.asked[i] == 0.0 or _driven_fill(loop, run, i) > run.residual_fill + NEAR_RESIDUAL
        )
    return found


@in_place
def _driven_fill(loop: Record, run: Record, pair: int) -> float:
    return float(loop.total - run.fill[pair] if run.side[pair] else run.fill[pair])


@in_place
def _keeps_residual(loop: Record, plant: Record, run: Record, motions: Record, w: FloatArray) -> bool:
    """Whether each driven chamber has kept its residual fill and will, with the tail of its injection."""
    spare, found = loop.chambers // 2 * 2, True
    for i in range(loop.chambers // 2):
        if run.asked[i] > 0.0 and found:
            motions[spare] = motions[i]
            found = least_later(plant, motions, spare, w) >= run.residual_fill
    return found


@in_place
def _shorten(loop: Record, plant: Record, run: Record, motions: Record, w: FloatArray) -> bool:
    """Shorten the valve-open times to what leaves the residual fill; those below the minimum are left out.

    Returns: False, for there is nothing left to guard.
    """
    half = loop.chambers // 2
    for i in range(half):
        if run.asked[i] > 0.0:
            asked, time = run.asked[i], 0.0
            if _driven_fill(loop, run, i) > run.residual_fill + NEAR_RESIDUAL:
                time = opening_within(plant, motions, i, 2 * half, run.side[i], asked, w)
            if time != asked:
                chamber = i + half * run.side[i]
                run.shortened += 1
                run.at_residual[chamber], run.refused[chamber] = 1, 1
                run.asked[i] = time if time >= loop.shortest[chamber] else 0.0
    return False


@in_place
def _pass(
    loop: Record, plant: Record, run: Record, motions: Record, notes: FloatArray, w: FloatArray
) -> float:
    """Carry all pairs through the valve-open times and the wait, with their fills at the instants in `notes`.

    Returns: how far liquid ran back with the gas off, the most of any pair and stretch.
    """
    half, on, drift = loop.chambers // 2, 0.0, 0.0
    for i in range(half):
        on = max(on, run.asked[i])
    off = max(min(loop.period, loop.time_limit - (run.time + on)), 0.0)
    run.on, run.off, run.off_points = on, off, TAIL_POINTS if off > 0.0 else 0
    run.on_points = _gas_instants(loop, run, notes) if on > 0.0 else 0
    for k in range(run.off_points):
        notes[1, 0, k] = off * (k + 1) / TAIL_POINTS
    for i in range(half):
        motion, ran_back = motions[i], 0.0
        if run.asked[i] > 0.0:
            command(plant, motion, run.side[i], run.asked[i])
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
        if 0.0 < run.asked[i] < run.on:
            place = count
            while place > 0 and notes[0, 0, place - 1] > run.asked[i]:
                notes[0, 0, place] = notes[0, 0, place - 1]
                place -= 1
            notes[0, 0, place] = run.asked[i]
            count += 1
    return count


@in_place
def _note_stretch(
    loop: Record, run: Record, notes: FloatArray, count: int, start: float, instants: FloatArray
) -> None:
    """Since when the amplitude is not above the limit, and the trace, from a stretch begun at `start`."""
    largest = loop.total - loop.lowest
    for k in range(count):
        for i in range(loop.chambers // 2):
            run.fill[i] = min(max(notes[i + 1, k], loop.lowest), largest)
        time = start + notes[0, k]
        above = abs(_vibration(loop, run)) > loop.limit
        run.since = math.inf if above else min(run.since, time)
        _keep_instant(loop, run, instants, time)


@in_place
def _look(loop: Record, plant: Record, run: Record, motions: Record) -> None:
    """The disc at the next sample, and whether liquid still runs back that would take it above the limit."""
    half, back = loop.chambers // 2, False
    for i in range(half):
        motion = motions[i]
        moves = motion.primed > 0 or motion.direction != 0 or (run.floods > 0 and plant.inertia == 0)
        run.runs_back[i] = 1 if moves and motion.ran_back > NOTICEABLE else 0
        run.fill[i] = loop.total / 2.0 if run.runs_back[i] > 0 else shown(plant, motion, motion.state[X])
        back = back or run.runs_back[i] > 0
    run.drains = 1 if back and abs(_vibration(loop, run)) > loop.limit else 0
    for i in range(half):
        run.fill[i] = shown(plant, motions[i], motions[i].state[X])
    run.vibration = _vibration(loop, run)
    run.amplitude = abs(run.vibration)


@in_place
def _keep_instant(loop: Record, run: Record, instants: FloatArray, time: float) -> None:
    """A valve may open for less than the clock resolves: the trace has one row for one time."""
    if run.instants < instants.shape[0] and (time > run.kept or run.samples == 0):
        instants[run.instants, 0] = time
        for i in range(loop.chambers // 2):
            instants[run.instants, 1 + i] = run.fill[i]
        run.instants, run.kept = run.instants + 1, time


@in_place
def _keep_sample(loop: Record, run: Record, samples: Record) -> None:
    place = run.samples - 1 - run.samples_before
    if place < samples.size:
        row = samples[place]
        row.time, row.resting, row.reason = run.time, run.resting, run.reason
        row.amplitude, row.phase = run.seen_amplitude, run.seen_phase
        for i in range(loop.chambers // 2):
            row.asked[i], row.side[i] = run.asked[i], run.side[i]


@in_place
def _keep_injections(loop: Record, run: Record, motions: Record, start: float, injections: Record) -> bool:
    """Rows of the last command. Returns: whether the injection that should do the work has moved liquid."""
    half, longest, working = loop.chambers // 2, 0.0, False
    for chamber in range(loop.chambers):
        pair = chamber % half
        if run.asked[pair] == 0.0 or run.side[pair] != chamber // half:
            continue
        motion, fill = motions[pair], _driven_fill(loop, run, pair)
        moved = abs(fill - motion.fill_before) > NOTICEABLE
        # Noise keeps opening the other valve a little.
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
