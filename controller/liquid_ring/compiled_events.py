"""What ends a step of a pair of chambers, and what its liquid does at rest, in plain numbers."""

from __future__ import annotations

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
from ringbalance.controller.liquid_ring.records import EVENTS, P, Record, U, X
from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.arrays import FloatArray

NONE: Final = EVENTS.index(Event.NONE)
STALLED: Final = EVENTS.index(Event.STALLED)
EMPTY: Final = EVENTS.index(Event.EMPTY)
FULL: Final = EVENTS.index(Event.FULL)
_SIPHON: Final = int(Regime.SIPHON)
_SEPARATED: Final = int(Regime.SEPARATED)
_REVERSE: Final = int(Regime.REVERSE)


@compiled
def gases(plant: Record, y: FloatArray) -> tuple[float, float]:
    """Gauge pressures."""
    return y[P] - plant.ambient_pressure, y[P + 1] - plant.ambient_pressure


@compiled
def pair_ends(plant: Record, y: FloatArray, direction: int) -> tuple[float, float, float, float]:
    """Pressures at the tube's ends in a state, as `compiled_column.ends`."""
    p, q = gases(plant, y)
    return ends(plant, y[X], plant.total - y[X], p, q, direction)


@compiled
def pair_steady(plant: Record, motion: Record, y: FloatArray, primed: bool) -> tuple[float, bool, bool]:
    """Quasi-steady flow in a state, as `compiled_column.steady`."""
    p, q = gases(plant, y)
    return steady(plant, y[X], plant.total - y[X], p, q, primed, motion.log_speed)


@compiled
def outward(motion: Record) -> int:
    """Direction of flow out of the chamber that was driven last."""
    return 1 if motion.chamber == 0 else -1


@compiled
def limit_in_the_way(plant: Record, x: float, direction: int) -> int:
    """The event by which a chamber is in the way of flow in a direction; `NONE`: it is not."""
    lowest, highest = max(0.0, plant.total - plant.max_fill_ratio), min(plant.total, plant.max_fill_ratio)
    if direction > 0 and x <= lowest:
        return EMPTY if lowest == 0.0 else FULL
    if direction < 0 and x >= highest:
        return EMPTY if highest == plant.total else FULL
    return NONE


@compiled
def would_start(plant: Record, y: FloatArray, primed: bool) -> int:
    """Direction in which resting liquid would flow; zero for none."""
    if can_flow(plant, pair_ends(plant, y, 1), primed):
        return 1
    return -1 if can_flow(plant, pair_ends(plant, y, -1), primed) else 0


@compiled
def starts(plant: Record, motion: Record, y: FloatArray, primed: bool) -> int:
    """Direction in which resting liquid does start to flow; zero for none."""
    direction = would_start(plant, y, primed)
    if direction == 0 or motion.balanced or limit_in_the_way(plant, y[X], direction) != NONE:
        return 0
    return direction if not plant.inertia or _push(plant, motion, y, direction, primed) > 0.0 else 0


@compiled
def _push(plant: Record, motion: Record, y: FloatArray, direction: int, primed: bool) -> float:
    """Acceleration of a column at rest."""
    at = pair_ends(plant, y, direction)
    full, broken = accelerations(plant, at, 0.0, direction, primed, motion.log_speed)
    return min(full, broken)


@compiled
def separates(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether a primed column at rest separates."""
    if not motion.primed or would_start(plant, y, True) != 0:
        return False
    return not holds_at_rest(plant, pair_ends(plant, y, 1), True)


@compiled
def flow_end(plant: Record, motion: Record, y: FloatArray) -> int:
    """The event that ends the flow in the present direction; `NONE`: it continues."""
    direction = motion.direction
    event = limit_in_the_way(plant, y[X], direction)
    if event != NONE:
        return event
    if open_to_gas(plant, pair_ends(plant, y, direction)):
        return STALLED
    primed = motion.primed > 0
    if plant.inertia:
        # Round-off of a creeping column's velocity is no stall: it is still driven.
        slow = y[U] * direction < 0.0
        return STALLED if slow and _push(plant, motion, y, direction, primed) <= 0.0 else NONE
    return NONE if would_start(plant, y, primed) == direction else STALLED


@compiled
def changes(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether an event lies between the last step and this state."""
    if motion.direction != 0:
        filled = not motion.primed and primes(plant, motion, y)
        return filled or flow_end(plant, motion, y) != NONE
    return separates(plant, motion, y) or starts(plant, motion, y, motion.primed > 0) != 0


@compiled
def primes(plant: Record, motion: Record, y: FloatArray) -> bool:
    """Whether the liquid that spills over the crest has filled the tube, by the law."""
    return pair_steady(plant, motion, y, False)[2]


@compiled
def regime(plant: Record, motion: Record) -> int:
    """Value of `Regime` of moving liquid, seen from the chamber that was driven last."""
    direction, y = motion.direction, motion.state
    if direction != outward(motion):
        return _REVERSE
    primed = motion.primed > 0
    if not plant.inertia:
        return _SEPARATED if pair_steady(plant, motion, y, primed)[1] else _SIPHON
    at, speed = pair_ends(plant, y, direction), max(y[U] * direction, 0.0)
    full, broken = accelerations(plant, at, speed, direction, primed, motion.log_speed)
    return _SEPARATED if broken < full else _SIPHON
