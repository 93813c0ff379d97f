"""Liquid that the driving gas carries off as vapour."""

from __future__ import annotations

from typing import Final

from ringbalance.physics.gas import NORMAL_PRESSURE_PA, NORMAL_TEMPERATURE_K
from ringbalance.scene.liquids import COLDEST_WATER_K, HOTTEST_WATER_K, liquid_at
from ringbalance.scene.models import Scene

_VAPOUR_CONSTANT: Final = 461.5
"""R of water vapour, J/(kg K)."""
_WATER: Final = "water"


def carried_off(scene: Scene) -> float | None:
    """Mass of liquid that leaves with the gas of a chamber, at most, kg per normal m^3 of dry gas.

        X = e_s(T)/(p_a - e_s(T)) - phi e_s(T_g)/(p_1 - phi e_s(T_g)) moles per mole of gas:
    gas let off is saturated at most, at the liquid's temperature and ambient pressure, and brings the vapour
    of the supply, phi its relative humidity at its own pressure p_1 and temperature.
    Returns: zero for a supply that brings more; None for any liquid but water, whose vapour is not known.
    Source: ideal gases; e_s by IAPWS-95, `scene.liquids`.
    """
    gas, leaves = scene.gas, scene.liquid.vapour_pressure
    if scene.liquid.name.casefold() != _WATER:
        return None
    temperature = min(max(gas.temperature, COLDEST_WATER_K), HOTTEST_WATER_K)
    enters = (gas.relative_humidity or 0.0) * liquid_at(name=_WATER, temperature=temperature).vapour_pressure
    supply = gas.pressure + gas.ambient_pressure
    net = leaves / (gas.ambient_pressure - leaves) - enters / (max(supply, 2 * enters) - enters)
    return max(net, 0.0) * NORMAL_PRESSURE_PA / (_VAPOUR_CONSTANT * NORMAL_TEMPERATURE_K)
