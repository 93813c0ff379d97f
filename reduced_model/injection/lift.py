"""Liquid that is lifted in the tube before any of it passes the crest, in plain numbers.

In an unprimed tube the liquid of the giving chamber stands at that chamber's level, with the gas of the
other one over it.  Under gas pressure its front, at the fraction s of the path, moves by
    rho s L du/dt = p_A - p_c + P_A - D(s) - K(s) rho u^2/2,    L ds/dt = u,
D(s) the pressure of a column from the front to the outer wall, p_c that of the gas over the crest,
K(s) = e K + (1 - e) K s/s_end with K = alpha + k_up up to the crest's end s_end, and e the fraction of it
lost at the entrance.  From s_end on the flow law's column continues at the same velocity.

Liquid on the crest's circle is pulled to neither side.  When the column parts, this liquid is assumed to
drain evenly: liquid short of the middle of the crest falls back, liquid beyond it has passed.  Between
injections gas is assumed to lie over the crest; legs on both sides of a cavity would stand somewhat higher.
While liquid is lifted the state holds the fill of the chamber alone; `shown` counts the lifted liquid in the
chamber to which it would drain.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.reduced_model.injection.column import (
    crest_slopes,
    crest_table,
    ends,
    gas_volume,
    hydrostatic,
    law_speed,
    line_rates,
    quasi_steady,
    tube_loss,
)
from ringbalance.reduced_model.injection.dynamics import P, Record, U, X
from ringbalance.reduced_model.tube.regime import crest_margins
from ringbalance.scene.platform.compiled import in_place, inlined

_BEHIND: Final = 0.54956
_ARRIVES: Final = 0.62435
"""-y and y' at t = 0 of y'' = y^2 + t with y = -sqrt(-t) long before."""


@inlined
def crest_start(plant: Record, direction: int) -> float:
    """Fraction of the path at which the crest's circle begins."""
    return float(1.0 - (plant.return_crest_end if direction > 0 else plant.crest_end))


@inlined
def crest_stop(plant: Record, direction: int) -> float:
    """Fraction of the path at which the crest's circle ends."""
    return float(plant.crest_end if direction > 0 else plant.return_crest_end)


@inlined
def front(plant: Record, motion: Record, x: float) -> float:
    """Fraction of the path up to which liquid stands, for a fill of chamber 0."""
    if not motion.lifting:
        return float(motion.front)
    return float(motion.front + motion.direction * (motion.started - x) / plant.hold_up)


@inlined
def shown(plant: Record, motion: Record, x: float) -> float:
    """Fill of chamber 0, with lifted liquid counted in the chamber to which it would drain."""
    if not motion.lifting:
        return x
    return float(motion.started - motion.direction * _passed(plant, motion, front(plant, motion, x)))


@inlined
def _passed(plant: Record, motion: Record, position: float) -> float:
    """Fill ratio that has passed the middle of the crest with the front at a fraction of the path."""
    middle = (crest_start(plant, motion.direction) + crest_stop(plant, motion.direction)) / 2.0
    return float((max(position - middle, 0.0) - max(motion.front - middle, 0.0)) * plant.hold_up)


@in_place
def stands(plant: Record, motion: Record) -> tuple[float, float]:
    """Present values of `front` and `shown`."""
    return front(plant, motion, motion.state[X]), shown(plant, motion, motion.state[X])


@inlined
def arrived(plant: Record, motion: Record, x: float) -> float:
    """Distance of the front past the crest's end, a fraction of the path."""
    return front(plant, motion, x) - crest_stop(plant, motion.direction)


@inlined
def _leg(plant: Record, position: float, direction: int) -> tuple[float, float]:
    """D_m - D(s), Pa, and its slope."""
    start, tall = crest_start(plant, direction), plant.column_pressure - plant.port_pressure
    outward, straight = 1.0 - position / start, plant.lift_straight
    if outward <= 0.0:
        return 0.0, 0.0
    height = tall * outward * (straight + (1.0 - straight) * outward)
    return height, -tall / start * (straight + 2.0 * (1.0 - straight) * outward)


@inlined
def lift_rates(
    plant: Record, motion: Record, at: tuple[float, float, float, float], x: float, speed: float
) -> tuple[float, float, float, float, float, float]:
    """Acceleration along the direction, m/s^2; derivative of du/dt, u out of chamber 0, by x through the
    front; then, as in `accelerations`, by the speed, the upstream pressure, the downstream gas and liquid."""
    direction, rho = motion.direction, plant.density
    position, entrance = front(plant, motion, x), plant.lift_entrance
    height, slope = _leg(plant, position, direction)
    margin = crest_margins(plant, at)[1] + height
    per_path = (1.0 - entrance) / crest_stop(plant, direction)
    share, length = entrance + per_path * position, position * plant.length
    loss, loss_slope = tube_loss(
        plant, crest_table(plant, direction), speed, law_speed(speed, motion.log_speed)
    )
    rate = (margin / rho - share * loss) / length
    by_position = (slope / rho - per_path * loss) / length - rate / position
    each = 1.0 / (rho * length)
    _, by_gas, by_far = crest_slopes(plant, at)
    by_x = -by_position / plant.hold_up
    return rate, by_x, -share * loss_slope / length, each, -each * by_gas, -each * by_far


@in_place
def lift_speed(plant: Record, motion: Record, at: tuple[float, float, float, float], x: float) -> float:
    """Velocity of the front without inertia, m/s."""
    direction, position = motion.direction, front(plant, motion, x)
    margin = crest_margins(plant, at)[1] + _leg(plant, position, direction)[0]
    if margin <= 0.0:
        return 0.0
    share = plant.lift_entrance + (1.0 - plant.lift_entrance) * position / crest_stop(plant, direction)
    return quasi_steady(plant, crest_table(plant, direction), margin / share, motion.log_speed)


@in_place
def lift_push(plant: Record, motion: Record, x: float, p: float, q: float) -> float:
    """Acceleration of the front from rest, m/s^2; pressures absolute."""
    ambient = plant.ambient_pressure
    at = ends(plant, x, plant.total - x, p - ambient, q - ambient, motion.direction)
    return lift_rates(plant, motion, at, x, 0.0)[0]


@in_place
def set_out(plant: Record, motion: Record) -> None:
    """Set the front of liquid that begins to move, and its velocity; a primed tube has none."""
    direction = motion.direction
    if not plant.lifts or motion.primed:
        motion.lifting, motion.front, motion.side = 0, crest_stop(plant, direction), direction
        return
    if motion.side != direction:
        motion.front, speed = _first_front(plant, motion)
        motion.side = direction
        if plant.inertia:
            motion.state[U] = direction * speed
    motion.lifting = 1 if motion.front < crest_stop(plant, direction) else 0


@in_place
def _first_front(plant: Record, motion: Record) -> tuple[float, float]:
    """Front of the leg, a fraction of the path, when flow over the crest becomes possible; velocity, m/s.

    At the chamber's level if the gas pressure jumps.  If a line raises it slowly, the leg has risen with it,
    see `_risen`.  Between the two the leg has gone as far as a rising pressure moves one of constant length,
    p t^2/(6 rho s L), t the filling time of the choked line.
    """
    direction, x = motion.direction, motion.state[X]
    fill = x if direction > 0 else plant.total - x
    tall = plant.column_pressure - plant.port_pressure
    part = (plant.column_pressure - hydrostatic(plant, fill)[0]) / tall
    part, straight = min(max(part, 0.0), 1.0), plant.lift_straight
    root = straight + math.sqrt(straight * straight + 4.0 * (1.0 - straight) * part)
    start = crest_start(plant, direction)
    # An entrance has the inertia of about a bore's length.
    level = max(start * (1.0 - 2.0 * part / root), math.sqrt(4.0 / math.pi * plant.tube_area) / plant.length)
    if not plant.line:
        return level, 0.0
    chamber = 0 if direction > 0 else 1
    pressure, content = motion.state[P + chamber], motion.state[P + 2 + chamber]
    volume = gas_volume(plant, fill)
    gauge = pressure - plant.ambient_pressure
    supply = plant.supply_pressure if plant.leaks else plant.gas_pressure + plant.ambient_pressure
    # What leaks is that of the mean pressure of the rise.
    inflow = plant.passing * supply - plant.leak_to_ambient * (pressure + plant.ambient_pressure) / 2.0
    time = gauge * volume / inflow
    path = gauge * time * time / (6.0 * plant.density * level * plant.length)
    rate = line_rates(plant, pressure, content, volume, 0.0, True)[0]
    risen, speed = _risen(plant, start, tall, max(rate, 0.0))
    if level + path / plant.length < risen:
        return level + path / plant.length, 0.0
    return max(risen, level), speed


@inlined
def _risen(plant: Record, start: float, tall: float, rate: float) -> tuple[float, float]:
    """Front and velocity of a leg in a pressure rising at a rate, when it reaches that of the crest.

    A leg that touches the crest's circle has no stiffness there: with y the way to the crest's start,
    y'' = A y^2 + B t, whose solution that follows the balance y = -sqrt(-B t/A) passes t = 0 at
    -0.5496 (B^2/A^3)^(1/5) with 0.6243 (B^3/A^2)^(1/5).  A straight leg follows its balance.
    """
    length = start * plant.length
    if not plant.inertia or rate == 0.0:
        return start, 0.0
    if plant.lift_straight > 0.0:
        return start, rate * length / (tall * plant.lift_straight)
    mass = plant.density * length
    stiff, rising = tall / (mass * length * length), rate / mass
    behind = _BEHIND * (rising**2 / stiff**3) ** 0.2
    return start - behind / plant.length, _ARRIVES * (rising**3 / stiff**2) ** 0.2
