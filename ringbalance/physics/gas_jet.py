r"""Jet of gas from a hole onto the free surface of the ring: its flow, its stagnation pressure, its crater.

**Flow.** Valve and line, by ISO 6358, and the hole pass one mass flow; the gas stands still between them:
    C p_0 sqrt(T/T_0) p_1 phi(p_h/p_1) = C_d A p_h sqrt(R T) psi(p/p_h),
    psi(r) = sqrt(2 gamma/(gamma - 1) (r^(2/gamma) - r^((gamma + 1)/gamma))), r at least the critical ratio,
with p_1 of the supply, p_h before the hole, p in the chamber.  The left side falls with p_h, the right one
rises, so there is one p_h.  The volume between valve and hole is left out; it fills sooner than the chamber.

**At the hole.** A jet of Mach number M, from p_h/p, stops at the liquid behind a normal shock: with p_h - p
up to M = 1, else with Rayleigh's pitot pressure less p.  Its momentum is m' u + (p_e - p) C_d A.

**Far from it.** A free turbulent jet keeps its momentum J and entrains the chamber's gas, so that on its axis
u = K (4 J/(pi rho))^(1/2)/x, and q = rho u^2/2 = 2 K^2 J/(pi x^2), whatever the density.  The smaller of both
counts; for slow gas they meet at K sqrt(C_d) diameters of the hole, the end of the jet's core.

**Crater.** The liquid is deepest where it balances q on the axis: with the free surface at the radius a,
    rho omega^2 ((a + n)^2 - a^2)/2 = q(x + n),
with the depth n added to the jet's path.  For n << a and far from the hole this is, with g_c = omega^2 a,
    J/(rho g_c x^3) = pi/(2 K^2) (n/x) (1 + n/x)^2,
the relation of Banks and Chandrasekhara, J. Fluid Mech. 15 (1963) 13, recalled and not read.  Mean depths
in water agree with it, about which a crater swings by a tenth (one standard deviation): Ueno and others,
Tetsu-to-Hagane 101 (2015) 74, of which only the abstract was read.

**Droplets.** Gas along a surface of liquid makes waves that grow from rho_g u^2 = 2 sqrt(sigma g_c rho) on
(Kelvin and Helmholtz, rho_g << rho); N = rho_g u^2 over that is the blowing number of lances over baths.

**While a chamber fills** p rises, p_h stays where the valve is choked, and q falls with every term above, so
that a crater is deepest as the valve opens.  It forms within (n/g_c)^(1/2), a fraction of a millisecond.
Validity: chambers much wider than the jet; a path of at most a few tens of hole diameters; a jet faster than
the disc's rotation over its path, omega x/u << 1, else Coriolis' acceleration turns it aside; deep liquid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.gas import (
    HEAT_CAPACITY_RATIO,
    REFERENCE_PRESSURE_PA,
    REFERENCE_TEMPERATURE_K,
    flow_shapes,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.rules.working import AIR_CONSTANT

DISCHARGE_RANGE: Final = (0.6, 1.0)
"""C_d, from a sharp edge to a rounded one.

Source: Weisbach's values for air in Encyclopaedia Britannica, 11th edition, "Hydraulics", section 63: 0.56 to
    0.79 sharp-edged, 0.81 to 0.84 short and cylindrical, 0.92 to 0.99 rounded or conical.
"""
DECAY: Final = 6.5
"""Decay constant K of the velocity on the axis of a round turbulent jet."""
DECAY_FACTOR: Final = 1.2
"""Factor on K at its 95 % limits.

Source: 6.1 at Re = 19400, Abdel-Rahman, Al-Fahed and Chakroun, Mech. Res. Commun. 23 (1996) 313; craters in
    baths of liquid give up to 7.8, recalled and not read.
"""
SURFACE_SHARE: Final = 0.447
"""Velocity of the gas along the crater over that on the jet's axis: Subagyo, Brooks, Coley and Irons, ISIJ
Int. 43 (2003) 983, recalled and not read."""
_CRITICAL: Final = (2 / (HEAT_CAPACITY_RATIO + 1)) ** (HEAT_CAPACITY_RATIO / (HEAT_CAPACITY_RATIO - 1))
"""Critical pressure ratio of a hole, 0.528."""
_HALVINGS: Final = 50
"""Halvings of an interval, down to rounding."""


@dataclass(frozen=True, kw_only=True)
class Jet:
    """Jet as it leaves its hole; numbers, or arrays over designs."""

    pressure: FloatArray
    """p_h before the hole, absolute, Pa."""
    stagnation: FloatArray
    """Pressure with which it stops at the hole, above the chamber's, Pa."""
    momentum: FloatArray
    """J, N."""

    def at(self, distance: npt.ArrayLike, *, decay: npt.ArrayLike) -> FloatArray:
        """Stagnation pressure on the axis, Pa, at a distance x, m. Args: `decay`: K."""
        far = 2 * np.square(decay) * self.momentum / (math.pi * np.maximum(np.square(distance), 1e-30))
        return np.minimum(self.stagnation, far)


def jet_of(
    *,
    supply_pressure: npt.ArrayLike,
    chamber_pressure: npt.ArrayLike,
    temperature: float,
    area: npt.ArrayLike,
    conductance: npt.ArrayLike | None,
    critical_ratio: npt.ArrayLike | None,
) -> Jet:
    """Jet through valve and hole in series.

    Args: `supply_pressure`, `chamber_pressure`: absolute, Pa. `area`: C_d A, m^2. `conductance`,
        `critical_ratio`: C, m^3/(s Pa), and b of the valve; None: the hole alone, the strongest jet.
    """
    ambient = np.asarray(chamber_pressure, dtype=np.float64)
    supply = np.maximum(np.asarray(supply_pressure, dtype=np.float64), ambient)
    before = supply
    if conductance is not None and critical_ratio is not None:
        warm = math.sqrt(temperature / REFERENCE_TEMPERATURE_K)
        valve = np.asarray(conductance) * REFERENCE_PRESSURE_PA * warm * supply
        low, high = np.broadcast_arrays(ambient + 0 * valve, supply + 0 * valve)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            enters = valve * flow_shapes(middle / supply, np.asarray(critical_ratio))
            rises = enters > hole_flow(middle, ambient, area=area, temperature=temperature)
            low, high = np.where(rises, middle, low), np.where(rises, high, middle)
        before = (low + high) / 2
    gamma, leaving = HEAT_CAPACITY_RATIO, np.maximum(ambient, _CRITICAL * before)
    mach = _mach(before / ambient)
    momentum = gamma * leaving * np.square(_mach(before / leaving)) + leaving - ambient
    return Jet(
        pressure=before,
        stagnation=np.where(mach > 1, ambient * (_pitot(mach) - 1), before - ambient),
        momentum=np.asarray(area) * momentum,
    )


def hole_flow(
    before: FloatArray, chamber: FloatArray, *, area: npt.ArrayLike, temperature: float
) -> FloatArray:
    """R T m' through a hole, C_d A p_h sqrt(R T) psi(p/p_h), W, isentropic, choked or not."""
    gamma, ratio = HEAT_CAPACITY_RATIO, np.clip(chamber / before, _CRITICAL, 1.0)
    shape = np.sqrt(2 * gamma / (gamma - 1) * (ratio ** (2 / gamma) - ratio ** ((gamma + 1) / gamma)))
    return np.asarray(np.asarray(area) * before * math.sqrt(AIR_CONSTANT * temperature) * shape)


def crater_depth(
    jet: Jet,
    *,
    distance: npt.ArrayLike,
    surface_radius: npt.ArrayLike,
    density: npt.ArrayLike,
    speed: npt.ArrayLike,
    decay: npt.ArrayLike = DECAY,
) -> FloatArray:
    """Depth n of the crater in a ring without a floor, m.

    Args: `distance`: x from the hole to the free surface at the radius a, along the jet, m. `density`: of
        the liquid, kg/m^3. `speed`: omega, rad/s. `decay`: K.
    """
    a, path = np.asarray(surface_radius), np.asarray(distance, dtype=np.float64)
    scale = 2 / (np.asarray(density) * np.square(speed))

    def balanced(pressure: FloatArray) -> FloatArray:
        """n = sqrt(a^2 + 2 q/(rho omega^2)) - a, without cancellation."""
        square = scale * pressure
        return np.asarray(square / (np.sqrt(np.square(a) + square) + a))

    high = balanced(jet.at(path, decay=decay))
    low = np.zeros_like(high)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        deeper = balanced(jet.at(path + middle, decay=decay)) > middle
        low, high = np.where(deeper, middle, low), np.where(deeper, high, middle)
    return np.asarray((low + high) / 2)


def blowing_number(
    pressure: npt.ArrayLike, *, tension: npt.ArrayLike, density: npt.ArrayLike, acceleration: npt.ArrayLike
) -> FloatArray:
    """N = rho_g u^2/(2 sqrt(sigma g_c rho)) of gas along the crater; from about 1 on it tears off droplets.

    Args: `pressure`: q on the jet's axis, Pa, of which u takes `SURFACE_SHARE`^2. `tension`: sigma, N/m.
        `density`: of the liquid, kg/m^3. `acceleration`: g_c, m/s^2.
    """
    held = np.sqrt(np.asarray(tension) * np.asarray(acceleration) * np.asarray(density))
    return np.asarray(SURFACE_SHARE**2 * np.asarray(pressure) / held)


def _mach(ratio: FloatArray) -> FloatArray:
    """Mach number of isentropic flow from its stagnation pressure over its pressure."""
    gamma = HEAT_CAPACITY_RATIO
    square = 2 / (gamma - 1) * (np.maximum(ratio, 1.0) ** ((gamma - 1) / gamma) - 1)
    return np.asarray(np.sqrt(square))


def _pitot(mach: FloatArray) -> FloatArray:
    """Pitot pressure behind a normal shock over the pressure before it.

    Source: Rayleigh's formula, NACA Report 1135 (1953), Eq. 100.
    """
    gamma, square = HEAT_CAPACITY_RATIO, np.square(np.maximum(mach, 1.0))
    rise = ((gamma + 1) * square / 2) ** (gamma / (gamma - 1))
    shock = ((gamma + 1) / (2 * gamma * square - (gamma - 1))) ** (1 / (gamma - 1))
    return np.asarray(rise * shock)
