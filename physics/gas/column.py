"""Gas in a spinning chamber, and what compressed gas costs."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas.supply import HEAT_CAPACITY_RATIO
from ringbalance.scene.models import Scene

AIR_CONSTANT: Final = 287.05
"""R of dry air, J/(kg K)."""
NORMAL_PRESSURE: Final = 101325.0
NORMAL_TEMPERATURE: Final = 273.15
"""Of a normal litre, Pa and K: DIN 1343."""


def nozzle_flow(*, pressure: float, area: float, temperature: float) -> float:
    """R T m' of air through a choked nozzle, W: the most that passes an opening.

    Args:
        pressure: upstream, absolute, Pa.
    Source: isentropic flow, m' = p A sqrt(gamma/(R T)) (2/(gamma + 1))^((gamma + 1)/(2 (gamma - 1))).
    """
    gamma = HEAT_CAPACITY_RATIO
    shape: float = math.sqrt(gamma) * (2 / (gamma + 1)) ** ((gamma + 1) / (2 * (gamma - 1)))
    return pressure * area * shape * math.sqrt(AIR_CONSTANT * temperature)


def pressure_factor(scene: Scene) -> float:
    """Gauge pressure of the gas on the liquid over the one where the scene's pressure is measured.

    Measured on the shaft's axis it is the ratio of an isothermal column that turns with the disc up to the
    surface at equal fills, exp(omega^2 a^2/(2 R T)), for the driven chamber and, because it vents to the same
    place, for the opposite one: p_abs f - p_a f = p f.
    Source: dp/dr = rho omega^2 r with rho = p/(R T).
    """
    if scene.gas.measured_at == "chamber":
        return 1.0
    surface = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2))
    return math.exp((scene.rotor.speed * surface) ** 2 / (2 * AIR_CONSTANT * scene.gas.temperature))


def vented_pressure(scene: Scene) -> float:
    """Absolute pressure of the gas on the liquid of a vented chamber, from which gauge pressures there count.

    The surroundings', times `pressure_factor` where the scene's pressures hold on the shaft.
    """
    return scene.gas.ambient_pressure * pressure_factor(scene)


def normal_volume(*, pressure_volume: float, temperature: float) -> float:
    """Normal volume (m^3, at 0 degC and 101.325 kPa) of the gas with a given p V (J) at a temperature."""
    return pressure_volume / NORMAL_PRESSURE * NORMAL_TEMPERATURE / temperature


def compression_work(*, pressure_volume: float, pressure: float, ambient_pressure: float) -> float:
    """Least work that makes the gas of a given p V from the surroundings, p V ln(p/p_a), J.

    Args:
        pressure_volume: p V of the gas used, at the supply's temperature, J.
        pressure: of the supply, absolute, Pa.
    Source: isothermal compression; 84 J for 51 ml at 0.7 MPa gauge.
    """
    return pressure_volume * math.log(pressure / ambient_pressure)
