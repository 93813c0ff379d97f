"""Gas of a chamber that fills and vents through its line by ISO 6358, in plain numbers."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.physics.gas import LAMINAR_RATIO, flow_shape, flow_shape_slope
from ringbalance.reduced_model.injection.dynamics import P, Record, X
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import in_place, inlined

_LEAST_GAS: Final = 1e-3
"""Fraction of a chamber that liquid never takes from its gas."""
_AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure that counts as there."""
_STRAIGHT: Final = 1e-5
"""Below which tanh, tan and their inverses are straight to round-off."""
_flow_shape: Final = inlined(flow_shape)
_flow_shape_slope: Final = inlined(flow_shape_slope)


@inlined
def gas_volume(plant: Record, x: float) -> float:
    """Volume of the gas that belongs to a chamber of fill x: (1 - x) V and the dead volume, m^3."""
    return float(max(1.0 - x, _LEAST_GAS) * plant.chamber_volume + plant.dead_volume)


@inlined
def end_pressure(plant: Record, is_open: bool) -> float:
    """Absolute, that a gas tends to, Pa."""
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
            # A trial step may empty a chamber of its gas; such a step is thrown away.
            temperature, varies = pressure * volume / max(content, 1e-9 * volume), 1.0
            scale *= math.sqrt(temperature / plant.temperature)
        shape = _flow_shape(ratio, plant.critical_ratio)
        flow = scale * pressure * shape
        slope = _flow_shape_slope(ratio, plant.critical_ratio, shape)
        by_pressure = scale * (shape - ratio * slope)
    # A gas that vents has the temperature p V/(m R), and its flow goes with the root of it.
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
    """Whether a gas has the pressure that it tends to."""
    end = end_pressure(plant, motion.valve_0 > 0 if chamber == 0 else motion.valve_1 > 0)
    return bool(abs(motion.state[P + chamber] - end) <= _AT_REST * end)


@in_place
def rest_after(plant: Record, motion: Record, h: float, w: FloatArray, row: int) -> None:
    """State after a time with the liquid at rest, of isothermal gases, into a row."""
    for i in range(8):
        w[row, i] = motion.state[i]
    for chamber in range(2):
        p, is_open = w[row, P + chamber], motion.valve_0 > 0 if chamber == 0 else motion.valve_1 > 0
        volume = gas_volume(plant, w[row, X] if chamber == 0 else plant.total - w[row, X])
        time, end = h * plant.passing / volume, end_pressure(plant, is_open)
        if p < end:
            w[row, P + chamber] = end * _ratio_after(p / end, time, plant.critical_ratio, False)
        elif p > end:
            w[row, P + chamber] = end / _ratio_after(end / p, time, plant.critical_ratio, True)
        w[row, P + 2 + chamber] = w[row, P + chamber] * volume / plant.temperature


@in_place
def _ratio_after(ratio: float, time: float, critical_ratio: float, vents: bool) -> float:
    """Pressure ratio r, downstream over upstream, of a constant volume after a time in units of its tau.

    The gas keeps its temperature.  Filling, dr/dt = phi(r); venting, dr/dt = r phi(r); tau = V/(C p_0)
    sqrt(T_0/T), as in `physics.gas`, which has the times between two pressures.  Along the ellipse
    r = b + (1 - b) sin q with dq/dt = 1/(1 - b), or with y = tan(q/2) and c = 1 - b while venting
        dy/ds = (b y^2 + 2 c y + b)/2,  s = t/c,
    whose solution is a ratio of two linear functions of y(0).
    """
    b, r, left = critical_ratio, ratio, time
    if r < b:
        needed = math.log(b / r) if vents else b - r
        if left <= needed:
            return r * math.exp(left) if vents else r + left
        r, left = b, left - needed
    c, last = 1.0 - b, max(LAMINAR_RATIO, b)
    if r < last:
        ending = math.asin((last - b) / c)
        angle = math.asin((r - b) / c)
        if not vents:
            needed = c * (ending - angle)
            if left <= needed:
                return b + c * math.sin(angle + left / c)
        else:
            y, end = math.tan(angle / 2.0), math.tan(ending / 2.0)
            part = (end - y) / (c * y + b + end * (b * y + c))
            needed = c * _moebius_time(part, c * c - b * b)
            if left <= needed:
                part = _moebius_part(left / c, c * c - b * b)
                y = (y + part * (c * y + b)) / (1.0 - part * (b * y + c))
                return b + c * 2.0 * y / (1.0 + y * y)
        r, left = last, left - needed
    pace = _flow_shape(last, b) / (1.0 - last)
    rest = (1.0 - r) / (r if vents else 1.0) * math.exp(-min(left * pace, 700.0))
    return 1.0 / (1.0 + rest) if vents else 1.0 - rest


@in_place
def _moebius_part(time: float, square: float) -> float:
    """tanh(w s/2)/w with w^2 = `square`, which may be negative."""
    root = math.sqrt(abs(square))
    if root * time < _STRAIGHT:
        return time / 2.0
    return math.tanh(root * time / 2.0) / root if square > 0.0 else math.tan(root * time / 2.0) / root


@in_place
def _moebius_time(part: float, square: float) -> float:
    """s of the above."""
    root = math.sqrt(abs(square))
    if root * part < _STRAIGHT:
        return 2.0 * part
    return 2.0 * (math.atanh(root * part) if square > 0.0 else math.atan(root * part)) / root
