"""Whole closed-loop runs in plain numbers, member after member, each as `simulate` does one."""

from __future__ import annotations

import math
from typing import Any, Final

from ringbalance.controller.compilation.compiled import in_place
from ringbalance.controller.ensemble.compiled_disc import (
    any_wet,
    drains,
    reset,
    vibration,
)
from ringbalance.controller.ensemble.compiled_motion import begin, inject
from ringbalance.controller.ensemble.compiled_noise import noise_pair, uniform_radii
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.formulas import (
    AT_REST,
    HELD,
    NONE,
    NOTICEABLE,
    TIME,
    has_grown,
    has_held,
    has_risen,
    has_turned,
    stop_cause,
    valve_time,
    vector_gas_time,
    vector_shares,
)
from ringbalance.scene.arrays import FloatArray

_CERTAIN: Final = 1 + 1e-9
_vector_gas_time: Final = in_place(vector_gas_time)
_vector_shares: Final = in_place(vector_shares)
_valve_time: Final = in_place(valve_time)
_stop_cause: Final = in_place(stop_cause)
_has_grown: Final = in_place(has_grown)
_has_held: Final = in_place(has_held)
_has_risen: Final = in_place(has_risen)
_has_turned: Final = in_place(has_turned)


@in_place
def run_members(
    shared: Record, plant: Record, runs: Any, motions: Any, notes: FloatArray, workspace: FloatArray
) -> None:
    """Run members one after the other; `runs`, of type `RUN`, holds what differs and is filled.

    `plant`, of type `PLANT`, is given each member's gas line; `motions`, of type `MOTION`, has room for every
    pair twice and one more, and `notes` for the instants of an injection and its tail and for the fills of
    every pair then.
    """
    for i in range(runs.size):
        run = runs[i]
        _start(shared, plant, run, motions)
        while run.cause == NONE and run.samples < shared.most_samples:
            if run.calm:
                _pass_calm(shared, run)
            if run.cause == NONE and run.samples < shared.most_samples:
                run.samples += 1
                _sample(shared, run)
                if run.cause == NONE:
                    _inject(shared, plant, run, motions, notes, workspace)
        _judge(shared, run)


@in_place
def _pass_calm(shared: Record, run: Record) -> None:
    """Pass over samples that are below the limit however their noise turns out, while nothing moves.

    A normal pair of radius r moves the amplitude by sigma r at the most, whatever its angle, and r follows
    from one of two uniform numbers alone.
    """
    time, samples = run.time, run.samples
    even, odd = uniform_radii(shared, run.number, samples // 2)
    while samples < shared.most_samples and (odd if samples & 1 else even) >= run.certain:
        samples += 1
        if _holds(shared, run, time):
            run.cause = HELD
            break
        left = shared.time_limit - time
        if left <= 0.0:
            run.cause = TIME
            break
        run.cut = 1 if left < shared.period else run.cut
        time += min(shared.period, left)
        if samples & 1 == 0:
            even, odd = uniform_radii(shared, run.number, samples // 2)
    if samples > run.samples:
        # A sample in full would have left no memory and no valve.
        _forget(run)
        run.phase_before = run.phase
    run.time, run.samples = time, samples


@in_place
def _holds(shared: Record, run: Record, time: float) -> bool:
    """Whether the run has settled by a time, s, as `simulate` finds it."""
    held = run.stays and not run.cut and _has_held(time, run.since, shared.hold_time)
    return bool(held and not drains(shared, run))


@in_place
def _start(shared: Record, plant: Record, run: Record, motions: Any) -> None:
    """Level chambers, nothing remembered."""
    reset(shared, run)
    plant.passing, plant.critical_ratio = run.gas_line[0], run.gas_line[1]
    plant.dead_volume, plant.valve_lag = run.gas_line[2], run.gas_line[3]
    for i in range(shared.chambers // 2):
        begin(plant, motions[i], shared.initial_fill, run.speed, run.residual_fill)
    _forget(run)
    _look(shared, run)
    _expect(shared, run)
    run.start, run.phase_before = run.amplitude, run.phase
    run.since = 0.0 if run.amplitude <= shared.limit else math.inf


@in_place
def _look(shared: Record, run: Record) -> None:
    """True vibration."""
    run.real, run.imaginary = vibration(shared, run, False)
    run.amplitude, run.stale = math.hypot(run.real, run.imaginary), 1


@in_place
def _expect(shared: Record, run: Record) -> None:
    """The phase, and the uniform number from which on noise cannot lift the amplitude above the limit."""
    run.phase, run.stale = math.atan2(run.imaginary, run.real), 0
    room = shared.limit - run.amplitude
    if room < 0.0:
        run.certain = 2.0
    elif shared.amplitude_noise == 0.0:
        # Without any noise a resting run ends, which takes a sample in full.
        run.certain = 0.0 if shared.phase_noise > 0.0 else 2.0
    else:
        run.certain = math.exp(-((room / shared.amplitude_noise) ** 2) / 2.0) * _CERTAIN


@in_place
def _sample(shared: Record, run: Record) -> None:
    """One look at the vibration, with noise of its own."""
    now = noise_pair(shared, run.number, run.samples - 1)
    before = 0.0
    if run.samples > 1 and abs(run.amplitude + shared.amplitude_noise * now[0]) > shared.limit:
        if run.noise_sample == run.samples - 2:
            before = run.noise_before
        else:
            # The sample before was passed over: its noise is made now.
            before = noise_pair(shared, run.number, run.samples - 2)[1]
    run.noise_before, run.noise_sample = now[1], run.samples - 1
    _react(shared, run, now, before)


@in_place
def _react(shared: Record, run: Record, noise: tuple[float, float], noise_before: float) -> None:
    """What the sensor shows, one step of the controller, and whether the run ends here.

    `run.samples` counts this sample already; noise is of amplitude and phase, in standard deviations.
    """
    run.seen_amplitude = abs(run.amplitude + shared.amplitude_noise * noise[0])
    run.seen_phase = run.phase + shared.phase_noise * noise[1]
    _watch(shared, run, run.phase_before + shared.phase_noise * noise_before)
    _decide(shared, run)
    run.cause = _cause(shared, run)
    run.phase_before = run.phase


@in_place
def _watch(shared: Record, run: Record, seen_before: float) -> None:
    """Overshoots, rises and misadjustments, as `simulation` counts them."""
    if run.samples == 1:
        run.first_seen = run.seen_amplitude
    elif run.seen_amplitude > shared.limit:
        run.overshoots += 1 if _has_turned(seen_before, run.seen_phase) else 0
    if run.operated:
        higher = _has_risen(run.last_seen, run.seen_amplitude, shared.noise_floor)
        run.rises = run.rises + 1 if higher else 0
        run.misadjustments += 1 if higher else 0
    run.last_seen, run.operated = run.seen_amplitude, 0


@in_place
def _cause(shared: Record, run: Record) -> int:
    """Why the loop stops cycling, as `simulate` tells it."""
    exact = shared.amplitude_noise == 0.0 and shared.phase_noise == 0.0
    return int(
        _stop_cause(
            _holds(shared, run, run.time),
            run.rises,
            shared.rises_tolerated,
            _has_risen(run.first_seen, run.last_seen, shared.noise_floor),
            run.idle,
            shared.idle_tolerated,
            exact and run.seen_amplitude <= shared.limit and not (any_wet(shared, run) or run.cut),
            shared.time_limit - run.time,
        )
    )


@in_place
def _inject(
    shared: Record, plant: Record, run: Record, motions: Any, notes: FloatArray, workspace: FloatArray
) -> None:
    """From a command, if any, to the next sample."""
    half, commanded = shared.chambers // 2, run.pair >= 0
    for i in range(half):
        run.fill_before[i] = run.fill[i]
    run.real_before, run.imaginary_before = run.real, run.imaginary
    if commanded or any_wet(shared, run):
        inject(shared, plant, run, motions, notes, workspace)
    else:
        run.commanded, run.wait = 0.0, max(min(shared.period, shared.time_limit - run.time), 0.0)
    run.cut = 1 if run.wait < shared.period else run.cut
    run.time += run.commanded + run.wait
    if run.pair >= 0:
        run.operated = 1
        _count_idle(shared, run, _working(run))
    run.pair, run.other_pair = -1, -1
    _finish(shared, run)


@in_place
def _finish(shared: Record, run: Record) -> None:
    """Ready for the next sample."""
    if run.stale:
        _expect(shared, run)
    run.calm = 0 if run.operated or run.rises >= shared.rises_tolerated or any_wet(shared, run) else 1


@in_place
def _working(run: Record) -> int:
    """The pair that is given the most gas."""
    if run.other_pair >= 0 and run.other_duration > run.duration:
        return int(run.other_pair)
    return int(run.pair)


@in_place
def _count_idle(shared: Record, run: Record, working: int) -> None:
    """Whether the last command has moved anything."""
    change = math.hypot(run.real - run.real_before, run.imaginary - run.imaginary_before)
    moved = abs(run.fill[working] - run.fill_before[working]) > NOTICEABLE or change > shared.limit
    run.idle = 0 if moved else run.idle + 1


@in_place
def _judge(shared: Record, run: Record) -> None:
    """As `Facts.outcome` does."""
    settled = run.cause == HELD or (run.cause == AT_REST and run.since < math.inf)
    run.settled = 1 if settled else 0
    run.settling_time = run.since if settled else math.inf
    run.drifted = 1 if run.drift > NOTICEABLE and not run.settled else 0
    grown = _has_grown(run.cause, run.amplitude > run.start + shared.noise_floor)
    run.diverged = 1 if grown and not run.settled and not run.drifted else 0


@in_place
def _forget(run: Record) -> None:
    """As before the first sample, and at or below the limit: no memory, no valve. Args: `run`: changed."""
    run.integral, run.before_time, run.pair, run.other_pair = 0.0, math.inf, -1, -1


@in_place
def _decide(shared: Record, run: Record) -> None:
    """One step of the algorithm on what the sensor shows.

    Args: `shared`: of type `SHARED`. `run`: the member; its memory and its valves are changed.
    Source: as `TargetVector`.
    """
    if run.seen_amplitude <= shared.limit:
        _forget(run)
        return
    wanted, run.integral = _vector_gas_time(
        run.seen_amplitude,
        run.seen_phase,
        run.time,
        run.integral,
        run.before_amplitude,
        run.before_phase,
        run.before_time,
        run.proportional,
        shared.integral_time,
        shared.derivative_time,
        shared.maximum_gas_time,
        True,
    )
    run.before_amplitude, run.before_phase, run.before_time = run.seen_amplitude, run.seen_phase, run.time
    length = min(max(wanted, 0.0), shared.maximum_gas_time)
    first, share, second, other = _vector_shares(
        shared.chambers, run.seen_phase + shared.assumed_lag, length, run.at_residual
    )
    run.pair, run.other_pair = -1, -1
    _open(shared, run, first, share)
    _open(shared, run, second, other)


@in_place
def _open(shared: Record, run: Record, chamber: int, share: float) -> None:
    """Open the next valve, unless its share is below the minimum."""
    time = _valve_time(share, shared.offset[chamber], shared.minimum_gas_time, shared.maximum_gas_time)
    if time == 0.0:
        return
    half, left = shared.chambers // 2, shared.time_limit - run.time
    duration, run.cut = min(time, left), 1 if time > left else run.cut
    run.at_residual[chamber], run.at_residual[(chamber + half) % shared.chambers] = 0, 0
    if run.pair < 0:
        run.pair, run.first, run.duration = chamber % half, int(chamber < half), duration
    else:
        run.other_pair, run.other_first, run.other_duration = chamber % half, int(chamber < half), duration
