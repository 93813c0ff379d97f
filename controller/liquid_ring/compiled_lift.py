"""Liquid that is lifted in the tube before any of it passes the crest, in plain numbers.

In a tube that is not primed the liquid of the chamber that gives stands at that chamber's level, with the
gas of the other one over it.  Under gas its front, at the fraction s of the path, moves by
    rho s L du/dt = p_A - p_c + P_A - D(s) - K(s) rho u^2/2,    L ds/dt = u,
D(s) a column from the front to the outer wall, p_c the gas over the crest, K(s) = e K + (1 - e) K s/s_end
with K = alpha + k_up up to the crest's end s_end, and e the fraction of it lost at the entrance.  From s_end
on the flow law's column continues at the same velocity.

Liquid on the crest's circle is pulled to neither side.  What is there when the column parts is taken to drain
evenly: what was lifted to the middle of the crest falls back, what was lifted beyond it has passed.  Between
injections gas is taken to lie over the crest; legs on both sides of a cavity would stand somewhat higher.
While liquid is lifted the fill of the state is that of the chamber alone; `shown` is with the tube's share.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import in_place, inlined
from ringbalance.controller.liquid_ring.compiled_column import (
    crest_margins,
    crest_slopes,
    crest_table,
    ends,
    hydrostatic,
    law_log,
    quasi_steady,
    tube_loss,
)
from ringbalance.controller.liquid_ring.compiled_gas import gas_volume, line_rates
from ringbalance.controller.liquid_ring.records import P, Record, U, X

_STEPS: Final = 48
"""Of the rise of a leg before liquid passes the crest, at most half a radian of its oscillation each."""


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
    """Fraction of the path up to which liquid stands, with chamber 0 at a fill."""
    if not motion.lifting:
        return float(motion.front)
    return float(motion.front + motion.direction * (motion.started - x) / plant.hold_up)


@inlined
def shown(plant: Record, motion: Record, x: float) -> float:
    """Fill of chamber 0 with what the tube gives back to it."""
    if not motion.lifting:
        return x
    return float(motion.started - motion.direction * _passed(plant, motion, front(plant, motion, x)))


@inlined
def _passed(plant: Record, motion: Record, place: float) -> float:
    """Fill ratio that has passed with the front at a place, beyond the middle of the crest."""
    middle = (crest_start(plant, motion.direction) + crest_stop(plant, motion.direction)) / 2.0
    return float((max(place - middle, 0.0) - max(motion.front - middle, 0.0)) * plant.hold_up)


@in_place
def stands(plant: Record, motion: Record) -> tuple[float, float]:
    """Present `front`, and the fill that is `shown`."""
    return front(plant, motion, motion.state[X]), shown(plant, motion, motion.state[X])


@in_place
def resume(plant: Record, motion: Record, place: float) -> None:
    """The state of lifted liquid that `stands` at a place, from the fill that is shown."""
    motion.started = motion.state[X] + motion.direction * _passed(plant, motion, place)
    motion.state[X] = motion.started - motion.direction * (place - motion.front) * plant.hold_up


@inlined
def arrived(plant: Record, motion: Record, x: float) -> float:
    """How far the front is past the crest's end, a fraction of the path."""
    return front(plant, motion, x) - crest_stop(plant, motion.direction)


@inlined
def _leg(plant: Record, place: float, direction: int) -> tuple[float, float]:
    """D_m - D(s), Pa, and its slope."""
    start, tall = crest_start(plant, direction), plant.column_pressure - plant.port_pressure
    outward, straight = 1.0 - place / start, plant.lift_straight
    if outward <= 0.0:
        return 0.0, 0.0
    height = tall * outward * (straight + (1.0 - straight) * outward)
    return height, -tall / start * (straight + 2.0 * (1.0 - straight) * outward)


@inlined
def lift_rates(
    plant: Record, motion: Record, at: tuple[float, float, float, float], x: float, speed: float
) -> tuple[float, float, float, float, float, float]:
    """Acceleration along the direction, m/s^2; by x through the front, against the direction; then as
    `accelerations` by the speed, the pressure upstream, the gas downstream and the liquid there."""
    place = front(plant, motion, x)
    found, by_place, by_speed = _acceleration(plant, motion, place, speed, crest_margins(plant, at)[1])
    each = 1.0 / (plant.density * place * plant.length)
    _, by_gas, by_far = crest_slopes(plant, at)
    return found, -by_place / plant.hold_up, by_speed, each, -each * by_gas, -each * by_far


@inlined
def _acceleration(
    plant: Record, motion: Record, place: float, speed: float, crest: float
) -> tuple[float, float, float]:
    """Of the front along the direction, m/s^2, and its slopes by place and by speed.

    Args: `crest`: what drives liquid at the crest, p_A - p_c + P_A - D_m, Pa.
    """
    direction, rho, entrance = motion.direction, plant.density, plant.lift_entrance
    height, slope = _leg(plant, place, direction)
    along = (1.0 - entrance) / crest_stop(plant, direction)
    share, length = entrance + along * place, place * plant.length
    loss, loss_slope = tube_loss(plant, crest_table(direction), speed, law_log(speed, motion.log_speed))
    found = ((crest + height) / rho - share * loss) / length
    return found, (slope / rho - along * loss) / length - found / place, -share * loss_slope / length


@in_place
def lift_speed(plant: Record, motion: Record, at: tuple[float, float, float, float], x: float) -> float:
    """Velocity of the front without inertia, m/s."""
    direction, place = motion.direction, front(plant, motion, x)
    margin = crest_margins(plant, at)[1] + _leg(plant, place, direction)[0]
    if margin <= 0.0:
        return 0.0
    share = plant.lift_entrance + (1.0 - plant.lift_entrance) * place / crest_stop(plant, direction)
    return quasi_steady(plant, crest_table(direction), margin / share, motion.log_speed)


@in_place
def lift_push(plant: Record, motion: Record, x: float, p: float, q: float) -> float:
    """Acceleration of the front from rest, m/s^2; pressures absolute."""
    ambient = plant.ambient_pressure
    at = ends(plant, x, plant.total - x, p - ambient, q - ambient, motion.direction)
    return lift_rates(plant, motion, at, x, 0.0)[0]


@in_place
def set_out(plant: Record, motion: Record) -> None:
    """Where the front of liquid that begins to move stands, and its velocity; a primed tube has none."""
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
    """Fraction of the path where the leg stands as flow over the crest becomes possible, and velocity, m/s.

    At the level under a gas that is there at once; under one that a line fills the leg has risen with it.
    """
    direction, x = motion.direction, motion.state[X]
    own = x if direction > 0 else plant.total - x
    below = plant.column_pressure - hydrostatic(plant, own)[0]
    # An entrance has the inertia of about a bore's length.
    shortest = math.sqrt(4.0 / math.pi * plant.tube_area) / plant.length
    level = max(_balance(plant, below, direction), shortest)
    if not plant.line or level >= crest_start(plant, direction):
        return level, 0.0
    chamber, volume = 0 if direction > 0 else 1, gas_volume(plant, own)
    if plant.inertia:
        return _risen(plant, motion, level, motion.state[P + chamber], volume)
    # Without inertia it is there at once, but no earlier than an even pressure would bring it.
    gauge = motion.state[P + chamber] - plant.ambient_pressure
    time = gauge * volume / (plant.passing * (plant.gas_pressure + plant.ambient_pressure))
    way = gauge * time * time / (6.0 * plant.density * level * plant.length * plant.length)
    return min(level + way, crest_start(plant, direction)), 0.0


@inlined
def _balance(plant: Record, below: float, direction: int) -> float:
    """Fraction of the path up to which a leg stands whose pressure is so far below the crest's, Pa."""
    part, straight = below / (plant.column_pressure - plant.port_pressure), plant.lift_straight
    part = min(max(part, 0.0), 1.0)
    root = straight + math.sqrt(straight * straight + 4.0 * (1.0 - straight) * part)
    return float(crest_start(plant, direction) * (1.0 - (2.0 * part / root if part > 0.0 else 0.0)))


@in_place
def _risen(plant: Record, motion: Record, level: float, now: float, volume: float) -> tuple[float, float]:
    """Front and velocity of a leg that the gas of a line has driven from the level up to its pressure `now`.

    rho s L u' = p(t) - p_c + P_A - D(s) - K(s) rho u^2/2 by Runge and Kutta's method, from the ambient
    pressure on, p(t) by the line.  Of a slow gas the last 24 radians of the leg's oscillation at the level
    do: before them it follows its balance, as its loss damps what the start has set off.
    """
    direction, ambient, x = motion.direction, plant.ambient_pressure, motion.state[X]
    gas = motion.state[P] - ambient, motion.state[P + 1] - ambient
    crest = crest_margins(plant, ends(plant, x, plant.total - x, gas[0], gas[1], direction))[1]
    stiff = -_leg(plant, level, direction)[1]
    swing = math.sqrt(stiff / (plant.density * level)) / plant.length
    begin = max(now - 0.5 * _STEPS / swing * _filling(plant, now, volume), ambient)
    step, place, speed = (now - begin) / _STEPS, level, 0.0
    if step <= 0.0:
        return level, 0.0
    if begin > ambient:
        place = max(_balance(plant, now - begin - crest, direction), level)
        rate, slope = _filling(plant, begin, volume), -_leg(plant, place, direction)[1]
        # From rest at the ambient pressure on.
        begun = min(swing * (begin - ambient) / rate, 1.0)
        speed = begun * rate * plant.length / slope if slope > 0.0 else 0.0
    for number in range(_STEPS):
        pressure = begin + number * step
        time = step / _filling(plant, pressure + 0.5 * step, volume)
        place, speed = _kutta(plant, motion, place, speed, crest + pressure - now, step, time)
    return min(max(place, level), crest_stop(plant, direction)), max(speed, 0.0)


@inlined
def _filling(plant: Record, pressure: float, volume: float) -> float:
    """dp/dt of a chamber's gas under the open valve, Pa/s; how much gas it holds does not matter to that."""
    return max(line_rates(plant, pressure, 1.0, volume, 0.0, True)[0], 1e-300)


@inlined
def _kutta(
    plant: Record, motion: Record, place: float, speed: float, crest: float, growth: float, time: float
) -> tuple[float, float]:
    """Place and speed after a step of time, s, in which the pressure grows evenly, Pa."""
    per = 1.0 / plant.length
    a1 = _acceleration(plant, motion, place, speed, crest)[0]
    u2 = speed + 0.5 * time * a1
    half = crest + 0.5 * growth
    a2 = _acceleration(plant, motion, place + 0.5 * time * speed * per, u2, half)[0]
    u3 = speed + 0.5 * time * a2
    a3 = _acceleration(plant, motion, place + 0.5 * time * u2 * per, u3, half)[0]
    u4 = speed + time * a3
    a4 = _acceleration(plant, motion, place + time * u3 * per, u4, crest + growth)[0]
    moved = time / 6.0 * (speed + 2.0 * u2 + 2.0 * u3 + u4) * per
    return place + moved, speed + time / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
