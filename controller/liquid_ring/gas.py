"""The gas of a chamber that fills and vents through its valve and line, by ISO 6358.

    mass flow = C rho_0 p_1 sqrt(T_0/T_1) phi(p_2/p_1)
with phi = 1 up to the critical ratio b (choked), sqrt(1 - ((r - b)/(1 - b))^2) above it (subsonic), and
straight from r = 0.999 to 1, where the flow is laminar and the ellipse's slope would be infinite.

Isothermal gas keeps the temperature of the supply: d(p V)/dt = R T m'.  Adiabatic gas exchanges no heat with
the walls: V dp/dt = gamma (R T_in m'_in - R T m'_out - p dV/dt), with its temperature from p V = m R T.
Filling a closed volume is faster by up to gamma when adiabatic; a real chamber lies between the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from ringbalance.reduced_model.time_scales import (
    HEAT_CAPACITY_RATIO,
    REFERENCE_PRESSURE,
    REFERENCE_TEMPERATURE,
)
from ringbalance.scene.models import GasProcess

LAMINAR_RATIO: Final = 0.999
"""Pressure ratio above which the conductance is taken as laminar."""
VENTED: Final = 1 - LAMINAR_RATIO
"""Gauge pressure over ambient pressure below which a chamber counts as vented."""


@dataclass(frozen=True, kw_only=True)
class GasLine:
    """Valve and line of one chamber, with a supply and the surroundings at its other end."""

    supply_pressure: float
    """Absolute, Pa."""
    ambient_pressure: float
    """Absolute, Pa."""
    temperature: float
    """Of the supply and the surroundings, K."""
    conductance: float
    """C, m^3/(s Pa)."""
    critical_ratio: float
    """b."""
    process: GasProcess

    @property
    def exponent(self) -> float:
        """1 for isothermal gas, gamma for adiabatic gas."""
        return HEAT_CAPACITY_RATIO if self.process == "adiabatic" else 1.0

    def rates(
        self, *, pressure: float, content: float, volume: float, growth: float, is_open: bool
    ) -> tuple[float, float]:
        """Rates of change of a chamber's gas.

        Args: `pressure`: p, absolute, Pa. `content`: m R = p V/T, J/K. `volume`: V, m^3. `growth`: dV/dt,
            m^3/s. `is_open`: whether the line leads to the supply; else to the surroundings.
        Returns: dp/dt, Pa/s, and d(m R)/dt, W/K.
        Source: ISO 6358-1 for the mass flow; first law for the chamber's gas.
        """
        outside = self.supply_pressure if is_open else self.ambient_pressure
        isothermal = self.process == "isothermal"
        # A trial step of the integrator may empty a chamber of its gas; such a step is thrown away.
        tiny = 1e-9 * volume
        if outside >= pressure:
            flow = self.flow(upstream=outside, downstream=pressure, temperature=self.temperature)
            warmth = self.temperature
        else:
            warmth = self.temperature if isothermal else pressure * volume / max(content, tiny)
            flow = -self.flow(upstream=pressure, downstream=outside, temperature=warmth)
        rise = self.exponent * (flow - pressure * growth) / volume
        return rise, flow / warmth

    def flow(self, *, upstream: float, downstream: float, temperature: float) -> float:
        """R T_1 m', the mass flow as pressure times volume per time.

        Args: `upstream`: p_1, absolute, Pa. `downstream`: p_2, absolute, Pa, at most `upstream`.
            `temperature`: T_1, K.
        Returns: C p_0 p_1 sqrt(T_1/T_0) phi(p_2/p_1), W.
        Source: ISO 6358-1.
        """
        shape = flow_shape(ratio=downstream / upstream, critical_ratio=self.critical_ratio)
        warm = math.sqrt(temperature / REFERENCE_TEMPERATURE)
        return self.conductance * REFERENCE_PRESSURE * upstream * warm * shape


def flow_shape(*, ratio: float, critical_ratio: float) -> float:
    """phi(r): mass flow over its choked value.

    Args: `ratio`: r = p_2/p_1, 0 to 1. `critical_ratio`: b.
    Returns: 1 when choked, 0 at r = 1.
    Source: ISO 6358-1.
    """
    if ratio <= critical_ratio:
        return 1.0
    held = min(ratio, max(LAMINAR_RATIO, critical_ratio))
    ellipse = math.sqrt(max(1 - ((held - critical_ratio) / (1 - critical_ratio)) ** 2, 0.0))
    return ellipse if ratio == held else ellipse * (1 - ratio) / (1 - held)
