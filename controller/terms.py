"""Which physical terms a run models beyond its flow law, which it leaves out, and why.

Each is estimated before the run, as a share of a first operation's gas time; the scene's tolerance decides.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from ringbalance.controller.dynamic_column import column_of
from ringbalance.controller.dynamic_gas import HEAT_CAPACITY_RATIO, VENTED, GasLine
from ringbalance.controller.dynamic_motion import Dynamics
from ringbalance.reduced_model.ladder import LEFT_OUT, NOT_MODELLED, Term
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.paper_law import PaperLaw
from ringbalance.reduced_model.transients import REFERENCE_PRESSURE, REFERENCE_TEMPERATURE, pulse_time
from ringbalance.scene.models import Gas, Scene

NO_PRESSURE: Final = 1.0
"""Gauge, Pa, below which there is no gas drive to speak of."""
INERTIA: Final = "tube inertia"
FILLING: Final = "gas filling"
LAG: Final = "valve lag"
MODELS: Final = {
    INERTIA: "rho L du/dt of the liquid in the tube",
    FILLING: "ISO 6358",
    LAG: "pure delay",
}
"""The terms that a run can model, and how."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One term, before the run."""

    term: str
    time: float | None
    """What it costs of an operation, s; None where the scene gives no basis for an estimate."""
    share: float | None
    """`time` over a first operation's gas time."""
    modelled: bool
    why: str


def choices(
    *, scene: Scene, model: BalancerModel, asked: Collection[str] | None = None
) -> tuple[Choice, ...]:
    """Decide which terms to model.

    Args:
        scene: the scene; its tolerance decides.
        model: the balancer; a law that gives no forces can carry none of the terms.
        asked: names of the terms to model instead, whatever the tolerance; None: as the tolerance asks.

    Returns:
        One choice for each term.

    Raises:
        ValueError: a term that is not known, or that the scene or the law gives no numbers for.
    """
    times = {
        INERTIA: inertia_time(scene=scene, model=model),
        FILLING: filling_time(scene=scene, model=model),
        LAG: scene.gas.valve_lag,
    }
    for term in asked or ():
        if term not in times:
            raise ValueError(f"no term {term!r}; there are {', '.join(MODELS)}")
        unknown = times[term] is None and term != INERTIA
        if unknown or column_of(law=model.flow, tube=scene.tube) is None:
            raise ValueError(f"{term} cannot be modelled: the scene or the law gives no numbers for it")
    return tuple(_choice(scene, model, term, time, asked) for term, time in times.items())


def dynamics_of(*, scene: Scene, model: BalancerModel, chosen: Sequence[Choice]) -> Dynamics | None:
    """The plant's terms as chosen.

    Args:
        scene: the scene.
        model: the balancer.
        chosen: of `choices`.

    Returns:
        Dynamics; None when no term is modelled.
    """
    names = {choice.term for choice in chosen if choice.modelled}
    line = _line(scene.gas) if FILLING in names else None
    gas_off = 0.0 if line is None else VENTED * scene.gas.ambient_pressure
    column = column_of(law=model.flow, tube=scene.tube, gas_off=gas_off)
    if not names or column is None:
        return None
    return Dynamics(
        column=column,
        inertia=INERTIA in names,
        line=line,
        valve_lag=(scene.gas.valve_lag or 0.0) if LAG in names else 0.0,
        gas_pressure=scene.gas.pressure,
        ambient_pressure=scene.gas.ambient_pressure,
        dead_volume=scene.gas.dead_volume or 0.0,
        tube_area=model.tube_area,
        chamber_volume=model.chamber_volume,
        max_fill_ratio=model.flow.max_fill_ratio,
    )


def terms(
    *, scene: Scene, model: BalancerModel, integrator: str, chosen: Sequence[Choice]
) -> tuple[Term, ...]:
    """The terms of a run.

    Args:
        scene: the scene.
        model: the balancer.
        integrator: name of the integrator.
        chosen: of `choices`.

    Returns:
        Terms.
    """
    exact = "exact for this law" if integrator == "closed_form" else "holds for any law, with events"
    carried = "fill, velocity and gas as one system" if any(c.modelled for c in chosen) else exact
    return (
        Term(term="tube flow", model=model.name, why="the law asked for", estimated_contribution=None),
        Term(
            term="operation in time",
            model=integrator.replace("_", " "),
            why=carried,
            estimated_contribution=None,
        ),
        *(_term(choice) for choice in chosen),
        _held(scene, model),
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
    """Time in which choked flow fills a chamber at level fills, t = V_gas p/(C p_1 p_0) sqrt(T_0/T).

    Args:
        scene: the scene.
        model: the balancer.

    Returns:
        s; None when the scene gives no conductance.

    Source: ISO 6358-1, mass flow C rho_0 p_1 sqrt(T_0/T), with the supply's pressure p_1 and p_0 = 100 kPa;
        isothermal gas.
    """
    gas = scene.gas
    if gas.conductance is None:
        return None
    volume = (1 - scene.disc.initial_fill) * model.chamber_volume + (gas.dead_volume or 0.0)
    upstream = gas.pressure + gas.ambient_pressure
    warm = math.sqrt(REFERENCE_TEMPERATURE / gas.temperature)
    return volume * gas.pressure * warm / (gas.conductance * upstream * REFERENCE_PRESSURE)


def _line(gas: Gas) -> GasLine | None:
    if gas.conductance is None or gas.critical_ratio is None:
        return None
    return GasLine(
        supply_pressure=gas.pressure + gas.ambient_pressure,
        ambient_pressure=gas.ambient_pressure,
        temperature=gas.temperature,
        conductance=gas.conductance,
        critical_ratio=gas.critical_ratio,
        process=gas.process,
    )


def _choice(
    scene: Scene, model: BalancerModel, term: str, time: float | None, asked: Collection[str] | None
) -> Choice:
    if time is None:
        told = "the scene gives no basis for an estimate"
        return Choice(term=term, time=None, share=None, modelled=term in (asked or ()), why=told)
    pulse = pulse_time(scene)
    share = time / pulse
    above = share > scene.tolerance
    told = (
        f"costs about {time * 1e3:.3g} ms of a first gas time of {pulse * 1e3:.4g} ms; "
        f"{_against(share, scene.tolerance)}"
    )
    if asked is not None:
        return Choice(
            term=term, time=time, share=share, modelled=term in asked, why=f"{told}; the caller's choice"
        )
    reason = _out_of_reach(term, model, scene)
    modelled = above and not reason
    told += f"; {reason}" if above and reason else ""
    told += _told_more(term, time, scene.gas.process) if modelled else ""
    return Choice(term=term, time=time, share=share, modelled=modelled, why=told)


def _against(share: float, tolerance: float) -> str:
    side = "above" if share > tolerance else "below"
    return f"{100 * share:.2g} % is {side} the tolerance of {100 * tolerance:.2g} %"


def _out_of_reach(term: str, model: BalancerModel, scene: Scene) -> str:
    """Why a term cannot be modelled under a law; empty when it can."""
    if column_of(law=model.flow, tube=scene.tube) is None:
        return "this law gives velocities and no forces"
    if term == INERTIA and isinstance(model.flow, PaperLaw):
        return "the paper's law has no mass in the tube"
    return ""


def _told_more(term: str, time: float, process: str) -> str:
    if term != FILLING:
        return ""
    if process == "adiabatic":
        return "; estimated isothermal, modelled without heat from the walls, which takes less"
    sooner = 1e3 * time * (1 - 1 / HEAT_CAPACITY_RATIO)
    return f"; isothermal: without heat from the walls it would take up to {sooner:.3g} ms less"


def _term(choice: Choice) -> Term:
    model = MODELS[choice.term] if choice.modelled else LEFT_OUT
    if not choice.modelled and "; this law" in choice.why:
        model = NOT_MODELLED
    return Term(term=choice.term, model=model, why=choice.why, estimated_contribution=choice.share)


def _held(scene: Scene, model: BalancerModel) -> Term:
    """Liquid that fills the tube only while it flows."""
    share = model.tube_area * scene.tube.length / (model.chamber_volume * scene.disc.initial_fill)
    above = share > scene.tolerance
    return Term(
        term="liquid held in the tube",
        model=NOT_MODELLED if above else LEFT_OUT,
        why=f"at most S L over a chamber's liquid at the start; {_against(share, scene.tolerance)}",
        estimated_contribution=share,
    )
