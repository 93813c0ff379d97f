"""Which physical terms a run holds, which it leaves out, and what leaving them out is worth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ringbalance.reduced_model.ladder import LEFT_OUT, Term
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.transients import REFERENCE_PRESSURE, REFERENCE_TEMPERATURE
from ringbalance.scene.models import Scene

NO_PRESSURE: Final = 1.0
"""Gauge, Pa, below which there is no gas drive to speak of."""


def terms(
    *, scene: Scene, model: BalancerModel, integrator: str, gas_times: Sequence[float]
) -> tuple[Term, ...]:
    """The terms of a run.

    Args:
        scene: the scene.
        model: the balancer.
        integrator: name of the integrator.
        gas_times: s, of every injection of the run.

    Returns:
        Terms, those modelled first.
    """
    mean = math.fsum(gas_times) / len(gas_times) if gas_times else None
    return (
        Term(term="tube flow", model=model.name, why="the law asked for", estimated_contribution=None),
        Term(
            term="operation in time",
            model=integrator.replace("_", " "),
            why="exact for this law" if integrator == "closed_form" else "holds for any law, with events",
            estimated_contribution=None,
        ),
        _left_out("tube inertia", inertia_time(scene=scene, model=model), mean),
        _left_out("gas filling", filling_time(scene=scene, model=model), mean),
        _left_out("valve lag", scene.gas.valve_lag, mean),
    )


def inertia_time(*, scene: Scene, model: BalancerModel) -> float | None:
    """Gas time that the liquid column's start costs, tau ln 2 with tau = rho L u/p.

    From L du/dt = (p/rho) (1 - (u/u0)^2), so u = u0 tanh(t/tau), which lags u0 tau ln 2 behind.

    Args:
        scene: the scene.
        model: the balancer.

    Returns:
        s, at level fills; None when the gas does not drive a flow there.
    """
    x, pressure = scene.disc.initial_fill, scene.gas.pressure
    flow = model.flow.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
    velocity = abs(float(flow.velocity))
    if velocity == 0 or pressure < NO_PRESSURE:
        return None
    return math.log(2) * model.density * scene.tube.length * velocity / pressure


def filling_time(*, scene: Scene, model: BalancerModel) -> float | None:
    """Time in which choked flow fills a chamber at level fills, t = V_gas p/(C p_1 p_0) sqrt(T/T_0).

    Args:
        scene: the scene.
        model: the balancer.

    Returns:
        s; None when the scene gives no conductance.

    Source: ISO 6358-1, volume flow at reference conditions C p_1 sqrt(T_0/T), with the upstream pressure p_1
        taken as the chamber's final one and p_0 = 100 kPa.
    """
    gas = scene.gas
    if gas.conductance is None:
        return None
    volume = (1 - scene.disc.initial_fill) * model.chamber_volume + (gas.dead_volume or 0.0)
    upstream = gas.pressure + gas.ambient_pressure
    warm = math.sqrt(REFERENCE_TEMPERATURE / gas.temperature)
    return volume * gas.pressure * warm / (gas.conductance * upstream * REFERENCE_PRESSURE)


def _left_out(term: str, time: float | None, mean: float | None) -> Term:
    if time is None:
        why = "the scene gives no basis for an estimate"
    elif mean is None:
        why = f"costs about {time * 1e3:.3g} ms of an operation; there was none"
    else:
        why = f"costs about {time * 1e3:.3g} ms of an operation of {mean * 1e3:.3g} ms on average"
    share = None if time is None or mean is None else time / mean
    return Term(term=term, model=LEFT_OUT, why=why, estimated_contribution=share)
