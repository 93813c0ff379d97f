"""A pair of chambers through time: fill, velocity and gas as one system, with its events, in plain numbers.

The liquid either rests or moves in one direction; what changes that ends a step: the column comes to rest,
begins to move or separates at rest, a chamber empties or is full, its level leaves the port, or a valve
moves.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.liquid_ring.compiled_column import (
    accelerations,
    can_flow,
    ends,
    holds_at_rest,
    open_to_gas,
    steady,
)
from ringbalance.controller.liquid_ring.compiled_step import (
    BETWEEN,
    END,
    between,
    rates_at_end,
    shorten,
    take,
)
from ringbalance.controller.liquid_ring.records import EVENTS, WORK, P, Record, U, X
from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.arrays import FloatArray

FIRST_STEP: Final = 1e-6
"""s."""
_ROUND_OFF: Final = 1e-12
"""s, of the clock of a valve."""
_BISECTIONS: Final = 40
_NOTHING_MOVED: Final = 1e-13
"""Fill ratio below which a start has come to nothing but round-off."""
_LITTLE_MOVED: Final = 1e-9
"""Fill ratio below which a flow that ends was the last swing of a column about its balance."""
_AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure that counts as there, with the liquid at rest."""
_OPENINGS: Final = 40
"""Halvings of the valve-open time that leaves a chamber with its residual fill."""
NONE: Final = EVENTS.index(Event.NONE)
BLOCKED: Final = EVENTS.index(Event.BLOCKED)
_STALLED: Final = EVENTS.index(Event.STALLED)
_EMPTY: Final = EVENTS.index(Event.EMPTY)
_FULL: Final = EVENTS.index(Event.FULL)
UNFINISHED: Final = EVENTS.index(Event.UNFINISHED)
_RESTING: Final = int(Regime.BLOCKED)
_SIPHON: Final = int(Regime.SIPHON)
_SEPARATED: Final = int(Regime.SEPARATED)
_REVERSE: Final = int(Regime.REVERSE)


@compiled
def command(plant: Record, motion: Record, chamber: int, duration: float) -> None:
    """A valve opens and closes a lag after its command, which begins a new record of what it does."""
    x = motion.state[X]
    motion.chamber, motion.opens, motion.closes = chamber, plant.valve_lag, plant.valve_lag + duration
    motion.fill_before = plant.total - x if chamber else x
    motion.least_fill = motion.fill_before
    motion.state[WORK], motion.state[WORK + 1] = 0.0, 0.0
    motion.regime_start, motion.regime_end, motion.event = _RESTING, _RESTING, BLOCKED
    motion.closing_pressure, motion.run_dry = 0.0, 0.0


@compiled
def rests(plant: Record, motion: Record) -> bool:
    """Whether nothing moves, no gas is under pressure, and no valve is open or about to move."""
    waiting = min(motion.opens, motion.closes) < math.inf
    p, q = _gases(plant, motion.state)
    still = motion.direction == 0 and p == 0.0 and q == 0.0
    return bool(still and not (motion.primed or motion.valve_0 or motion.valve_1 or waiting))


@compiled
def advance(plant: Record, motion: Record, duration: float, w: FloatArray) -> None:
    """Let a time pass, s, through the valves' movements on the way."""
    left = duration
    # What is due at the end counts, whatever the clock has rounded off.
    while min(motion.opens, motion.closes) <= left + _ROUND_OFF:
        until = min(motion.opens, motion.closes, left)
        _march(plant, motion, until, w)
        left -= until
        _flip(plant, motion)
    _march(plant, motion, left, w)
    _settle(plant, motion)
    _note_regime(plant, motion)
    _pause(plant, motion)


@compiled
def _pause(plant: Record, motion: Record) -> None:
    """Liquid without mass has no motion of its own: the next instant finds it again."""
    if motion.direction != 0 and not plant.inertia:
        motion.primed = 1 if _steady(plant, motion, motion.state, motion.primed > 0)[2] else 0
        motion.direction = 0


@compiled
def opening_within(
    plant: Record, motions: Record, pair: int, spare: int, chamber: int, duration: float, w: FloatArray
) -> float:
    """Longest valve-open time, at most `duration`, that leaves the driven chamber its residual fill, s.

    `motions[spare]` is written to.  Returns: zero where the chamber is already there.
    """
    if _least_after(plant, motions, pair, spare, chamber, duration, w) >= plant.residual:
        return duration
    low, high = 0.0, duration
    for _ in range(_OPENINGS):
        middle = (low + high) / 2.0
        if _least_after(plant, motions, pair, spare, chamber, middle, w) >= plant.residual:
            low = middle
        else:
            high = middle
        if high - low <= 1e-9 * duration:
            break
    return low


@compiled
def _least_after(
    plant: Record, motions: Record, pair: int, spare: int, chamber: int, duration: float, w: FloatArray
) -> float:
    """Lowest fill of the driven chamber until an injection and its tail are over."""
    motions[spare] = motions[pair]
    trial = motions[spare]
    command(plant, trial, chamber, duration)
    advance(plant, trial, plant.valve_lag + duration, w)
    # The column stops, or runs back, while the gas vents.
    for _ in range(100):
        if trial.direction == 0 or trial.direction == (-1 if chamber == 0 else 1):
            break
        advance(plant, trial, 0.1, w)
    return float(trial.least_fill)


@compiled
def _gases(plant: Record, y: FloatArray) -> tuple[float, float]:
    """Gauge pressures."""
    return y[P] - plant.ambient_pressure, y[P + 1] - plant.ambient_pressure


@compiled
def _ends(plant: Record, y: FloatArray, direction: int) -> tuple[float, float, float, float]:
    p, q = _gases(plant, y)
    return ends(plant, y[X], plant.total - y[X], p, q, direction)


@compiled
def _steady(plant: Record, motion: Record, y: FloatArray, primed: bool) -> tuple[float, bool, bool]:
    p, q = _gases(plant, y)
    return steady(plant, y[X], plant.total - y[X], p, q, primed, motion.log_speed)


@compiled
def _outward(motion: Record) -> int:
    """Direction of flow out of the chamber that was driven last."""
    return 1 if motion.chamber == 0 else -1


@compiled
def _limit(plant: Record, x: float, direction: int) -> int:
    """The event by which a chamber is in the way of flow in a direction; `NONE`: it is not."""
    lowest, highest = max(0.0, plant.total - plant.max_fill_ratio), min(plant.total, plant.max_fill_ratio)
    if direction > 0 and x <= lowest:
        return _EMPTY if lowest == 0.0 else _FULL
    if direction < 0 and x >= highest:
        return _EMPTY if highest == plant.total else _FULL
    return NONE


@compiled
def _start(plant: Record, y: FloatArray, primed: bool) -> int:
    """Direction in which resting liquid would flow; zero for none."""
    if can_flow(plant, _ends(plant, y, 1), primed):
        return 1
    return -1 if can_flow(plant, _ends(plant, y, -1), primed) else 0


@compiled
def _starts(plant: Record, motion: Record, y: FloatArray, primed: bool) -> int:
    """Direction in which resting liquid does start to flow; zero for none."""
    direction = _start(plant, y, primed)
    if direction == 0 or motion.balanced or _limit(plant, y[X], direction) != NONE:
        return 0
    return direction if not plant.inertia or _push(plant, motion, y, direction, primed) > 0.0 else 0


@compiled
def _push(plant: Record, motion: Record, y: FloatArray, direction: int, primed: bool) -> float:
    """Acceleration of a column at rest."""
    at = _ends(plant, y, direction)
    full, broken = accelerations(plant, at, 0.0, direction, primed, motion.log_speed)
    return min(full, broken)


@compiled
def _separates(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether a primed column at rest separates."""
    if not motion.primed or _start(plant, y, True) != 0:
        return False
    return not holds_at_rest(plant, _ends(plant, y, 1), True)


@compiled
def _flow_end(plant: Record, motion: Record, y: FloatArray) -> int:
    """The event that ends the flow in the present direction; `NONE`: it continues."""
    direction = motion.direction
    event = _limit(plant, y[X], direction)
    if event != NONE:
        return event
    if open_to_gas(plant, _ends(plant, y, direction)):
        return _STALLED
    primed = motion.primed > 0
    if plant.inertia:
        # Round-off of a creeping column's velocity is no stall: it is still driven.
        slow = y[U] * direction < 0.0
        return _STALLED if slow and _push(plant, motion, y, direction, primed) <= 0.0 else NONE
    return NONE if _start(plant, y, primed) == direction else _STALLED


@compiled
def _changes(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether an event lies between the last step and this state."""
    if motion.direction != 0:
        primes = not motion.primed and _primes(plant, motion, y)
        return primes or _flow_end(plant, motion, y) != NONE
    return _separates(plant, motion, y) or _starts(plant, motion, y, motion.primed > 0) != 0


@compiled
def _march(plant: Record, motion: Record, duration: float, w: FloatArray) -> None:
    """Steps and their events, with the valves as they are."""
    left = duration
    while left > 0.0:
        _settle(plant, motion)
        if motion.steps >= plant.most_steps:
            motion.event = UNFINISHED
            _pass(motion, left)
            return
        if _quiet(plant, motion):
            _rest_gases(plant, motion)
            _pass(motion, left)
            return
        h = _step(plant, motion, left, w)
        _pass(motion, left if h >= left else h)
        left = 0.0 if h >= left else left - h


@compiled
def _pass(motion: Record, time: float) -> None:
    """The clock of the valves."""
    motion.opens -= time
    motion.closes -= time


@compiled
def _step(plant: Record, motion: Record, left: float, w: FloatArray) -> float:
    """One accepted step, cut at the first event within it. Returns: its length, s."""
    h = take(plant, motion, left, w)
    if _changes(plant, motion, w[END]):
        rates_at_end(plant, motion, w)
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            between(motion, h, middle, w)
            if _changes(plant, motion, w[BETWEEN]):
                high = middle
            else:
                low = middle
        if high < 1.0:
            h *= high
            shorten(plant, motion, h, w)
    before, y = motion.state[X], motion.state
    for i in range(8):
        y[i] = w[END, i]
    if motion.direction == -_outward(motion) and not (motion.valve_0 or motion.valve_1):
        motion.ran_back += abs(y[X] - before)
    if motion.direction != 0 and plant.inertia and y[U] * motion.direction < 0.0:
        y[U] = 0.0 if _flow_end(plant, motion, y) == NONE else y[U]
    motion.least_fill = min(motion.least_fill, plant.total - y[X] if motion.chamber else y[X])
    if motion.direction != 0 and not motion.primed and _primes(plant, motion, y):
        motion.primed = 1
    return h


@compiled
def _primes(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether the liquid that spills over the crest has filled the tube, by the law."""
    return _steady(plant, motion, y, False)[2]


@compiled
def _settle(plant: Record, motion: Record) -> None:
    """Let moving liquid come to rest, and resting liquid start, where it has to."""
    if motion.direction != 0:
        event = _flow_end(plant, motion, motion.state)
        if event == NONE:
            return
        _stop(plant, motion, event)
    y = motion.state
    if _separates(plant, motion, y):
        motion.primed = 0
    primed = motion.primed > 0
    wanted = _start(plant, y, primed)
    limit = _limit(plant, y[X], wanted)
    if wanted != 0 and limit != NONE:
        motion.primed = 1 if primed and limit != _EMPTY else 0
        _note(plant, motion, limit, wanted)
    direction = _starts(plant, motion, y, primed)
    if direction == 0:
        return
    motion.primed = 1 if _steady(plant, motion, y, primed)[2] else 0
    motion.direction, motion.length, motion.started = direction, FIRST_STEP, y[X]
    _note(plant, motion, NONE, direction)


@compiled
def _stop(plant: Record, motion: Record, event: int) -> None:
    """At rest: at a limit exactly, and with a column only where the law has one."""
    _note(plant, motion, event, motion.direction)
    y, direction = motion.state, motion.direction
    little = _NOTHING_MOVED if motion.stopped != -direction else _LITTLE_MOVED
    # A start that moved nothing will move nothing again, until a valve or a gas pressure does.
    motion.balanced = 1 if not plant.line and abs(y[X] - motion.started) < little else 0
    motion.stopped = direction
    if event in (_EMPTY, _FULL):
        lowest, highest = max(0.0, plant.total - plant.max_fill_ratio), min(plant.total, plant.max_fill_ratio)
        y[X] = lowest if direction > 0 else highest
    gone = event == _EMPTY or open_to_gas(plant, _ends(plant, y, direction))
    motion.primed = 1 if motion.primed and not gone and _steady(plant, motion, y, True)[2] else 0
    y[U], motion.direction, motion.length = 0.0, 0, FIRST_STEP


@compiled
def _flip(plant: Record, motion: Record) -> None:
    """The next waiting valve moves."""
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
    motion.balanced, motion.stopped, motion.length = 0, 0, FIRST_STEP


@compiled
def _end_pressure(plant: Record, is_open: bool) -> float:
    """Absolute, that a gas tends to, Pa."""
    return float(plant.ambient_pressure + (plant.gas_pressure if is_open else 0.0))


@compiled
def _quiet(plant: Record, motion: Record) -> bool:
    """Whether nothing changes any more until a valve moves."""
    if motion.direction != 0:
        return False
    y = motion.state
    p, q = _end_pressure(plant, motion.valve_0 > 0), _end_pressure(plant, motion.valve_1 > 0)
    near = abs(y[P] - p) <= _AT_REST * p and abs(y[P + 1] - q) <= _AT_REST * q
    return not plant.line or near


@compiled
def _rest_gases(plant: Record, motion: Record) -> None:
    """The gases at the pressures that they tend to."""
    if plant.line:
        motion.state[P] = _end_pressure(plant, motion.valve_0 > 0)
        motion.state[P + 1] = _end_pressure(plant, motion.valve_1 > 0)


@compiled
def _note(plant: Record, motion: Record, event: int, direction: int) -> None:
    """Keep what happens to the flow out of the driven chamber."""
    if direction == _outward(motion):
        is_open = motion.valve_1 > 0 if motion.chamber else motion.valve_0 > 0
        if motion.regime_start == _RESTING and event == NONE:
            motion.regime_start = _regime(plant, motion)
        if event == _EMPTY and motion.event != _EMPTY:
            motion.run_dry = motion.closes if is_open else 0.0
        if event != _STALLED or is_open:
            motion.event = event
    _note_regime(plant, motion)


@compiled
def _note_regime(plant: Record, motion: Record) -> None:
    if motion.direction != 0:
        motion.regime_end = _regime(plant, motion)


@compiled
def _regime(plant: Record, motion: Record) -> int:
    direction, y = motion.direction, motion.state
    if direction != _outward(motion):
        return _REVERSE
    primed = motion.primed > 0
    if not plant.inertia:
        return _SEPARATED if _steady(plant, motion, y, primed)[1] else _SIPHON
    at, speed = _ends(plant, y, direction), max(y[U] * direction, 0.0)
    full, broken = accelerations(plant, at, speed, direction, primed, motion.log_speed)
    return _SEPARATED if broken < full else _SIPHON
