r"""Gas of a chamber: flow through valve and line by ISO 6358, rotating gas column, and consumption.

    m' = C rho_0 p_1 sqrt(T_0/T_1) phi(p_2/p_1)
with phi = 1 up to the critical ratio b (choked), sqrt(1 - ((r - b)/(1 - b))^2) above it (subsonic), and
straight from r = 0.999 to 1, where the flow is laminar and the ellipse's slope would be infinite.

Isothermal gas keeps the temperature of the supply: d(p V)/dt = R T m'.  Adiabatic gas exchanges no heat with
the walls: V dp/dt = gamma (R T_in m'_in - R T m'_out - p dV/dt), with its temperature from p V = m R T.
Filling a closed volume is faster by up to gamma when adiabatic; a real chamber lies between the two.

**Times of isothermal gas in a constant volume**, tau = V/(C p_0) sqrt(T_0/T).  Filling, the supply p_1 is
upstream: with r = p/p_1, dr/dt = phi(r)/tau takes tau (b - r) while choked and, with
sin q = (r - b)/(1 - b), tau (1 - b) dq beyond, so tau (1 - b) pi/2 from b to r = 1.  Choked to the end it
would be V p/(C p_1 p_0) sqrt(T_0/T) for the gauge pressure p, a lower bound.  Venting, the chamber is
upstream: with r = p_a/p, dr/dt = r phi(r)/tau takes tau ln(b/r) while choked and
tau (1 - b) dq/(b + (1 - b) sin q) beyond, whose integral is elementary.

**Leaks** are further conductances of the valve's critical ratio: one from the chamber to the surroundings,
one from the supply into a chamber whose valve is closed.  A chamber under gas then comes to the pressure at
which its valve passes what leaks, a vented one to that at which valve and leak let off what leaks in:
    C_in p_1 phi(p/p_1) = C_out p phi(p_a/p).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.arrays import FloatArray, plain
from ringbalance.scene.models import Gas, GasProcess, Scene
from ringbalance.scene.rules.working import AIR_CONSTANT

REFERENCE_PRESSURE_PA: Final = 1e5
"""Pressure of the reference atmosphere of ISO 6358, Pa."""
REFERENCE_TEMPERATURE_K: Final = 293.15
"""Temperature of the reference atmosphere of ISO 6358, K."""
HEAT_CAPACITY_RATIO: Final = 1.4
"""gamma of air."""
LAMINAR_RATIO: Final = 0.999
"""Pressure ratio above which the conductance is taken as laminar."""
VENTED: Final = 1 - LAMINAR_RATIO
"""Gauge pressure over ambient pressure below which a chamber counts as vented."""
REACHED: Final = 0.99
"""Part of the rise to the steady pressure at which a chamber with a leak counts as filled."""
_LEAKING_NODES: Final = 64
"""Nodes of the quadrature of a filling with a leak."""
NORMAL_PRESSURE_PA: Final = 101325.0
NORMAL_TEMPERATURE_K: Final = 273.15
"""State of a normal litre: DIN 1343."""


def flow_shape(ratio: float, critical_ratio: float) -> float:
    """phi(r), the mass flow over its choked value: 1 up to b, 0 at r = 1.

    An ellipse above b, straight from r = 0.999 on, where flow is laminar and the slope would be infinite.
    """
    if ratio <= critical_ratio:
        return 1.0
    held = min(ratio, max(LAMINAR_RATIO, critical_ratio))
    ellipse = math.sqrt(max(1.0 - ((held - critical_ratio) / (1.0 - critical_ratio)) ** 2, 0.0))
    return ellipse if ratio == held else ellipse * (1.0 - ratio) / (1.0 - held)


def flow_shapes(ratio: FloatArray, critical_ratio: npt.ArrayLike) -> FloatArray:
    """`flow_shape` of arrays."""
    b = np.asarray(critical_ratio)
    held = np.minimum(ratio, np.maximum(LAMINAR_RATIO, b))
    ellipse = np.sqrt(np.maximum(1.0 - (np.maximum(held - b, 0.0) / (1.0 - b)) ** 2, 0.0))
    return np.asarray(ellipse * np.minimum((1.0 - ratio) / (1.0 - held), 1.0))


def flow_shape_slope(ratio: float, critical_ratio: float, shape: float) -> float:
    """Slope dphi/dr of `flow_shape`, from phi(r)."""
    if ratio <= critical_ratio:
        return 0.0
    if ratio > max(LAMINAR_RATIO, critical_ratio):
        return -shape / max(1.0 - ratio, 1e-300)
    return -(ratio - critical_ratio) / (1.0 - critical_ratio) ** 2 / max(shape, 1e-300)


@dataclass(frozen=True, kw_only=True)
class GasLine:
    """Valve and line of one chamber, with a supply and the surroundings at its other end."""

    supply_pressure: float
    """Absolute supply pressure, Pa."""
    ambient_pressure: float
    """Absolute ambient pressure, Pa."""
    temperature: float
    """Temperature of the supply and the surroundings, K."""
    conductance: float
    """Sonic conductance C, m^3/(s Pa)."""
    critical_ratio: float
    """Critical pressure ratio b."""
    process: GasProcess
    leak_to_ambient: float = 0.0
    """Sonic conductance of the leak from the chamber to the surroundings, m^3/(s Pa)."""
    leak_from_supply: float = 0.0
    """Sonic conductance of the leak from the supply into a chamber whose valve is closed, m^3/(s Pa)."""

    @classmethod
    def of(cls, gas: Gas) -> GasLine | None:
        """Gas line of a scene; None if the scene lacks its conductance or critical ratio."""
        if gas.conductance is None or gas.critical_ratio is None:
            return None
        return GasLine.with_conductance(gas, conductance=gas.conductance, critical_ratio=gas.critical_ratio)

    @classmethod
    def with_conductance(cls, gas: Gas, *, conductance: float, critical_ratio: float) -> GasLine:
        """Gas line with a conductance and critical ratio, at a scene's pressures and temperature."""
        return cls(
            supply_pressure=gas.pressure + gas.ambient_pressure,
            ambient_pressure=gas.ambient_pressure,
            temperature=gas.temperature,
            conductance=conductance,
            critical_ratio=critical_ratio,
            process=gas.process,
            leak_to_ambient=0.0 if gas.conductance is None else gas.leak_to_ambient or 0.0,
            leak_from_supply=0.0 if gas.conductance is None else gas.leak_from_supply or 0.0,
        )

    def time_constant(self, *, volume: float) -> float:
        """Time constant of filling, tau = V/(C p_0) sqrt(T_0/T), s."""
        warm = math.sqrt(REFERENCE_TEMPERATURE_K / self.temperature)
        return volume / (self.conductance * REFERENCE_PRESSURE_PA) * warm

    def filling_time(self, pressure: npt.ArrayLike, *, volume: float) -> FloatArray:
        """Time from ambient to an absolute pressure up to the supply's, s, isothermal.

        With a leak to ambient at most to `REACHED` of the rise to the steady pressure, which is approached
        without end; the leak from the supply is left out.
        """
        end = np.asarray(pressure, dtype=np.float64) / self.supply_pressure
        first = self.ambient_pressure / self.supply_pressure
        if self.leak_to_ambient == 0.0:
            return self.time_constant(volume=volume) * (self._filled(end) - self._filled(first))
        b, leak = self.critical_ratio, self.leak_to_ambient / self.conductance
        steady = steady_pressure(self.supply_pressure, self.ambient_pressure, 1.0, leak, b)
        top = np.minimum(end, first + REACHED * (steady / self.supply_pressure - first))
        part, weight = np.polynomial.legendre.leggauss(_LEAKING_NODES)
        r = first + (top[..., None] - first) * (1 + part) / 2
        integrand = 1 / (flow_shapes(r, b) - leak * r * flow_shapes(first / r, b))
        inside = (top - first) / 2 * np.sum(weight * integrand, axis=-1)
        return np.asarray(self.time_constant(volume=volume) * inside)

    def _filled(self, ratio: npt.ArrayLike) -> FloatArray:
        """Integral of dr/phi from b to r."""
        b = self.critical_ratio
        return np.minimum(np.asarray(ratio) - b, 0.0) + (1 - b) * self._angle(ratio)

    def choked_filling_time(self, *, volume: float) -> float:
        """Lower bound of the time from ambient to supply pressure, V p/(C p_1 p_0) sqrt(T_0/T), s.

        p is the gauge and p_1 the absolute pressure of the supply.
        """
        return self.time_constant(volume=volume) * (1 - self.ambient_pressure / self.supply_pressure)

    def venting_time(self, pressure: npt.ArrayLike, *, volume: float) -> FloatArray:
        """Time from an absolute pressure above ambient back to ambient, s, isothermal.

        Through valve and leak to ambient together; the leak from the supply is left out.
        """
        ratio = self.ambient_pressure / np.asarray(pressure, dtype=np.float64)
        b = self.critical_ratio
        choked = np.maximum(np.log(b / ratio), 0.0)
        subsonic = (1 - b) * (_sine_integral(math.pi / 2, b) - _sine_integral(self._angle(ratio), b))
        both = 1 + self.leak_to_ambient / self.conductance
        return self.time_constant(volume=volume) / both * (choked + subsonic)

    def _angle(self, ratio: npt.ArrayLike) -> FloatArray:
        b = self.critical_ratio
        return np.asarray(np.arcsin(np.clip((np.asarray(ratio) - b) / (1 - b), 0.0, 1.0)))


def _sine_integral(angle: npt.ArrayLike, b: float) -> FloatArray:
    """Integral of dq/(b + c sin q) from 0, c = 1 - b.

    With t = tan(q/2) it is that of 2 dt/(b t^2 + 2 c t + b), of discriminant c^2 - b^2.
    """
    c, t = 1 - b, np.tan(np.asarray(angle) / 2)
    square = c**2 - b**2
    if abs(square) < 1e-12:
        return np.asarray(2 * (1 / c - 1 / (b * t + c)))
    root = math.sqrt(abs(square))
    if square < 0:
        return np.asarray(2 / root * (np.arctan((b * t + c) / root) - math.atan(c / root)))
    inside = (b * t + c - root) * (c + root) / ((b * t + c + root) * (c - root))
    return np.asarray(np.log(inside) / root)


def nozzle_flow(*, pressure: float, area: float, temperature: float) -> float:
    """Largest flow of air through an opening, R T m' of a choked nozzle, W.

    Args:
        pressure: absolute pressure upstream, Pa.
    Source: isentropic flow, m' = p A sqrt(gamma/(R T)) (2/(gamma + 1))^((gamma + 1)/(2 (gamma - 1))).
    """
    gamma = HEAT_CAPACITY_RATIO
    shape: float = math.sqrt(gamma) * (2 / (gamma + 1)) ** ((gamma + 1) / (2 * (gamma - 1)))
    return pressure * area * shape * math.sqrt(AIR_CONSTANT * temperature)


@lru_cache(maxsize=4096)
def steady_pressure(
    supply: float, ambient: float, inflow: float, outflow: float, critical_ratio: float
) -> float:
    """Absolute pressure of a chamber between a conductance from the supply and one to the surroundings, Pa.

    Args: `supply`, `ambient`: absolute, Pa. `inflow`, `outflow`: sonic conductances, in any one unit.
    Source: ISO 6358 for both, C_in p_1 phi(p/p_1) = C_out p phi(p_a/p), by bisection.
    """
    if supply <= ambient or outflow == 0.0:
        return supply
    low, high = ambient, ambient if inflow == 0.0 else supply
    while (middle := (low + high) / 2) not in (low, high):
        passes = inflow * supply * flow_shape(middle / supply, critical_ratio)
        if passes > outflow * middle * flow_shape(ambient / middle, critical_ratio):
            low = middle
        else:
            high = middle
    return high


def leaks(gas: Gas) -> bool:
    """True if a leak changes the pressure of a chamber: with an ideal supply (no conductance) none does."""
    conductances = (each for each in (gas.leak_to_ambient, gas.leak_from_supply) if each is not None)
    return gas.conductance is not None and any(np.any(np.greater(each, 0.0)) for each in conductances)


def leaking(gas: Gas, leak: Literal["leak_to_ambient", "leak_from_supply"]) -> float:
    """Flow through a leak over the absolute pressure upstream, at most: C p_0 sqrt(T/T_0), m^3/s."""
    conductance: float = getattr(gas, leak) or 0.0
    return conductance * REFERENCE_PRESSURE_PA * math.sqrt(gas.temperature / REFERENCE_TEMPERATURE_K)


def chamber_pressures(gas: Gas) -> tuple[Any, Any]:
    """Steady absolute pressures of a chamber with its valve open and closed, Pa; arrays where `gas` has them.

    Those of supply and surroundings without a leak, or with an ideal supply (no conductance).
    """
    supply, ambient = gas.pressure + gas.ambient_pressure, gas.ambient_pressure
    if gas.conductance is None or not leaks(gas):
        return supply, ambient
    leak, seep = (0.0 if each is None else each for each in (gas.leak_to_ambient, gas.leak_from_supply))
    valve, b, steady = gas.conductance, gas.critical_ratio, np.vectorize(steady_pressure)
    opened, closed = steady(supply, ambient, valve, leak, b), steady(supply, ambient, seep, valve + leak, b)
    return plain(opened), plain(closed)


def applied_pressure(gas: Gas) -> float:
    """Pressure of a chamber under gas over that of a vented one, Pa: `gas.pressure` without a leak."""
    opened, closed = chamber_pressures(gas)
    applied: float = opened - closed if leaks(gas) else gas.pressure
    return applied


def pressure_factor(scene: Scene) -> float:
    """Gauge pressure of the gas on the liquid over that at the place of measurement.

    For a measurement on the shaft's axis it is f = exp(omega^2 a^2/(2 R T)), the pressure ratio of an
    isothermal gas column that rotates with the disc, up to the surface at equal fills. Both chambers have it,
    because the opposite one vents to the same place: p_abs f - p_a f = p f.
    Range: an exponent up to 1/4, `scene.rules.working`; a scene beyond is refused.
    Source: dp/dr = rho omega^2 r with rho = p/(R T).
    """
    if scene.gas.measured_at == "chamber":
        return 1.0
    surface = surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2)
    turns = (scene.rotor.speed * surface) ** 2
    factor: float = plain(np.exp(turns / (2 * AIR_CONSTANT * scene.gas.temperature)))
    return factor


def vented_pressure(scene: Scene) -> float:
    """Absolute gas pressure on the liquid of a vented chamber, the reference of gauge pressures there.

    That of `chamber_pressures`, times `pressure_factor` where the scene's pressures hold on the shaft.
    """
    vented: float = chamber_pressures(scene.gas)[1] * pressure_factor(scene)
    return vented


def normal_volume(*, pressure_volume: float, temperature: float) -> float:
    """Normal volume (m^3, at 0 degC and 101.325 kPa) of the gas with a given p V (J) at a temperature."""
    return pressure_volume / NORMAL_PRESSURE_PA * NORMAL_TEMPERATURE_K / temperature


def compression_work(*, pressure_volume: float, pressure: float, ambient_pressure: float) -> float:
    """Least work to compress ambient gas to a given p V, p V ln(p/p_a), J.

    Args:
        pressure_volume: p V of the gas used, at the supply's temperature, J.
        pressure: absolute supply pressure, Pa.
    Source: isothermal compression; 84 J for 51 ml at 0.7 MPa gauge.
    """
    return pressure_volume * math.log(pressure / ambient_pressure)
