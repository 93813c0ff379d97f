"""Events that end a step of a pair of chambers, and rest and start of its liquid, in plain numbers.

A state is x of chamber 0, the velocity out of it and the absolute pressures of both gases.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.reduced_model.injection.column import (
    accelerations,
    can_flow,
    clearance,
    ends,
    holds,
    holds_at_rest,
    open_to_gas,
    steady,
    tabled,
)
from ringbalance.reduced_model.injection.dynamics import EVENTS, WORK, Event, P, Record, U, X
from ringbalance.reduced_model.injection.lift import arrived, crest_stop, lift_push, shown
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.platform.compiled import in_place

NONE: Final = EVENTS.index(Event.NONE)
STALLED: Final = EVENTS.index(Event.STALLED)
EMPTY: Final = EVENTS.index(Event.EMPTY)
FULL: Final = EVENTS.index(Event.FULL)
FILLS: Final = 2
"""The tube becomes filled; types of events from here on stand beside the directions of a start."""
STOPS: Final = 3
"""The column comes to rest."""
ARRIVES: Final = 4
"""Lifted liquid reaches the end of the crest."""
RESTING: Final = int(Regime.BLOCKED)
_BLOCKED: Final = EVENTS.index(Event.BLOCKED)
_SIPHON: Final = int(Regime.SIPHON)
_SEPARATED: Final = int(Regime.SEPARATED)
_REVERSE: Final = int(Regime.REVERSE)

Four = tuple[float, float, float, float]


@in_place
def now(motion: Record) -> Four:
    """The present state."""
    y = motion.state
    return y[X], y[U], y[P], y[P + 1]


@in_place
def pair_ends(plant: Record, state: Four, direction: int) -> Four:
    """Pressures at the tube's ends in a state, as `column.ends`."""
    x, _, p, q = state
    ambient = plant.ambient_pressure
    return ends(plant, x, plant.total - x, p - ambient, q - ambient, direction)


@in_place
def _pair_steady(plant: Record, motion: Record, state: Four) -> tuple[float, bool]:
    """Quasi-steady flow in a state, as `column.steady`."""
    x, _, p, q = state
    ambient, primed = plant.ambient_pressure, motion.primed > 0
    return steady(plant, x, plant.total - x, p - ambient, q - ambient, primed, motion.log_speed)


@in_place
def holds_column(plant: Record, motion: Record, state: Four) -> bool:
    """True if the tube holds a column by the law."""
    x, _, p, q = state
    ambient, primed = plant.ambient_pressure, motion.primed > 0
    return holds(plant, x, plant.total - x, p - ambient, q - ambient, primed, motion.log_speed)


@in_place
def pass_crest(plant: Record, motion: Record) -> None:
    """Let lifted liquid become the flow law's column."""
    motion.state[X] = shown(plant, motion, motion.state[X])
    motion.front, motion.lifting = crest_stop(plant, motion.direction), 0
    motion.primed = 1 if holds_column(plant, motion, now(motion)) else 0


@in_place
def outward(motion: Record) -> int:
    """Direction of flow out of the chamber that was driven last."""
    return 1 if motion.chamber == 0 else -1


@in_place
def command(plant: Record, motion: Record, chamber: int, duration: float) -> None:
    """Command a valve to open and close, each after its lag, and begin a new record of the injection."""
    x = shown(plant, motion, motion.state[X])
    motion.chamber, motion.opens, motion.closes = chamber, plant.valve_lag, plant.valve_lag + duration
    forget(motion, plant.total - x if chamber else x)


@in_place
def forget(motion: Record, fill: float) -> None:
    """Begin a new record of an injection, from the present fill of the driven chamber."""
    motion.fill_before, motion.least_fill = fill, fill
    motion.state[WORK], motion.state[WORK + 1] = 0.0, 0.0
    motion.regime_start, motion.regime_end, motion.event = RESTING, RESTING, _BLOCKED
    motion.closing_pressure, motion.run_dry = 0.0, 0.0


@in_place
def rests(plant: Record, motion: Record) -> bool:
    """True if the pair is at rest and vented, and no valve is open or about to move."""
    waiting, y = min(motion.opens, motion.closes) < math.inf, motion.state
    still = motion.direction == 0 and y[P] == plant.ambient_pressure == y[P + 1]
    return bool(still and not (motion.primed or motion.valve_0 or motion.valve_1 or waiting))


@in_place
def limit_in_the_way(plant: Record, x: float, direction: int) -> int:
    """Event of the empty or full chamber that prevents flow in a direction; `NONE`: no chamber does."""
    lowest, highest = max(0.0, plant.total - plant.max_fill_ratio), min(plant.total, plant.max_fill_ratio)
    if direction > 0 and x <= lowest:
        return EMPTY if lowest == 0.0 else FULL
    if direction < 0 and x >= highest:
        return EMPTY if highest == plant.total else FULL
    return NONE


@in_place
def would_start(plant: Record, state: Four, primed: bool) -> int:
    """Direction in which the law lets resting liquid flow, apart from limits of fill; zero for none."""
    if plant.tabled:
        speed = tabled(
            plant, state[0], state[2] - plant.ambient_pressure, state[3] - plant.ambient_pressure, primed, 0.0
        )[0]
        return 1 if speed > 0.0 else -1 if speed < 0.0 else 0
    at = pair_ends(plant, state, 1)
    if can_flow(plant, at, primed):
        return 1
    return -1 if can_flow(plant, (at[1], at[0], at[3], at[2]), primed) else 0


@in_place
def starts(plant: Record, motion: Record, state: Four) -> int:
    """Direction in which resting liquid starts to flow within the limits of fill; zero for none."""
    direction = would_start(plant, state, motion.primed > 0)
    if direction == 0 or motion.balanced or limit_in_the_way(plant, state[0], direction) != NONE:
        return 0
    return direction if not plant.inertia or _push(plant, motion, state, direction) > 0.0 else 0


@in_place
def _push(plant: Record, motion: Record, state: Four, direction: int) -> float:
    """Acceleration from rest of a column or of lifted liquid, m/s^2."""
    if motion.lifting:
        return lift_push(plant, motion, state[0], state[2], state[3])
    at = pair_ends(plant, state, direction)
    rates = accelerations(plant, at, 0.0, direction, motion.primed > 0, motion.log_speed)
    return min(rates[0], rates[1])


@in_place
def separates(plant: Record, motion: Record, state: Four) -> bool:
    """True if a primed column at rest separates."""
    if not motion.primed or would_start(plant, state, True) != 0:
        return False
    if plant.tabled:
        return not holds_column(plant, motion, state)
    return not holds_at_rest(plant, pair_ends(plant, state, 1), True)


@in_place
def flow_end(plant: Record, motion: Record, state: Four) -> int:
    """The event that ends the flow in the present direction; `NONE`: it continues."""
    direction = motion.direction
    event = limit_in_the_way(plant, state[0], direction)
    if event != NONE:
        return event
    if open_to_gas(plant, pair_ends(plant, state, direction)):
        return STALLED
    if plant.inertia:
        # Round-off of a creeping column's velocity is no stall: it is still driven.
        slow = state[1] * direction < 0.0
        return STALLED if slow and _push(plant, motion, state, direction) <= 0.0 else NONE
    return NONE if would_start(plant, state, motion.primed > 0) == direction else STALLED


@in_place
def changes(plant: Record, motion: Record, state: Four) -> bool:
    """True if an event lies between the last step and a state."""
    if motion.lifting:
        return bool(arrived(plant, motion, state[0]) >= 0.0 or flow_end(plant, motion, state) != NONE)
    if motion.direction != 0:
        filled = not motion.primed and holds_column(plant, motion, state)
        return filled or flow_end(plant, motion, state) != NONE
    return separates(plant, motion, state) or starts(plant, motion, state) != 0


@in_place
def heading(plant: Record, motion: Record, state: Four) -> int:
    """Type of an event, for `beyond`: direction of a start, else a constant of this module or 0."""
    if motion.direction == 0:
        return starts(plant, motion, state)
    if motion.lifting and arrived(plant, motion, state[0]) >= 0.0:
        return ARRIVES
    if not plant.inertia:
        return 0
    if not (motion.primed or motion.lifting) and holds_column(plant, motion, state):
        return FILLS
    return STOPS if state[1] * motion.direction < 0.0 else 0


@in_place
def beyond(plant: Record, motion: Record, state: Four, event: int) -> float:
    """Event function: below zero before an event, above zero after it, in a unit of that event.

    It only guides the search; `changes` decides on which side of the event a state is.
    """
    if motion.direction == 0:
        return _push(plant, motion, state, event) if event != 0 else 0.0
    if event == ARRIVES:
        return arrived(plant, motion, state[0])
    if event == FILLS:
        return clearance(plant, pair_ends(plant, state, motion.direction), motion.direction, motion.log_speed)
    return -state[1] * motion.direction if event == STOPS else 0.0


@in_place
def regime(plant: Record, motion: Record) -> int:
    """Value of `Regime` of moving liquid, seen from the chamber that was driven last."""
    direction, state = motion.direction, now(motion)
    if direction != outward(motion):
        return _REVERSE
    if not plant.inertia:
        return _SEPARATED if _pair_steady(plant, motion, state)[1] else _SIPHON
    at, speed = pair_ends(plant, state, direction), max(state[1] * direction, 0.0)
    rates = accelerations(plant, at, speed, direction, motion.primed > 0, motion.log_speed)
    return _SEPARATED if rates[1] < rates[0] else _SIPHON
