"""A pair of chambers through time: fill, velocity and gas as one system, with its events, in plain numbers.

The liquid either rests or moves in one direction. A step ends when the column comes to rest, begins to move
or separates at rest, when a chamber is empty or full, when its level leaves the port, or when a valve moves.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.reduced_model.injection.column import end_pressure, near_end, open_to_gas
from ringbalance.reduced_model.injection.dynamics import EVENTS, Event, P, Record, U, X
from ringbalance.reduced_model.injection.events import (
    EMPTY,
    FULL,
    NONE,
    RESTING,
    STALLED,
    Four,
    beyond,
    changes,
    command,
    flow_end,
    heading,
    holds_column,
    limit_in_the_way,
    now,
    outward,
    pair_ends,
    pass_crest,
    regime,
    separates,
    starts,
    would_start,
)
from ringbalance.reduced_model.injection.lift import arrived, front, set_out, shown
from ringbalance.reduced_model.injection.step import (
    BETWEEN,
    END,
    between,
    in_closed_form,
    rates_at_end,
    shorten,
    take,
)
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.platform.compiled import in_place, inlined

_ROUND_OFF_S: Final = 1e-12
"""Round-off of the clock of a valve, s."""
_BISECTIONS: Final = 40
_SECANTS: Final = 12
"""Largest number of bisections that a secant guides: a smooth event takes five."""
_REST_EVENT: Final = 1e-11
"""Allowed error of an event's instant over the length of a step at rest, which may be long."""
_NOTHING_MOVED: Final = 1e-13
"""Moved fill ratio below which a start counts as round-off."""
_LITTLE_MOVED: Final = 1e-9
"""Moved fill ratio below which a flow counts as the last swing of a column about its balance."""
_OPENINGS: Final = 42
"""Largest number of valve-open times tried to leave a chamber its residual fill."""
_HALVINGS: Final = 60
"""Largest number of valve-open times tried to bring a chamber to a fill."""
_BEFORE: Final = 1.0 - 1e-9
"""Part of the time to the end of a step that lies within that step."""
_CLOCK: Final = 4e-16
"""Round-off of a valve-open time, relative."""
SPARE: Final = 3
"""Number of motions needed for these trials."""
_LEFT_OVER: Final = 1e-4
"""Fill ratio that may be left above the residual one, over the error allowed to a step."""
_UNFINISHED: Final = EVENTS.index(Event.UNFINISHED)


@in_place
def advance(
    plant: Record, motion: Record, duration: float, notes: FloatArray, row: int, count: int, w: FloatArray
) -> None:
    """Advance a pair by a time, s, with all movements of the valves in it.

    The first `count` places of row 0 of `notes` are ascending instants, s from now; the fills at them are
    written to `row`.
    """
    left, motion.now, motion.noted = duration, 0.0, 0
    # A movement due at the end counts, despite round-off of the clock.
    while min(motion.opens, motion.closes) <= left + _ROUND_OFF_S:
        until = min(motion.opens, motion.closes, left)
        _march(plant, motion, until, notes, row, count, w, True)
        left -= until
        _flip(plant, motion)
    _march(plant, motion, left, notes, row, count, w, True)
    _settle(plant, motion)
    _note_regime(plant, motion)
    _pause(plant, motion)
    for k in range(motion.noted, count):
        notes[row, k] = shown(plant, motion, motion.state[X])


@in_place
def inject_each(
    plant: Record,
    motions: Record,
    follows: IntArray,
    chambers: IntArray,
    gas: FloatArray,
    times: FloatArray,
    rest: float,
    fills: FloatArray,
    w: FloatArray,
) -> None:
    """Inject gas into a chamber of a pair at rest, several times, each from its own fill or an earlier end.

    Args: `motions`: a pair at rest, and a second record that is written to. `follows`: injection at whose end
        each begins; its own number where it begins with the fill in row 0. `gas`: pressures as
        `gas_pressure`, `supply_pressure` and `ambient_pressure` of a plant, Pa, shape (3, n). `times`: from
        the command to open to the command to close, s. `rest`: time after the valve has closed, s. `fills`:
        x of chamber 0 before and after each, shape (2, n); is written.
    """
    motion, total = motions[1], plant.total
    for i in range(times.size):
        if follows[i] != i:
            fills[0, i] = fills[1, follows[i]]
        x = fills[0, i]
        motions[1] = motions[0]
        motion.state[X], motion.started, motion.least_fill = x, x, x
        plant.gas_pressure, plant.supply_pressure, ambient = gas[0, i], gas[1, i], gas[2, i]
        plant.ambient_pressure = ambient
        for chamber in range(2):
            motion.state[P + chamber] = ambient
            free = max(1.0 - (total - x if chamber else x), 1e-3) * plant.chamber_volume + plant.dead_volume
            motion.state[P + 2 + chamber] = ambient * free / plant.temperature
        command(plant, motion, chambers[i], times[i])
        advance(plant, motion, plant.valve_lag + times[i] + rest, w, 0, 0, w)
        fills[1, i] = motion.state[X]


@in_place
def _pause(plant: Record, motion: Record) -> None:
    """Drop the motion of liquid without inertia; the next step determines it from the state."""
    if motion.direction != 0 and not (plant.inertia or motion.lifting):
        motion.primed, motion.direction = 1 if holds_column(plant, motion, now(motion)) else 0, 0


@in_place
def opening_within(
    plant: Record,
    motions: Record,
    pair: int,
    spare: int,
    chamber: int,
    duration: float,
    lowest: float,
    w: FloatArray,
) -> float:
    """Longest valve-open time, at most `duration`, that leaves the driven chamber its residual fill, s.

    The steps that a trial has in common with shorter ones are taken once.
    Args: `spare`: first of `SPARE` motions that are written to. `lowest`: lowest fill ratio of the driven
        chamber by the whole `duration` and its tail.
    Returns: zero where the chamber is already there.
    """
    y, residual, opened, way = motions[pair].state, motions[pair].residual, spare + 2, spare + 1
    low, high, near, stays = 0.0, duration, 1e-9 * duration, 0
    spared = _LEFT_OVER * plant.relative_error
    if lowest >= residual:
        return duration
    motions[opened] = motions[pair]
    _open(plant, motions[opened], chamber, w)
    motions[way] = motions[opened]
    _march(plant, motions[way], duration, w, 0, 0, w, False)
    passes = motions[way].least_fill < residual
    if passes:
        high = motions[way].now
    pace = abs(motions[way].state[U]) * plant.tube_area / plant.chamber_volume
    # How far the driven chamber falls below its residual fill, with either time.
    before = residual - (plant.total - y[X] if chamber else y[X])
    after = residual - (_least_after(plant, motions, spare, high, w) if passes else lowest)
    if after < pace * high:
        # Its tail is much the same for a somewhat shorter time.
        before = after - pace * high
    for step in range(_OPENINGS):
        middle = _illinois_step(low, high, before + spared / 2.0, after + spared / 2.0, step, near)
        motions[way] = motions[opened]
        short_of_residual = residual - _least_after(plant, motions, spare, middle, w)
        if short_of_residual > 0.0:
            high, after, before, stays = middle, short_of_residual, before * (0.5 if stays < 0 else 1.0), -1
        else:
            low, before, after, stays = middle, short_of_residual, after * (0.5 if stays > 0 else 1.0), 1
            motions[opened] = motions[way]
        if high - low <= near or -spared <= short_of_residual <= 0.0:
            break
    return low


@in_place
def opening_to(
    plant: Record,
    motions: Record,
    pair: int,
    spare: int,
    chamber: int,
    target: float,
    longest: float,
    allowed: float,
    w: FloatArray,
) -> float:
    """Valve-open time after which the driven chamber is at a fill, at most `longest`, s.

    The root is searched in the one step that passes it, by regula falsi with the weight of an end that stays
    halved (Illinois rule).
    Args: `spare`: first of `SPARE` motions that are written to; the last one then holds the pair at the end.
        `target`: below the present fill. `allowed`: error of the fill.
    Returns: infinity where the chamber does not come to that fill.
    """
    opened, way, end = spare, spare + 1, spare + 2
    motions[opened] = motions[pair]
    motions[opened].steps, motions[opened].residual = 0, target
    _open(plant, motions[opened], chamber, w)
    motions[way] = motions[opened]
    _march(plant, motions[way], longest, w, 0, 0, w, False)
    if motions[way].least_fill < target:
        motions[end] = motions[way]
        motions[way] = motions[opened]
        _march(plant, motions[way], motions[end].now * _BEFORE, w, 0, 0, w, False)
    else:
        motions[end] = motions[way]
        _march(plant, motions[end], longest - motions[way].now, w, 0, 0, w, True)
        _settle(plant, motions[end])
    low, high, stays = motions[way].now, motions[end].now, 0
    above = _driven_fill(plant, motions[way]) - target
    off = below = _driven_fill(plant, motions[end]) - target
    if off > 0.0:
        return math.inf
    time = high
    for _ in range(_HALVINGS):
        if abs(off) <= allowed or high - low <= _CLOCK * high:
            break
        time = low + (high - low) * (above / (above - below) if above > below else 0.5)
        motions[end] = motions[way]
        _march(plant, motions[end], time - motions[way].now, w, 0, 0, w, True)
        off = _driven_fill(plant, motions[end]) - target
        if off > 0.0:
            low, above, below, stays = time, off, below * (0.5 if stays > 0 else 1.0), 1
        else:
            high, below, above, stays = time, off, above * (0.5 if stays < 0 else 1.0), -1
    return float(time)


@inlined
def _driven_fill(plant: Record, motion: Record) -> float:
    x = shown(plant, motion, motion.state[X])
    return float(plant.total - x if motion.chamber else x)


@inlined
def _illinois_step(low: float, high: float, before: float, after: float, step: int, near: float) -> float:
    """Next guess of a root between two ends with values of opposite sign, exact to `near`.

    By the secant through both; by bisection without a sign change or after many steps. The caller halves the
    value of an end that stays (the Illinois rule).
    """
    guided = step < _SECANTS and before < 0.0 < after
    middle = low + (high - low) * (before / (before - after) if guided else 0.5)
    # At least half of `near` from either end, so that a root close to an end is soon bracketed.
    return float(min(max(middle, low + near / 2.0), high - near / 2.0))


@in_place
def _open(plant: Record, motion: Record, chamber: int, w: FloatArray) -> None:
    """Open a valve that does not close."""
    command(plant, motion, chamber, math.inf)
    advance(plant, motion, plant.valve_lag, w, 0, 0, w)
    motion.now = 0.0


@in_place
def _least_after(plant: Record, motions: Record, spare: int, duration: float, w: FloatArray) -> float:
    """Lowest fill of the driven chamber until an injection and its tail are over.

    `motions[spare + 1]` has its valve open, and advances by the steps that do not depend on the duration.
    """
    left = duration - motions[spare + 1].now
    _march(plant, motions[spare + 1], left, w, 0, 0, w, False)
    motions[spare] = motions[spare + 1]
    motion = motions[spare]
    motion.closes = duration - motion.now
    advance(plant, motion, motion.closes, w, 0, 0, w)
    return least_later(plant, motions, spare, w)


@in_place
def least_later(plant: Record, motions: Record, pair: int, w: FloatArray) -> float:
    """Lowest fill of the driven chamber once its column has stopped or runs back, while the gas vents."""
    motion = motions[pair]
    if motion.closes < math.inf:
        advance(plant, motion, motion.closes, w, 0, 0, w)
    for _ in range(100):
        if motion.direction != outward(motion):
            break
        advance(plant, motion, 0.1, w, 0, 0, w)
    return float(motion.least_fill)


@in_place
def _march(
    plant: Record,
    motion: Record,
    duration: float,
    notes: FloatArray,
    row: int,
    count: int,
    w: FloatArray,
    to_end: bool,
) -> None:
    """Take steps with their events, without movements of the valves.

    Args: `to_end`: true: the last step is shortened to the time left; false: it is not taken, and a chamber
        below its residual fill ends the steps too.
    """
    left, goes_on = duration, False
    while left > 0.0:
        if not goes_on:
            _settle(plant, motion)
        if motion.primed and motion.filled < 0.0:
            motion.filled = motion.now
        if motion.steps >= plant.most_steps:
            motion.event = _UNFINISHED
            _pass(plant, motion, left, notes, row, count)
            return
        if _quiet(plant, motion):
            _rest_gases(plant, motion)
            _pass(plant, motion, left, notes, row, count)
            return
        if not to_end and _goes_no_further(plant, motion, left):
            return
        h, goes_on = _step(plant, motion, left, notes, row, count, w)
        _pass(plant, motion, left if h >= left else h, notes, row, count)
        left = 0.0 if h >= left else left - h


@in_place
def _goes_no_further(plant: Record, motion: Record, left: float) -> bool:
    """True if the next step would be shortened, or the driven chamber is below its residual fill."""
    shortened = motion.length >= left and not in_closed_form(plant, motion)
    return bool(shortened or motion.least_fill < motion.residual)


@in_place
def _pass(plant: Record, motion: Record, time: float, notes: FloatArray, row: int, count: int) -> None:
    """Advance the clocks of valves and interval; instants not noted yet get the present fill."""
    motion.opens -= time
    motion.closes -= time
    motion.now += time
    while motion.noted < count and notes[0, motion.noted] < motion.now:
        notes[row, motion.noted] = shown(plant, motion, motion.state[X])
        motion.noted += 1


@in_place
def _at(w: FloatArray, row: int) -> Four:
    """State in a row of the workspace."""
    return w[row, X], w[row, U], w[row, P], w[row, P + 1]


@in_place
def _step(
    plant: Record, motion: Record, left: float, notes: FloatArray, row: int, count: int, w: FloatArray
) -> tuple[float, bool]:
    """One accepted step, cut at the first event within it.

    Returns: Its length, s, and true if liquid moves on, so that `_settle` is not needed.
    """
    h, moves = take(plant, motion, left, w), motion.direction != 0
    event = changes(plant, motion, _at(w, END))
    if event:
        h = _cut(plant, motion, h, w)
    if moves and motion.noted < count and notes[0, motion.noted] < motion.now + h:
        rates_at_end(plant, motion, w)
        while motion.noted < count and notes[0, motion.noted] < motion.now + h:
            between(plant, motion, h, (notes[0, motion.noted] - motion.now) / h, w)
            notes[row, motion.noted] = shown(plant, motion, w[BETWEEN, X])
            motion.noted += 1
    y = motion.state
    before, start = shown(plant, motion, y[X]), y[X]
    for i in range(8):
        y[i] = w[END, i]
    stuck = event and moves and not plant.inertia and abs(y[X] - start) < _NOTHING_MOVED
    if stuck and flow_end(plant, motion, now(motion)) == NONE:
        # Round-off is all that is left before the stall.
        _stop(plant, motion, STALLED)
        return h, False
    if motion.direction == -outward(motion) and not (motion.valve_0 or motion.valve_1):
        motion.ran_back += abs(shown(plant, motion, y[X]) - before)
    if motion.direction != 0 and plant.inertia and y[U] * motion.direction < 0.0:
        y[U] = 0.0 if flow_end(plant, motion, now(motion)) == NONE else y[U]
    x = shown(plant, motion, y[X])
    motion.least_fill = min(motion.least_fill, plant.total - x if motion.chamber else x)
    filling = event and moves and not (motion.primed or motion.lifting)
    if filling and holds_column(plant, motion, now(motion)):
        motion.primed = 1
    return h, moves and not event


@in_place
def _cut(plant: Record, motion: Record, h: float, w: FloatArray) -> float:
    """End the step just taken at the first event. Returns: its length then, s."""
    rates_at_end(plant, motion, w)
    near = _REST_EVENT if motion.direction == 0 else plant.relative_error
    part = _event_part(plant, motion, h, near, w)
    if part < 1.0:
        shorten(plant, motion, h, part, w)
    return h * part


@in_place
def _event_part(plant: Record, motion: Record, h: float, near: float, w: FloatArray) -> float:
    """Part of the step just taken after which the first event lies, at most `near` late.

    Searched by the event function `beyond` at both ends, see `_illinois_step`.
    """
    low, high, event, stays = 0.0, 1.0, heading(plant, motion, _at(w, END)), 0
    before = beyond(plant, motion, now(motion), event)
    after = beyond(plant, motion, _at(w, END), event)
    for step in range(_BISECTIONS):
        middle = _illinois_step(low, high, before, after, step, near)
        between(plant, motion, h, middle, w)
        value = beyond(plant, motion, _at(w, BETWEEN), event)
        if changes(plant, motion, _at(w, BETWEEN)):
            high, after, before, stays = middle, value, before * (0.5 if stays < 0 else 1.0), -1
        else:
            low, before, after, stays = middle, value, after * (0.5 if stays > 0 else 1.0), 1
        if high - low <= near:
            break
    return high


@in_place
def _settle(plant: Record, motion: Record) -> None:
    """Let moving liquid come to rest, and resting liquid start, where it has to."""
    if motion.direction != 0:
        if motion.lifting and arrived(plant, motion, motion.state[X]) >= 0.0:
            pass_crest(plant, motion)
            motion.length = _first(plant, motion)
        event = flow_end(plant, motion, now(motion))
        if event == NONE:
            return
        _stop(plant, motion, event)
    state = now(motion)
    if separates(plant, motion, state):
        motion.primed = 0
    primed = motion.primed > 0
    wanted = would_start(plant, state, primed)
    limit = limit_in_the_way(plant, state[0], wanted)
    if wanted != 0 and limit != NONE:
        motion.primed = 1 if primed and limit != EMPTY else 0
        _note(plant, motion, limit, wanted)
    direction = starts(plant, motion, state)
    if direction == 0:
        if not (motion.valve_0 or motion.valve_1):
            motion.side = 0
        return
    motion.direction, motion.length, motion.started = direction, _first(plant, motion), state[0]
    set_out(plant, motion)
    if not motion.lifting:
        motion.primed = 1 if holds_column(plant, motion, state) else 0
    _note(plant, motion, NONE, direction)


@in_place
def _first(plant: Record, motion: Record) -> float:
    """Length of the next step after a jump of the rates, s."""
    return float(min(motion.length, plant.first_step))


@in_place
def _stop(plant: Record, motion: Record, event: int) -> None:
    """Bring liquid to rest: exactly at a limit, and with a column only where the law holds one."""
    y, direction = motion.state, motion.direction
    if motion.lifting:
        # The liquid comes to rest in the tube, and the chambers are as they were.
        position, event = front(plant, motion, y[X]), STALLED
        y[X] = shown(plant, motion, y[X])
        motion.front, motion.lifting = position, 0
    _note(plant, motion, event, direction)
    little = _NOTHING_MOVED if motion.stopped != -direction else _LITTLE_MOVED
    # A start that moved nothing is not repeated until a valve or a gas pressure changes.
    motion.balanced = 1 if not plant.line and abs(y[X] - motion.started) < little else 0
    motion.stopped = direction
    if event in (EMPTY, FULL):
        lowest, highest = max(0.0, plant.total - plant.max_fill_ratio), min(plant.total, plant.max_fill_ratio)
        y[X] = lowest if direction > 0 else highest
    state = now(motion)
    gone = event == EMPTY or open_to_gas(plant, pair_ends(plant, state, direction))
    motion.primed = 1 if motion.primed and not gone and holds_column(plant, motion, state) else 0
    y[U], motion.direction, motion.length = 0.0, 0, _first(plant, motion)


@in_place
def _flip(plant: Record, motion: Record) -> None:
    """Move the valve that is due next."""
    opens = motion.opens <= motion.closes
    if opens:
        motion.opens = math.inf
    else:
        motion.closes = math.inf
    if not plant.inertia:
        _note_regime(plant, motion)
        _pause(plant, motion)
    y, chamber = motion.state, motion.chamber
    if not opens:
        motion.closing_pressure = y[P + chamber] - plant.ambient_pressure
    if not plant.line:
        y[P + chamber] = plant.ambient_pressure + (plant.gas_pressure if opens else 0.0)
    if chamber == 0:
        motion.valve_0 = 1 if opens else 0
    else:
        motion.valve_1 = 1 if opens else 0
    motion.balanced, motion.stopped, motion.length = 0, 0, _first(plant, motion)


@in_place
def _quiet(plant: Record, motion: Record) -> bool:
    """True if nothing changes any more until a valve moves."""
    if motion.direction != 0:
        return False
    return bool(not plant.line or (near_end(plant, motion, 0) and near_end(plant, motion, 1)))


@in_place
def _rest_gases(plant: Record, motion: Record) -> None:
    """Set the gases to the pressures that they tend to."""
    if plant.line:
        motion.state[P] = end_pressure(plant, motion.valve_0 > 0)
        motion.state[P + 1] = end_pressure(plant, motion.valve_1 > 0)


@in_place
def _note(plant: Record, motion: Record, event: int, direction: int) -> None:
    """Record an event of the flow out of the driven chamber."""
    if direction == outward(motion):
        is_open = motion.valve_1 > 0 if motion.chamber else motion.valve_0 > 0
        if motion.regime_start == RESTING and event == NONE:
            motion.regime_start = regime(plant, motion)
        if event == NONE:
            motion.ended = 0.0
        elif motion.ended == 0.0:
            motion.ended = motion.now
        if event == EMPTY and motion.event != EMPTY:
            motion.run_dry = motion.closes if is_open else 0.0
        if event != STALLED or is_open:
            motion.event = event
    _note_regime(plant, motion)


@in_place
def _note_regime(plant: Record, motion: Record) -> None:
    if motion.direction != 0:
        motion.regime_end = regime(plant, motion)
