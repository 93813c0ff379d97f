"""The closed loop in plain numbers: sample, command, gas on, gas off, wait, sample again.

One source serves a single run and a thousand: runs are continued up to a sample, so that between two samples
Python code can act as a run's sensor and algorithm.
"""

from __future__ import annotations

import math

from ringbalance.controller.algorithms.built_in import target_vector_step, trial_step
from ringbalance.controller.algorithms.law_based import law_based_step
from ringbalance.controller.liquid_ring.plant import NEAR_RESIDUAL
from ringbalance.controller.loop_records import (
    AT_REST,
    GAS_POINTS,
    HELD,
    IDLE,
    NO_PHASE,
    NONE,
    NOTICEABLE_CHANGE,
    OWN,
    RISING,
    SAMPLES,
    TAIL_POINTS,
    TARGET_VECTOR,
    TIME,
    TOO_SHORT,
    TRIAL,
    UNUSABLE,
    USABLE,
)
from ringbalance.reduced_model.injection.column import gas_volume
from ringbalance.reduced_model.injection.dynamics import WORK, P, X
from ringbalance.reduced_model.injection.events import command, forget, rests, would_start
from ringbalance.reduced_model.injection.lift import shown
from ringbalance.reduced_model.injection.march import advance, least_later, opening_within
from ringbalance.reduced_model.injection.moment import pair_moment
from ringbalance.scene.arrays import FloatArray, Record
from ringbalance.scene.platform.compiled import in_place


@in_place
def continue_runs(
    loops: Record,
    plants: Record,
    assumed: Record,
    runs: Record,
    motions: Record,
    liquid: Record,
    noise: FloatArray,
    until: int,
    instants: FloatArray,
    injections: Record,
    samples: Record,
    notes: FloatArray,
    w: FloatArray,
) -> None:
    """Continue each run up to some samples, unless it ends.

    Args:
        loops: one for each of some settings, type `LOOP`. plants: one for each device, type `PLANT`.
        assumed: the device that the law-based algorithm assumes; not read by the others.
        runs: of type `RUN`, shape (n,), changed; each names its settings and its device.
        motions, liquid: of type `MOTION`, shape (n, pairs), (n, pairs or 0): the true pairs and, both with
            spare ones, the pairs as the law-based algorithm estimates them.
        noise: of every device, amplitude and phase in standard deviations, shape (devices, samples, 2).
        until: number of samples; with 0 the runs are started.
        instants, injections, samples: rows of the trace of a single run (time and every pair's fill;
            `INJECTION`; `SAMPLE`); an array without rows keeps none.
        notes: shape (2, 1 + pairs, points), room for the instants of a valve-open time and of a wait.
        w: a workspace.
    """
    for i in range(runs.size):
        run = runs[i]
        loop, plant = loops[run.loop], plants[run.plant]
        if until == 0:
            _begin(loop, plant, run, motions[i], instants)
        while run.cause == NONE and run.samples < until:
            if loop.sensed == 0:
                # A noisy sample; an amplitude that noise would make negative is folded back.
                deviates = noise[run.plant, run.samples]
                run.seen_amplitude = abs(run.amplitude + loop.amplitude_noise * deviates[0])
                direction = math.atan2(run.vibration.imag, run.vibration.real)
                run.seen_phase = direction + loop.phase_noise * deviates[1]
                run.usable = USABLE
            run.samples += 1
            if loop.algorithm != OWN:
                decide(loop, assumed, run, liquid[i], notes[0], w)
            # Overshoots, rises in a row and misadjustments; a sample without an amplitude is skipped.
            if run.usable >= NO_PHASE:
                if run.samples == 1:
                    run.first_seen = run.seen_amplitude
                if run.operated > 0 and not math.isnan(run.last_seen):
                    higher = run.seen_amplitude - run.last_seen > run.noise_floor
                    run.rises = run.rises + 1 if higher else 0
                    run.misadjustments += 1 if higher else 0
                run.last_seen, run.operated = run.seen_amplitude, 0
            if run.usable == USABLE:
                if run.seen_amplitude > loop.limit and not math.isnan(run.last_phase):
                    run.overshoots += 1 if math.cos(run.seen_phase - run.last_phase) < 0.0 else 0
                run.last_phase = run.seen_phase
            run.cause = _cause(loop, plant, run, motions[i])
            if run.samples <= samples.size:
                row = samples[run.samples - 1]
                row.time, row.resting, row.reason = run.time, run.resting, run.reason
                row.amplitude, row.phase = run.seen_amplitude, run.seen_phase
                for pair in range(loop.chambers // 2):
                    row.asked[pair], row.side[pair] = run.asked[pair], run.side[pair]
            if run.cause == NONE:
                _act(loop, plant, run, motions[i], instants, injections, notes, w)
                run.cause = SAMPLES if run.samples >= loop.most_samples else NONE


@in_place
def _begin(loop: Record, plant: Record, run: Record, motions: Record, instants: FloatArray) -> None:
    """Start a run with level, vented chambers and no tube full."""
    half, ambient, fill = loop.chambers // 2, plant.ambient_pressure, plant.total / 2.0
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
    run.vibration = vibration(loop, plant, run)
    run.amplitude = abs(run.vibration)
    run.initial_amplitude, run.first_seen, run.last_seen = run.amplitude, math.nan, math.nan
    run.last_phase, run.held_since, run.held = math.nan, math.inf, math.inf
    run.least_driven = math.inf
    run.since = 0.0 if run.amplitude <= loop.limit else math.inf
    keep_instant(loop, run, instants, 0.0)


@in_place
def decide(
    loop: Record, assumed: Record, run: Record, liquid: Record, notes: FloatArray, w: FloatArray
) -> None:
    """One step of the algorithm on a sample."""
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
    else:
        law_based_step(loop, assumed, run, liquid, notes, w)
    for i in range(half):
        opened = opened or run.asked[i] > 0.0
    run.reason = 0 if opened or run.resting > 0 else TOO_SHORT


@in_place
def _cause(loop: Record, plant: Record, run: Record, motions: Record) -> int:
    """Cause for which the loop stops cycling, `NONE` where it continues."""
    _hold(loop, run)
    if run.settled > 0 and loop.to_time_limit == 0:
        return HELD
    above_first = run.last_seen - run.first_seen > run.noise_floor
    if run.rises > loop.rises_tolerated or (run.rises == loop.rises_tolerated and above_first):
        return RISING
    ends = run.cut == 0 and loop.to_time_limit == 0 and run.resting > 0 and loop.exact > 0
    if ends and _rests(loop, plant, run, motions):
        return AT_REST
    if time_left(loop, run) > 0.0:
        return NONE
    return IDLE if run.idle >= loop.idle_tolerated else TIME


@in_place
def _hold(loop: Record, run: Record) -> None:
    """Record if the run has settled: within the limit for the hold time, and then, but for a few samples, for
    the watch time.

    A lost hold is discarded, and the next one is awaited.
    """
    if run.settled > 0:
        return
    if run.held_since == math.inf:
        held = run.time - run.since >= loop.hold_time * (1.0 - 1e-9) and run.cut == 0 and run.drains == 0
        if held and run.since <= loop.time_limit:
            run.held_since, run.held, run.above = run.since, run.time, 0.0
    elif run.amplitude > loop.limit:
        run.above += 1.0
        if run.above > loop.allowed:
            run.held_since, run.held = math.inf, math.inf
            run.lost += 1
    run.settled = 1 if run.time >= run.held + loop.watch_time * (1.0 - 1e-9) else 0


@in_place
def _rests(loop: Record, plant: Record, run: Record, motions: Record) -> bool:
    """True if no liquid can move until a valve is commanded to open."""
    at_rest = run.floods == 0
    for i in range(loop.chambers // 2):
        at_rest = at_rest and rests(plant, motions[i])
    return bool(at_rest)


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
    """Open all valves of the command together, and wait after the last one has closed."""
    commanded, before, start = limit_to_time(loop, run), run.vibration, run.time
    if commanded > 0 or not _rests(loop, plant, run, motions):
        move(loop, plant, run, motions, commanded, notes, w)
        note_stretch(loop, plant, run, notes[0], run.on_points, start, instants)
        note_stretch(loop, plant, run, notes[1], run.off_points, start + run.on, instants)
        look(loop, plant, run, motions)
    else:
        run.on, run.off = 0.0, max(min(loop.period, time_left(loop, run)), 0.0)
        for k in range(1, TAIL_POINTS + 1):
            keep_instant(loop, run, instants, start + run.off * k / TAIL_POINTS)
    run.time = start + run.on + run.off
    run.cut = 1 if run.off < loop.period else run.cut
    if commanded > 0:
        run.operated = 1
        moved = keep_injections(loop, plant, run, motions, start, injections)
        run.idle = 0 if moved or abs(run.vibration - before) > loop.limit else run.idle + 1


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
