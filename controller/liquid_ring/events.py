"""What ends a step of a pair of chambers: the records of the march and the events that it is cut at."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.column import Steady
from ringbalance.controller.liquid_ring.motion import Dynamics, Record, Switch, Two
from ringbalance.controller.liquid_ring.steps import Allowed, Stepping
from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.scene.arrays import FloatArray

MOST_SEPARATIONS: Final = 16
"""Crossings of the edge of separation, within one interval, that are found to the instant."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """What stays as it is during an interval."""

    dynamics: Dynamics
    total: float
    lowest: float
    highest: float
    allowed: Allowed


@dataclass(frozen=True, kw_only=True, eq=False)
class Now:
    """What changes."""

    state: FloatArray
    primed: bool
    valves: tuple[bool, bool]
    pending: tuple[Switch, ...]
    record: Record
    direction: int
    """+1 out of chamber 0, -1 out of chamber 1, 0 at rest."""
    started: float
    """x at the last start."""
    time: float = 0.0
    stepping: Stepping = field(default_factory=Stepping)
    ran_back: float = 0.0
    separated: bool = False
    separations: int = 0
    """Crossings of the edge of separation so far."""
    balanced: bool = False
    """Whether a further start would be round-off."""
    stopped: int = 0
    """Direction of the last flow that ended."""


def outward(now: Now) -> int:
    """Direction of flow out of the chamber that was driven last."""
    return 1 if now.record.chamber == 0 else -1


def seen(pair: Pair, state: FloatArray) -> tuple[Two, Two]:
    """Fills and gauge pressures of a state."""
    x, ambient = float(state[0]), pair.dynamics.ambient_pressure
    return (x, pair.total - x), (float(state[2]) - ambient, float(state[4]) - ambient)


def steady(pair: Pair, state: FloatArray, *, primed: bool) -> Steady:
    """Quasi-steady flow of a state."""
    fills, gases = seen(pair, state)
    return pair.dynamics.column.steady(fills, gases, primed=primed)


def changes(pair: Pair, now: Now, state: FloatArray) -> bool:
    """Whether an event lies between the last step and this state."""
    if not now.direction:
        return _begins(pair, now, state)
    if flow_end(pair, now, state) is not None:
        return True
    # Flow that keeps to the edge of separation crosses it again and again; its rates are continuous there, so
    # that a crossing need not be found to be stepped over.
    return now.separations < MOST_SEPARATIONS and is_separated(pair, now, state) != now.separated


def _begins(pair: Pair, now: Now, state: FloatArray) -> bool:
    """Whether resting liquid starts to flow, or its column separates."""
    found = steady(pair, state, primed=now.primed)
    separated = now.primed and found.velocity == 0 and not found.primed
    return separated or start_direction(pair, now, state, found) != 0


def start_direction(pair: Pair, now: Now, state: FloatArray, found: Steady) -> int:
    """Direction in which resting liquid starts to flow; zero for none."""
    direction = int(np.sign(found.velocity))
    if direction == 0 or now.balanced or chamber_limit(pair, float(state[0]), direction) is not None:
        return 0
    if not pair.dynamics.inertia:
        return direction
    fills, gases = seen(pair, state)
    push = pair.dynamics.column.acceleration(fills, gases, speed=0.0, direction=direction)
    return direction if push > 0 else 0


def chamber_limit(pair: Pair, x: float, direction: int) -> Event | None:
    """Whether a chamber is in the way of flow in a direction."""
    if direction > 0 and x <= pair.lowest:
        return Event.EMPTY if pair.lowest == 0 else Event.FULL
    if direction < 0 and x >= pair.highest:
        return Event.EMPTY if pair.highest == pair.total else Event.FULL
    return None


def flow_end(pair: Pair, now: Now, state: FloatArray) -> Event | None:
    """What ends the flow in the present direction, if anything does."""
    limit = chamber_limit(pair, float(state[0]), now.direction)
    if limit is not None:
        return limit
    fills, gases = seen(pair, state)
    column = pair.dynamics.column
    if column.open_to_gas(fills, gases, direction=now.direction):
        return Event.STALLED
    speed = float(state[1]) if pair.dynamics.inertia else None
    if speed is not None:
        return Event.STALLED if speed * now.direction < 0 else None
    stalled = column.steady(fills, gases, primed=True).velocity * now.direction <= 0
    return Event.STALLED if stalled else None


def is_separated(pair: Pair, now: Now, state: FloatArray) -> bool:
    """Whether moving liquid is separated at the crest."""
    if not now.direction:
        return False
    fills, gases = seen(pair, state)
    column, speed = pair.dynamics.column, max(float(state[1]) * now.direction, 0.0)
    if pair.dynamics.inertia:
        return column.separated(fills, gases, speed=speed, direction=now.direction)
    return column.steady(fills, gases, primed=True).separated
