r"""Time scales of an injection beyond the quasi-steady flow law: inertia, gas filling, venting, valve-open
times.

**Inertia.**  A full column of length L under the driving pressure p obeys
    du/dt = (p/(rho L)) (1 - (u/u0)^2),    p = (k + 1) rho u0^2/2,
so u = u0 tanh(t/tau) with tau = rho L u0/p = 2 L/((k + 1) u0).  It has moved u0 tau ln cosh(t/tau), which
tends to u0 (t - tau ln 2): of an injection of duration T the start costs the fraction
1 - (tau/T) ln cosh(T/tau), at most 1, and tau ln 2 of a long one.  Where the loss is laminar, in proportion
to u, the same tau gives u = u0 (1 - exp(-t/tau)), and the fraction (tau/T) (1 - exp(-T/tau)), tau of a long
injection.  What the column coasts after the gas is shut is not subtracted: the fraction is an upper bound.

**Gas.**  ISO 6358: a choked valve passes C rho_0 p_1 sqrt(T_0/T) from the upstream pressure p_1.  With
rho_0 R T_0 = p_0 isothermal gas in a volume V rises by dp/dt = C p_0 p_1 sqrt(T/T_0)/V, so the gauge pressure
p is reached after V p/(C p_1 p_0) sqrt(T_0/T).  Venting, the chamber itself is upstream:
    dp/dt = -(p/tau_v) phi(p_a/p),    tau_v = V/(C p_0) sqrt(T_0/T),
with phi = 1 below the critical ratio b and sqrt(1 - ((r - b)/(1 - b))^2) above it: tau_v ln(b p_1/p_a)
choked, then tau_v times the integral of (1 - b) dq/(b + (1 - b) sin q) to q = pi/2, sin q = (r - b)/(1 - b).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.scene.models import Gas, Scene

REFERENCE_PRESSURE: Final = 1e5
"""Of the reference atmosphere of ISO 6358, Pa."""
REFERENCE_TEMPERATURE: Final = 293.15
"""Of the same, K."""
HEAT_CAPACITY_RATIO: Final = 1.4
"""gamma of air."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def first_gas_time(scene: Scene) -> float:
    """Valve-open time of the first injection, s: Kc times the initial amplitude, or the first trial.

    Args: `scene`: the scene; its controller's limits hold. Without a vibration it is the longest valve-open
    time.
    Source: section 4 of the liquid-ring paper.
    """
    control = scene.controller
    commanded = control.proportional * scene.rotor.initial_amplitude
    if control.kind == "trial":
        commanded = control.first_trial
    return _within_limits(scene, commanded) or control.maximum_gas_time


def deciding_gas_time(scene: Scene, *, rate: float) -> float:
    """Valve-open time of the shortest injection that matters, s: the one commanded at the limit of the
    vibration.

    Target vector: Kc times the limit; trial: the short step, where the limit lies below `fine_below`;
    law-based: the limit over the rate.  Every time scale is compared with this one, because the last
    injections decide whether a run settles.
    Args: `scene`: the scene; its controller's limits hold. `rate`: change of the vibration per second of gas,
        m/s; zero where nothing flows.
    Source: section 4 of the liquid-ring paper.
    """
    control = scene.controller
    commanded = control.proportional * control.limit
    if control.kind == "trial":
        fine = control.limit < control.fine_below
        commanded = min(control.first_trial, control.short_step if fine else control.long_step)
    elif control.kind == "law_based":
        commanded = control.limit / rate if rate > 0 else control.maximum_gas_time
    return _within_limits(scene, commanded) or control.maximum_gas_time


def _within_limits(scene: Scene, commanded: float) -> float:
    return min(max(commanded, scene.controller.minimum_gas_time), scene.controller.maximum_gas_time)


def start_up_time(*, density: float, length: float, velocity: float, driving_pressure: float) -> float:
    """Time scale tau on which the column in the tube starts, s: rho L u0/p = 2 L/((k + 1) u0).

    Args: `density`: rho, kg/m^3. `length`: L of the tube, m. `velocity`: u0 that it tends to, m/s.
        `driving_pressure`: p on the full column, Pa, above zero.
    Source: this module's first lines.
    """
    return density * length * velocity / driving_pressure


def long_start_up_loss(start_up: float, *, laminar: float = 0.0) -> float:
    """Valve-open time that a start costs of a long injection, s: tau ln 2 turbulent, tau laminar.

    Args: `laminar`: fraction of the loss that is laminar, from 0 to 1.
    Source: this module's first lines.
    """
    return start_up * (laminar + (1 - laminar) * math.log(2))


def start_up_loss(*, start_up: float, gas_time: float, laminar: float = 0.0) -> float:
    """Fraction of an injection's steady volume that the column's start costs, from 0 to 1.

    Args: `start_up`: tau, s, above zero. `gas_time`: T, s, above zero.
    Returns: 1 - (tau/T) ln cosh(T/tau), or (tau/T) (1 - exp(-T/tau)) laminar.
    Source: this module's first lines.
    """
    t = gas_time / start_up
    log_cosh = t + math.log1p(math.exp(-2 * t)) - math.log(2)
    return laminar * -math.expm1(-t) / t + (1 - laminar) * (1 - log_cosh / t)


def filling_time(gas: Gas, *, volume: float) -> float | None:
    """Time in which choked flow fills a volume, s: V p/(C p_1 p_0) sqrt(T_0/T).

    Args: `gas`: the scene's gas. `volume`: V with the dead volume, m^3.
    Returns: s; None when the scene gives no conductance.
    Source: ISO 6358-1, with p_1 the supply's absolute pressure and p_0 = 100 kPa; isothermal gas.
    """
    if gas.conductance is None:
        return None
    supply = gas.pressure + gas.ambient_pressure
    return _emptying_time(gas, gas.conductance, volume) * gas.pressure / supply


def venting_time(gas: Gas, *, volume: float) -> float | None:
    """Time in which a volume vents from the driving to the ambient pressure, s.

    Args: `gas`: the scene's gas. `volume`: V with the dead volume, m^3.
    Returns: s; None when the scene gives no conductance or no critical ratio.
    Source: ISO 6358-1, integrated in this module's first lines; isothermal gas.
    """
    if gas.conductance is None or gas.critical_ratio is None:
        return None
    b, ratio = gas.critical_ratio, gas.ambient_pressure / (gas.pressure + gas.ambient_pressure)
    first = math.asin(min(max(ratio - b, 0.0) / (1 - b), 1.0))
    angle = first + (math.pi / 2 - first) * (_NODES + 1) / 2
    integrand = (1 - b) / (b + (1 - b) * np.sin(angle))
    subsonic = float(np.dot(_WEIGHTS, integrand)) * (math.pi / 2 - first) / 2
    choked = max(math.log(b / ratio), 0.0) if b > 0 else 0.0
    return _emptying_time(gas, gas.conductance, volume) * (choked + subsonic)


def _emptying_time(gas: Gas, conductance: float, volume: float) -> float:
    """tau_v, s."""
    return volume / (conductance * REFERENCE_PRESSURE) * math.sqrt(REFERENCE_TEMPERATURE / gas.temperature)
