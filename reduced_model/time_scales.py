r"""Time scales of an injection beyond the quasi-steady flow law: the start of the column, valve-open times.

**Inertia.**  A full column of length L under the driving pressure p obeys
    du/dt = (p/(rho L)) (1 - (u/u0)^2),    p = (k + 1) rho u0^2/2,
so u = u0 tanh(t/tau) with tau = rho L u0/p = 2 L/((k + 1) u0).  It has moved u0 tau ln cosh(t/tau), which
tends to u0 (t - tau ln 2): of an injection of duration T the start costs the fraction
1 - (tau/T) ln cosh(T/tau), at most 1, and tau ln 2 of a long one.  Where the loss is laminar, in proportion
to u, the same tau gives u = u0 (1 - exp(-t/tau)), and the fraction (tau/T) (1 - exp(-T/tau)), tau of a long
injection.  What the column coasts after the gas is shut is not subtracted: the fraction is an upper bound.
"""

from __future__ import annotations

import math
from typing import TypeVar

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

Number = TypeVar("Number", float, FloatArray)


def first_gas_time(scene: Scene) -> float:
    """Valve-open time of the first injection, s: Kc times the initial amplitude, or the first trial.

    The controller's limits hold; without a vibration it is the longest valve-open time.
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
    The controller's limits hold.  `rate` is the change of the vibration per second of gas, m/s; zero where
    nothing flows.
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


def start_up_time(*, density: float, length: float, velocity: Number, driving_pressure: Number) -> Number:
    """Time scale tau on which the column in the tube starts, s: rho L u0/p = 2 L/((k + 1) u0)."""
    return density * length * velocity / driving_pressure


def long_start_up_loss(start_up: float, *, laminar: float = 0.0) -> float:
    """Valve-open time that a start costs of a long injection, s: tau ln 2 turbulent, tau laminar."""
    return start_up * (laminar + (1 - laminar) * math.log(2))


def start_up_loss(*, start_up: float, gas_time: float, laminar: float = 0.0) -> float:
    """Fraction of an injection's steady volume that the column's start costs, from 0 to 1.

    1 - (tau/T) ln cosh(T/tau), or (tau/T) (1 - exp(-T/tau)) laminar.
    """
    t = gas_time / start_up
    log_cosh = t + math.log1p(math.exp(-2 * t)) - math.log(2)
    return laminar * -math.expm1(-t) / t + (1 - laminar) * (1 - log_cosh / t)
