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
u is the smaller of the quasi-steady velocities, as in the flow law.  In a primed tube p_c is the cavity's; in
an unprimed one it is the gas's, and falls to the cavity's as the flow carries the gas out.

The conditions are those of `reduced_model.tube.regime`, interpreted there and compiled here.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.physics.gas import flow_shape, flow_shape_slope
from ringbalance.reduced_model.injection.dynamics import PIECES, P, Record
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pieces.inverse import level_with_slope, root_of_velocity, velocity_under
from ringbalance.reduced_model.pieces.point import SIPHON, THERE, WAY_BACK
from ringbalance.reduced_model.tube import regime
from ringbalance.reduced_model.tube.regime import CLEARING, cleared, crest_margins, driving_pressure
from ringbalance.scene.platform.compiled import in_place, inlined

Four = tuple[float, float, float, float]
_SLOWEST_M_S: Final = 1e-150
"""Velocity below which the tube's loss is neglected, m/s."""
_SEPARATED: Final = int(Regime.SEPARATED)
_SLOW_FROUDE: Final = CLEARING[0]
_FAST_FROUDE: Final = CLEARING[1]
_HALF_CLEARED: Final = (_SLOW_FROUDE + _FAST_FROUDE) / 2
"""Froude number at which gas and cavity count the same."""


@in_place
def tabled(
    plant: Record, x: float, p: float, q: float, primed: bool, log_speed: float
) -> tuple[float, float, bool, bool]:
    """Flow by a law that gives velocities alone.

    Returns: velocity out of chamber 0, m/s, and its slope over x; true if the tube holds a column afterwards;
    true if the flow is separated at the crest.
    """
    # The tables count from the chamber with gas.
    back = q > p
    which = (0 if max(p, q) > 0.0 else 2) + (0 if primed else 1)
    driven = plant.total - x if back else x
    position = (driven - plant.lowest_fill) * plant.cells_per_fill
    cell = min(max(math.floor(position), 0), PIECES - 1)
    c = plant.rows[which * PIECES + cell]
    t = min(max(position - cell, 0.0), 1.0)
    square = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    faster = math.exp(log_speed)
    speed = math.copysign(math.sqrt(abs(square)), square) * faster
    slope = (c[1] + t * (2.0 * c[2] + 3.0 * t * c[3])) * plant.cells_per_fill
    slope *= 0.5 * faster * faster / max(abs(speed), _SLOWEST_M_S)
    return -speed if back else speed, slope, c[4] > 0.0, c[5] == _SEPARATED


@inlined
def crest_table(plant: Record, direction: int) -> int:
    """Row of the loss up to the crest."""
    return THERE if direction > 0 else int(plant.numbers[WAY_BACK])


@in_place
def quasi_steady(plant: Record, which: int, pressure: float, log_speed: float) -> float:
    """Quasi-steady velocity, m/s, under a pressure above zero; `log_speed`: ln of a factor on it."""
    return velocity_under(plant.numbers, plant.rows, which, pressure) * math.exp(log_speed)


@inlined
def law_speed(speed: float, log_speed: float) -> float:
    """Velocity of the law without the factor exp(`log_speed`), m/s."""
    return abs(speed) * math.exp(-log_speed)


@inlined
def tube_loss(plant: Record, which: int, speed: float, of_law: float) -> tuple[float, float]:
    """Pressure loss of a velocity over rho, m^2/s^2, and its derivative by the velocity, m/s."""
    if abs(speed) < _SLOWEST_M_S:
        return 0.0, 0.0
    root, growth = root_of_velocity(plant.root_cells[which], plant.roots, plant.rows, which, of_law)
    fourth = root * root * root * root
    loss = fourth * fourth / plant.density
    return math.copysign(loss, speed), 8.0 * loss / root / growth * (of_law / abs(speed))


@inlined
def hydrostatic(plant: Record, x: float) -> tuple[float, float]:
    """P(x), not below zero, Pa, and its slope."""
    value, slope = level_with_slope(plant.numbers, plant.rows, x)
    return max(value, 0.0), slope if value > 0.0 else 0.0


@inlined
def ends(plant: Record, x: float, opposite: float, p: float, q: float, direction: int) -> Four:
    """Gas pressures and hydrostatic pressures upstream and downstream, Pa, from fills and gauge pressures."""
    near, far = hydrostatic(plant, x)[0], hydrostatic(plant, opposite)[0]
    if direction > 0:
        return plant.gas_factor * p, plant.gas_factor * q, near, far
    return plant.gas_factor * q, plant.gas_factor * p, far, near


@inlined
def _allowed(plant: Record, at: Four) -> bool:
    """True if the law lets liquid leave: a one-way law needs gas, or a level above the crest."""
    return bool(not plant.one_way or at[0] > plant.gas_off or at[2] - plant.column_pressure > at[1])


@in_place
def can_flow(plant: Record, at: Four, primed: bool) -> bool:
    """True if liquid flows, by the law's conditions."""
    return bool(_allowed(plant, at) and regime.can_flow(plant, at, primed))


@in_place
def holds_at_rest(plant: Record, at: Four, primed: bool) -> bool:
    """True if a column in which nothing flows stays; a one-way law has none."""
    return bool(not plant.one_way and regime.holds_at_rest(plant, at, primed))


@inlined
def _clearing_slope(plant: Record, spill: float) -> float:
    """Derivative of `cleared` by the spilling liquid's velocity."""
    if plant.froude_velocity == 0.0:
        return 0.0
    part = (spill / plant.froude_velocity - _SLOW_FROUDE) / (_FAST_FROUDE - _SLOW_FROUDE)
    part = min(max(part, 0.0), 1.0)
    return float(6.0 * part * (1.0 - part) / ((_FAST_FROUDE - _SLOW_FROUDE) * plant.froude_velocity))


@inlined
def _crest_margin(
    plant: Record, at: Four, direction: int, primed: bool, log_speed: float
) -> tuple[float, float, float]:
    """Pressure p that drives a separated column, Pa; fraction c of the gas over the crest that is carried
    out; dp/dg - (1 - c), g the margin over gas."""
    primed_margin, gas_margin = crest_margins(plant, at)
    if primed:
        return primed_margin, 1.0, 0.0
    if gas_margin <= 0.0:
        return gas_margin, 0.0, 0.0
    which = crest_table(plant, direction)
    spill = quasi_steady(plant, which, gas_margin, log_speed)
    carried, slope = cleared(plant, spill), _clearing_slope(plant, spill)
    more = max(primed_margin - gas_margin, 0.0)
    if slope > 0.0:
        slope /= plant.density * tube_loss(plant, which, spill, law_speed(spill, log_speed))[1]
    return gas_margin + carried * more, carried, slope * more


@in_place
def _directed(plant: Record, at: Four, direction: int, primed: bool, log_speed: float) -> tuple[float, bool]:
    """Velocity of flow in one direction, and true if the column is separated."""
    if not can_flow(plant, at, primed):
        return 0.0, False
    full = quasi_steady(plant, SIPHON, driving_pressure(plant, at), log_speed)
    if not plant.crest:
        return full, False
    margin = _crest_margin(plant, at, direction, primed, log_speed)[0]
    broken = quasi_steady(plant, crest_table(plant, direction), margin, log_speed)
    return min(broken, full), broken < full


@in_place
def steady(
    plant: Record, x: float, opposite: float, p: float, q: float, primed: bool, log_speed: float
) -> tuple[float, bool]:
    """Velocity without inertia, m/s out of chamber 0, and true if the column is separated."""
    if plant.tabled:
        flow = tabled(plant, x, p, q, primed, log_speed)
        return flow[0], flow[3]
    ahead = _directed(plant, ends(plant, x, opposite, p, q, 1), 1, primed, log_speed)
    if ahead[0] > 0.0:
        return ahead
    back = _directed(plant, ends(plant, x, opposite, p, q, -1), -1, primed, log_speed)
    return -back[0], back[1]


@in_place
def holds(
    plant: Record, x: float, opposite: float, p: float, q: float, primed: bool, log_speed: float
) -> bool:
    """True if the tube holds a column after the flow without inertia, or at rest."""
    if plant.tabled:
        return tabled(plant, x, p, q, primed, log_speed)[2]
    at = ends(plant, x, opposite, p, q, 1)
    if can_flow(plant, at, primed):
        return _fills(plant, at, 1, primed, log_speed)
    reverse = (at[1], at[0], at[3], at[2])
    if can_flow(plant, reverse, primed):
        return _fills(plant, reverse, -1, primed, log_speed)
    return holds_at_rest(plant, at, primed)


@in_place
def clearance(plant: Record, at: Four, direction: int, log_speed: float) -> float:
    """Pressure over rho in excess of that of the flow that clears an unprimed crest of gas, m^2/s^2."""
    half = _HALF_CLEARED * plant.froude_velocity
    if half == 0.0:
        return math.inf
    of_law = law_speed(half, log_speed)
    spills = (
        crest_margins(plant, at)[1] / plant.density
        - tube_loss(plant, crest_table(plant, direction), half, of_law)[0]
    )
    flows = driving_pressure(plant, at) / plant.density - tube_loss(plant, SIPHON, half, of_law)[0]
    return float(min(spills, flows))


@in_place
def _fills(plant: Record, at: Four, direction: int, primed: bool, log_speed: float) -> bool:
    """True if a column that flows is continuous: gas carried out, no cavity open to the port."""
    if not plant.crest:
        return True
    which, driving = crest_table(plant, direction), driving_pressure(plant, at)
    if not primed and clearance(plant, at, direction, log_speed) <= 0.0:
        return False
    if at[3] >= plant.port_pressure:
        return True
    margin = _crest_margin(plant, at, direction, primed, log_speed)[0]
    broken = quasi_steady(plant, which, margin, log_speed)
    return broken >= quasi_steady(plant, SIPHON, driving, log_speed)


@inlined
def accelerations(
    plant: Record, at: Four, speed: float, direction: int, primed: bool, log_speed: float
) -> tuple[float, float, float, float, float, float]:
    """Accelerations of the full column and of the separated one along their direction, m/s^2.

    The speed may be just below zero, within the step that brings the column to rest.
    Returns: the two, then the derivatives of the smaller one by the speed, by the pressure upstream (of gas
    or liquid), by the gas pressure downstream and by the liquid's pressure there.
    """
    of_law = law_speed(speed, log_speed)
    loss, slope = tube_loss(plant, SIPHON, speed, of_law)
    length, covered = plant.length, 1.0 if at[3] > plant.port_pressure else 0.0
    per, each = 1.0 / length, 1.0 / (plant.density * length)
    full = driving_pressure(plant, at) * each - loss * per
    if not plant.crest:
        return full, math.inf, -slope * per, each, -each, -each * covered
    fraction = plant.crest_end if direction > 0 else plant.return_crest_end
    margin, carried, more = _crest_margin(plant, at, direction, primed, log_speed)
    upper_loss, upper_slope = tube_loss(plant, crest_table(plant, direction), speed, of_law)
    per_upper, each_upper = 1.0 / (fraction * length), 1.0 / (plant.density * fraction * length)
    broken = margin * each_upper - upper_loss * per_upper
    if full <= broken:
        return full, broken, -slope * per, each, -each, -each * covered
    by_cavity, by_gas, by_far = crest_slopes(plant, at)
    gas = 1.0 - carried + more
    by_down = -each_upper * (gas * by_gas + carried * by_cavity)
    by_up, by_liquid = each_upper * (gas + carried), -each_upper * gas * by_far
    return full, broken, -upper_slope * per_upper, by_up, by_down, by_liquid


@inlined
def crest_slopes(plant: Record, at: Four) -> tuple[float, float, float]:
    """Derivatives of the pressures over the crest: of cavity and gas by the downstream gas pressure, and of
    gas by the downstream liquid's pressure."""
    is_open = at[3] < plant.port_pressure
    by_cavity = 1.0 if is_open else plant.released if at[1] > plant.vapour_pressure else 0.0
    cavity_margin, gas_margin = crest_margins(plant, at)
    if gas_margin == cavity_margin:
        return by_cavity, by_cavity, 0.0
    return by_cavity, 1.0, 0.0 if is_open or not plant.trapped else 1.0


@in_place
def open_to_gas(plant: Record, at: Four) -> bool:
    """True if the upstream port is open to gas, or if the law rules out flow without gas pressure."""
    if plant.tabled:
        return False
    return bool(at[2] < plant.port_pressure or not _allowed(plant, at))


_LEAST_GAS: Final = 1e-3
"""Smallest fraction of a chamber's volume that counts as gas."""
_AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure at which it counts as having reached it."""
_flow_shape: Final = inlined(flow_shape)
_flow_shape_slope: Final = inlined(flow_shape_slope)


@inlined
def gas_volume(plant: Record, x: float) -> float:
    """Volume of the gas that belongs to a chamber of fill x: (1 - x) V and the dead volume, m^3."""
    return float(max(1.0 - x, _LEAST_GAS) * plant.chamber_volume + plant.dead_volume)


@inlined
def end_pressure(plant: Record, is_open: bool) -> float:
    """Absolute pressure that a gas tends to, Pa."""
    return float(plant.ambient_pressure + (plant.gas_pressure if is_open else 0.0))


@inlined
def line_rates(
    plant: Record, pressure: float, content: float, volume: float, growth: float, is_open: bool
) -> tuple[float, float, float, float, float, float, float, float]:
    """dp/dt (Pa/s) and d(m R)/dt (W/K) of a chamber's gas that fills from the supply or vents.

    `content` is m R = p V/T, J/K; `growth` is dV/dt.
    Returns: the two, then the derivatives of each by pressure, volume and content.
    Source: ISO 6358-1 for the mass flow, as in `physics.gas`; first law for the chamber's gas.
    """
    outside, temperature, varies = end_pressure(plant, is_open), plant.temperature, 0.0
    if pressure <= outside:
        ratio, scale = pressure / outside, plant.passing
        shape = _flow_shape(ratio, plant.critical_ratio)
        flow = scale * outside * shape
        by_pressure = scale * _flow_shape_slope(ratio, plant.critical_ratio, shape)
    else:
        ratio, scale = outside / pressure, -plant.passing
        if plant.heat_capacity_ratio > 1.0:
            # A trial step may empty a chamber of its gas; such a step is rejected.
            temperature, varies = pressure * volume / max(content, 1e-9 * volume), 1.0
            scale *= math.sqrt(temperature / plant.temperature)
        shape = _flow_shape(ratio, plant.critical_ratio)
        flow = scale * pressure * shape
        slope = _flow_shape_slope(ratio, plant.critical_ratio, shape)
        by_pressure = scale * (shape - ratio * slope)
    # A venting gas has the temperature p V/(m R), and its flow is proportional to the root of that.
    kappa, half = plant.heat_capacity_ratio, 0.5 * varies * flow
    per = kappa / volume
    rise, gain = (flow - pressure * growth) * per, flow / temperature
    return (
        rise,
        gain,
        (by_pressure + half / pressure - growth) * per,
        (kappa * half / volume - rise) / volume,
        -kappa * half / (volume * content),
        (by_pressure - half / pressure) / temperature,
        -half / (volume * temperature),
        half / (content * temperature),
    )


@in_place
def near_end(plant: Record, motion: Record, chamber: int) -> bool:
    """True if a gas has reached its end pressure."""
    end = end_pressure(plant, motion.valve_0 > 0 if chamber == 0 else motion.valve_1 > 0)
    return bool(abs(motion.state[P + chamber] - end) <= _AT_REST * end)
