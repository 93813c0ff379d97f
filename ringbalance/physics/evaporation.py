"""Liquid that the driving gas carries off as vapour, and the cold that both leave."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from ringbalance.physics.gas import NORMAL_PRESSURE_PA, NORMAL_TEMPERATURE_K
from ringbalance.scene.liquids import COLDEST_WATER_K, HOTTEST_WATER_K, liquid_at
from ringbalance.scene.models import Scene

_VAPOUR_CONSTANT: Final = 461.5
"""R of water vapour, J/(kg K)."""
_WATER: Final = "water"
_LATENT_HEAT: Final = 2.501e6
"""J/kg, of water at 0 degC, where it is largest."""
_AIR_CONDUCTIVITY: Final = 0.025
"""W/(m K), of air at 15 degC."""
_AIR_VISCOSITY_M2_S: Final = 1.5e-5
"""m^2/s, kinematic, likewise."""


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


class ExhaustCold(NamedTuple):
    """Cold that the gas of holding leaves in the liquid, at most."""

    power: float
    """W."""
    drop: float
    """Fall of the liquid's temperature, K."""
    viscosity: float
    """Relative rise of its viscosity."""


def exhaust_cold(scene: Scene, *, gas_per_hour: float) -> ExhaustCold | None:
    """Upper bound of the cold by expansion and evaporation; None for any liquid but water.

    Gas that is let off at the liquid's temperature takes V (p_1 - p_a) of heat, which the filling that gives
    as much back is taken not to return; the vapour takes its latent heat; the Joule-Thomson effect of the
    valve, some 2 % of the former, is left out.  The heat comes through the outer wall of a disc that turns in
    free air, without its sides and the warmth of windage: Nu = 0.073 Re^0.7 with Re = omega R D/nu, from Re
    15,000 on.
    Args: `gas_per_hour`: normal m^3.
    Source: first law; Dropkin and Carmi, Trans. ASME 79 (1957), recalled and not read; an eighth below
        Reynolds' analogy with the drag of Theodorsen and Regier, NACA report 793 (1944), on the paper's disc.
    """
    if (vapour := carried_off(scene)) is None:
        return None
    gas, disc, warm = scene.gas, scene.disc, scene.liquid.temperature or scene.gas.temperature
    expansion = NORMAL_PRESSURE_PA * gas.temperature / NORMAL_TEMPERATURE_K
    power = gas_per_hour / 3600.0 * (expansion + vapour * _LATENT_HEAT)
    reynolds = 2 * scene.rotor.speed * disc.outer_radius**2 / _AIR_VISCOSITY_M2_S
    nusselt = 0.073 * reynolds**0.7
    drop = power / (nusselt * _AIR_CONDUCTIVITY * math.pi * disc.axial_width)
    colder, warmer = (
        liquid_at(name=_WATER, temperature=max(each, COLDEST_WATER_K)).kinematic_viscosity
        for each in (warm - drop, warm)
    )
    return ExhaustCold(power, drop, colder / warmer - 1.0)
