"""Gas of a chamber that fills and vents through its line by ISO 6358, in plain numbers."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.physics.gas import flow_shape, flow_shape_slope
from ringbalance.reduced_model.injection.dynamics import P, Record
from ringbalance.scene.platform.compiled import in_place, inlined

_LEAST_GAS: Final = 1e-3
"""Fraction of a chamber that liquid never takes from its gas."""
_AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure that counts as there."""
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
