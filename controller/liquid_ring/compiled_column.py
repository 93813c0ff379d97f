"""Forces on the liquid column in one tube, and the gas of its two chambers, in plain numbers.

Chambers are numbered 0 (the positive side of the pair's axis) and 1; "direction" is +1 for flow out of
chamber 0 and -1 for flow out of chamber 1.  Pressures of the gas are gauge, Pa, at the place of measurement.

A full column of length L moves by
    rho L du/dt = p_d - (k + 1) rho u^2/2,
p_d the driving pressure, and its crest pressure is
    p_m = p_A + P_A - D_m - (alpha + k_up) rho u^2/2 - rho L_up du/dt.
Where that would fall below the pressure p_c of what lies over the crest the column separates there, and only
the liquid upstream of it, of length L_up, is accelerated by the upstream chamber:
    rho L_up du/dt = p_A - p_c + P_A - D_m - (alpha + k_up) rho u^2/2.
With a_f and a_s for the two accelerations, p_m - p_c = rho L_up (a_s - a_f): the column is full exactly where
a_f is the smaller one, so du/dt = min(a_f, a_s).  It is continuous across the change, and where it vanishes
u is the smaller of the quasi-steady velocities, as in the flow law.  Over a primed tube p_c is the cavity's;
an unprimed one spills with gas there, as far as the law has it carried out.

The conditions are those of `reduced_model.tube.regime`, number by number; a test compares the two.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.liquid_ring.records import HEAD, HYDROSTATIC, RETURN_CREST, TO_CREST, Record
from ringbalance.reduced_model.tube.regime import CLEARING

_SLOWEST: Final = 1e-150
"""m/s, below which the tube's loss is neglected."""
_NEWTON_STEPS: Final = 5
_SLOW_FROUDE: Final = CLEARING[0]
_FAST_FROUDE: Final = CLEARING[1]


@compiled
def _table(plant: Record, which: int, x: float) -> float:
    """Value of a table; it continues straight beyond its ends."""
    place = (x - plant.table_start[which]) / plant.table_step[which]
    cell = min(max(math.floor(place), 0), plant.pieces[which] - 1)
    c = plant.cells[which, cell]
    t = place - cell
    held = min(max(t, 0.0), 1.0)
    inside = c[0] + held * (c[1] + held * (c[2] + held * (c[3] + held * (c[4] + held * c[5]))))
    if held == t:
        return float(inside)
    slope = c[1] + held * (2 * c[2] + held * (3 * c[3] + held * (4 * c[4] + held * 5 * c[5])))
    return float(inside + (t - held) * slope)


@compiled
def _inverse(plant: Record, which: int, y: float) -> float:
    """The x of a value, to round-off, for a table that grows from node to node."""
    low, high = 0, plant.pieces[which] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if plant.cells[which, middle, 0] < y:
            low = middle
        else:
            high = middle - 1
    c = plant.cells[which, low]
    rise = c[1] + c[2] + c[3] + c[4] + c[5]
    t = min(max((y - c[0]) / rise, 0.0), 1.0)
    found, slope = c[0], c[1]
    for step in range(_NEWTON_STEPS + 1):
        found = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))))
        slope = c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])))
        if step < _NEWTON_STEPS:
            t = min(max(t + (y - found) / slope, 0.0), 1.0)
    return float(plant.table_start[which] + plant.table_step[which] * (low + t + (y - found) / slope))


@compiled
def _crest_table(direction: int) -> int:
    return TO_CREST if direction > 0 else RETURN_CREST


@compiled
def _velocity(plant: Record, which: int, pressure: float, log_speed: float) -> float:
    """Quasi-steady velocity, m/s, under a pressure above zero; `log_speed`: of a factor on it."""
    return math.exp(_inverse(plant, which, math.log(pressure / plant.density)) + log_speed)


@compiled
def _loss(plant: Record, which: int, log_velocity: float) -> float:
    """Pressure that a velocity loses, m^2/s^2 times rho, over rho."""
    return math.exp(_table(plant, which, log_velocity))


@compiled
def ends(
    plant: Record, x: float, opposite: float, p: float, q: float, direction: int
) -> tuple[float, float, float, float]:
    """Gas pressures and hydrostatic pressures upstream and downstream, Pa, from fills and gauge pressures."""
    near, far = max(_table(plant, HYDROSTATIC, x), 0.0), max(_table(plant, HYDROSTATIC, opposite), 0.0)
    if direction > 0:
        return plant.gas_factor * p, plant.gas_factor * q, near, far
    return plant.gas_factor * q, plant.gas_factor * p, far, near


@compiled
def _driving(plant: Record, at: tuple[float, float, float, float]) -> float:
    return float(at[0] - at[1] + at[2] - max(at[3], plant.port_pressure))


@compiled
def _allowed(plant: Record, at: tuple[float, float, float, float], primed: bool) -> bool:
    """Without a crest liquid flows only while there is gas; back against it only in a primed tube."""
    if plant.one_way:
        return bool(at[0] > plant.gas_off)
    return bool(plant.crest or at[0] > plant.gas_off or (at[1] > plant.gas_off and primed))


@compiled
def _margins(plant: Record, at: tuple[float, float, float, float]) -> tuple[float, float]:
    """Crest pressure at rest less that of the cavity of a primed tube, and less that of gas there, Pa."""
    low = at[1] if at[3] < plant.port_pressure else plant.vapour_pressure
    high = low if plant.released == 0.0 else max(at[1], low)
    cavity = low + plant.released * (high - low)
    gas = at[1] + (max(at[3] - plant.port_pressure, 0.0) if plant.trapped else 0.0)
    resting = at[0] + at[2] - plant.column_pressure
    return resting - cavity, resting - max(gas, cavity)


@compiled
def can_flow(plant: Record, at: tuple[float, float, float, float], primed: bool) -> bool:
    """Whether liquid flows: port covered, driving pressure positive, crest passed."""
    if not _allowed(plant, at, primed) or at[2] < plant.port_pressure or _driving(plant, at) <= 0.0:
        return False
    if not plant.crest:
        return True
    primed_margin, gas_margin = _margins(plant, at)
    return bool((primed_margin if primed and not plant.one_way else gas_margin) > 0.0)


@compiled
def holds_at_rest(plant: Record, at: tuple[float, float, float, float], primed: bool) -> bool:
    """Whether a column in which nothing flows is still there: an allowed one, or one in exact balance."""
    if plant.one_way or not primed:
        return False
    if not plant.crest:
        return _allowed(plant, at, True)
    covered = at[2] >= plant.port_pressure
    return bool(covered and _driving(plant, at) == 0.0 and _margins(plant, at)[0] > 0.0)


@compiled
def _cleared(plant: Record, spill: float) -> float:
    """Fraction of the way from gas to cavity pressure over the crest, by the spilling liquid's velocity."""
    if plant.froude_velocity == 0.0:
        return 1.0
    part = (spill / plant.froude_velocity - _SLOW_FROUDE) / (_FAST_FROUDE - _SLOW_FROUDE)
    part = min(max(part, 0.0), 1.0)
    return float(part * part * (3.0 - 2.0 * part))


@compiled
def _crest_margin(
    plant: Record,
    at: tuple[float, float, float, float],
    direction: int,
    primed: bool,
    log_speed: float,
) -> tuple[float, float]:
    """What drives a separated column, Pa, and how far the gas over the crest is carried out."""
    primed_margin, gas_margin = _margins(plant, at)
    if primed:
        return primed_margin, 1.0
    if gas_margin <= 0.0:
        return gas_margin, 0.0
    cleared = _cleared(plant, _velocity(plant, _crest_table(direction), gas_margin, log_speed))
    return gas_margin + cleared * max(primed_margin - gas_margin, 0.0), cleared


@compiled
def _directed(
    plant: Record,
    at: tuple[float, float, float, float],
    direction: int,
    primed: bool,
    log_speed: float,
) -> tuple[float, bool, bool]:
    """Velocity, whether separated, and whether the tube then holds a column; for flow in one direction."""
    if not can_flow(plant, at, primed):
        return 0.0, False, holds_at_rest(plant, at, primed)
    full = _velocity(plant, HEAD, _driving(plant, at), log_speed)
    if not plant.crest:
        return full, False, True
    margin, cleared = _crest_margin(plant, at, direction, primed and not plant.one_way, log_speed)
    broken = _velocity(plant, _crest_table(direction), margin, log_speed)
    covered = at[3] >= plant.port_pressure
    swept = cleared > 0.5 and _cleared(plant, full) > 0.5
    keeps = (primed or swept) and (broken >= full or covered)
    return min(broken, full), broken < full, keeps


@compiled
def steady(
    plant: Record, x: float, opposite: float, p: float, q: float, primed: bool, log_speed: float
) -> tuple[float, bool, bool]:
    """Velocity without inertia, m/s out of chamber 0, whether separated, whether the tube holds a column."""
    ahead = _directed(plant, ends(plant, x, opposite, p, q, 1), 1, primed, log_speed)
    if ahead[0] > 0.0:
        return ahead
    back = _directed(plant, ends(plant, x, opposite, p, q, -1), -1, primed, log_speed)
    return (-back[0], back[1], back[2]) if back[0] > 0.0 else ahead


@compiled
def accelerations(
    plant: Record,
    at: tuple[float, float, float, float],
    speed: float,
    direction: int,
    primed: bool,
    log_speed: float,
) -> tuple[float, float]:
    """Of the full column and of the separated one, along their own direction, m/s^2; `speed` >= 0."""
    slow = speed < _SLOWEST
    log_velocity = 0.0 if slow else math.log(speed) - log_speed
    loss = 0.0 if slow else _loss(plant, HEAD, log_velocity)
    full = (_driving(plant, at) / plant.density - loss) / plant.length
    if not plant.crest:
        return full, math.inf
    fraction = plant.crest_end if direction > 0 else plant.return_crest_end
    loss = 0.0 if slow else _loss(plant, _crest_table(direction), log_velocity)
    margin = _crest_margin(plant, at, direction, primed, log_speed)[0]
    return full, (margin / plant.density - loss) / (fraction * plant.length)


@compiled
def open_to_gas(plant: Record, at: tuple[float, float, float, float]) -> bool:
    """Whether its liquid leaves the upstream port open, or flow is ruled out without gas."""
    return bool(at[2] < plant.port_pressure or not _allowed(plant, at, True))
