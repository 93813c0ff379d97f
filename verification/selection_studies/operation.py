"""The hierarchies of what a controller does with the tube: mass moved by one operation, and the settling
time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.closed_form import closed_form
from ringbalance.controller.liquid_ring.plant import LiquidRing, initial_state
from ringbalance.controller.liquid_ring.quadrature import quadrature
from ringbalance.controller.liquid_ring.transfer import Integrator
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.chamber.range import chamber_status
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.reduced_model.law.model import CompleteLaw, balancer_model
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.selection.estimates import (
    FILLING,
    HELD,
    INERTIA,
    LAG,
    injection_estimates,
    injection_time,
)
from ringbalance.reduced_model.selection.loss_models import CONSTANT
from ringbalance.reduced_model.selection.range_flow import equal_velocity
from ringbalance.reduced_model.selection.registry import IN_INJECTIONS
from ringbalance.reduced_model.selection.tube_terms import flow_contributions
from ringbalance.reduced_model.time_scales import first_gas_time
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.explicit_segments import explicit_segments
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Work
from ringbalance.verification.selection_studies.law_models import (
    CLOSED,
    EQ_12,
    SIPHON,
    LawModels,
)
from ringbalance.verification.selection_studies.tube_models import (
    LawBook,
    flow_models,
    lacks,
    law_name,
    velocity_uncertainty,
)

FEW: Final = 4
MANY: Final = 16
"""Segments of Eq. 20."""
OPERATIONS: Final = 12.0
"""Of a run to balance, for the count of work."""
WATCHED: Final = 30.0
"""s, for which a run is watched: short of the scene's own limit, so that a model hierarchy can be refined."""
CLOSED_FORM: Final = "closed form in time"
EXPLICIT: Final = {FEW: f"{FEW} explicit segments", MANY: f"{MANY} explicit segments"}
QUADRATURE: Final = "quadrature in time"


@dataclass(frozen=True, kw_only=True)
class _TimeModels:
    """How an operation is carried through time."""

    name: str
    integrator: Integrator | None
    """None: Runge-Kutta steps with the modelled terms."""
    modelled: tuple[str, ...]
    lacks: tuple[str, ...]
    work: Work
    """Of one operation."""


ModelPair = tuple[LawModels, _TimeModels]


def time_models(scene: Scene) -> tuple[_TimeModels, ...]:
    """Ways through an injection that a scene has numbers for, in order of increasing cost."""
    numbers = (
        (HELD, scene.tube.hump_radius),
        (FILLING, scene.gas.conductance),
        (LAG, scene.gas.valve_lag),
    )
    given = tuple(term for term, number in numbers if number is not None)
    left = (INERTIA, *given)
    quasi_steady = (
        _steady(CLOSED_FORM, closed_form, left, closed_operation=1.0),
        _steady(EXPLICIT[FEW], explicit_segments(FEW), (EXPLICIT[FEW], *left), segment=float(FEW)),
        _steady(EXPLICIT[MANY], explicit_segments(MANY), (EXPLICIT[MANY], *left), segment=float(MANY)),
        _steady(QUADRATURE, quadrature, left, quadrature_operation=1.0),
    )
    dynamic = [_dynamic((INERTIA,), given)]
    if given:
        dynamic.append(_dynamic((INERTIA, *given), ()))
    return (*quasi_steady, *dynamic)


def _steady(name: str, integrator: Integrator, left: tuple[str, ...], **work: float) -> _TimeModels:
    return _TimeModels(name=name, integrator=integrator, modelled=(), lacks=left, work=work)


def _dynamic(modelled: tuple[str, ...], left: tuple[str, ...]) -> _TimeModels:
    return _TimeModels(
        name="with " + ", ".join(modelled),
        integrator=None,
        modelled=modelled,
        lacks=left,
        work={"dynamic_operation": 1.0},
    )


def operation_laws(scene: Scene) -> tuple[LawModels, ...]:
    """Flow laws of an injection, in order of increasing cost.

    The paper's law, and every loss with Eq. 12 and with the exact level, with the crest's regimes where the
    scene has a crest; last the scene's finest law.
    """
    every = flow_models(scene)
    regimes = every[-1].regimes
    kept = [law for law in every if law.regimes == regimes and law.level in (EQ_12, CLOSED)]
    return tuple(dict.fromkeys([every[0], *kept, every[-1]]))


def _sets(times: tuple[_TimeModels, ...], laws: tuple[LawModels, ...]) -> list[ModelPair]:
    """Every law with every way through time that suits it; the highest last."""
    return [
        (law, time)
        for law in laws
        for time in times
        if time.name != CLOSED_FORM or (law == laws[0] and law.regimes == SIPHON and law.level == EQ_12)
    ]


def _law(book: LawBook, law: LawModels, time: _TimeModels) -> CompleteLaw:
    """The paper's own law where the closed form in time needs its two coefficients."""
    return paper_law(book.scene) if time.name == CLOSED_FORM else book.law(law)


def gas_times(scene: Scene) -> tuple[float, float]:
    """Valve-open times of an injection at which it is judged: the shortest that matters and the first, s."""
    low, high = sorted((injection_time(scene), first_gas_time(scene)))
    return low, high


def _operation_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the ways through time leave out, and what their laws do, relative to the mass moved."""
    change = _velocity_change(scene, max(gas_times(scene)))
    segments = {
        name: Contribution(
            term=name,
            value=change / (2 * count),
            formula="change of the velocity over an operation / (2 n)",
            source="Euler's step, first order",
            rough=True,
        )
        for count, name in EXPLICIT.items()
    }
    found = injection_estimates(scene)
    terms = {
        term: Contribution(
            term=term,
            value=found[term].contribution,
            formula=found[term].formula,
            source={
                INERTIA: "rho L du/dt",
                HELD: "lift to the crest",
                FILLING: "ISO 6358-1",
                LAG: "definition",
            }[term],
            rough=True,
        )
        for term in IN_INJECTIONS
    }
    return {**flow_contributions(scene), **segments, **terms}


def _velocity_change(scene: Scene, duration: float) -> float:
    """Relative change of the velocity while the levels shift, (dP/dx) 2 dx/(2 p)."""
    velocity, disc = equal_velocity(scene), scene.disc
    if scene.gas.pressure <= 0:
        return 0.0
    area = scene.tube.area
    per_fill = scene.liquid.density * scene.rotor.speed**2 / (disc.axial_width * disc.central_angle)
    return float(min(per_fill * area * velocity * duration / scene.gas.pressure, 1.0))


def mass_hierarchy(scene: Scene, *, book: LawBook) -> ModelHierarchy:
    """Models of the mass that one injection moves, from equal fills and an empty tube, after its wait."""
    times = gas_times(scene)

    def solve(point: int, *, law: LawModels, time: _TimeModels) -> FloatArray:
        return np.array([moved_mass(scene, law=_law(book, law, time), time=time, gas_time=times[point])])

    return _hierarchy(
        scene,
        book,
        quantity="transferred_mass",
        title="mass moved by one operation",
        values=("kg out of the driven chamber",),
        points=tuple(f"{time:.3g} s of gas" for time in times),
        solve=solve,
        operations=1.0,
        sets=_sets(time_models(scene), operation_laws(scene)),
    )


def moved_mass(scene: Scene, *, law: CompleteLaw, time: _TimeModels, gas_time: float) -> float:
    """Mass that leaves the driven chamber by one injection of `gas_time`, s, and the wait after it, kg."""
    model = balancer_model(law)
    plant = LiquidRing(
        model=model,
        chambers=scene.disc.chambers,
        gas_pressure=scene.gas.pressure,
        integrator=time.integrator or quadrature,
        dynamics=dynamics_of(scene=scene, model=model, modelled=time.modelled),
    )
    start = initial_state(disc=scene.disc)
    valve = plant.advance(start, gas_times={0: gas_time}, duration=gas_time, points=1)
    end = plant.advance(valve.state, gas_times={}, duration=scene.controller.period, points=1)
    return (start.fills()[0] - end.state.fills()[0]) * model.density * model.chamber_volume


def settling_hierarchy(scene: Scene, *, book: LawBook) -> ModelHierarchy:
    """Models of the settling time with the scene's controller and an exact sensor; zero: not settled."""
    exact = replace(
        scene,
        sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0),
        run=replace(scene.run, time_limit=min(scene.run.time_limit, WATCHED)),
    )
    every = operation_laws(scene)
    laws = (every[0], *(law for law in every if law.level == CLOSED and law.loss != CONSTANT), every[-1])
    laws = tuple(dict.fromkeys(laws))
    times = tuple(time for time in time_models(scene) if time.name != EXPLICIT[MANY])

    def solve(_: int, *, law: LawModels, time: _TimeModels) -> FloatArray:
        found = simulate(
            exact,
            flow_law=_law(book, law, time),
            integrator=time.integrator,
            modelled=None if time.integrator is not None else time.modelled,
        )
        return np.array([found.settling_time or 0.0])

    return _hierarchy(
        scene,
        book,
        quantity="settling_time",
        title="settling time",
        values=("s; 0 for a run that does not settle",),
        points=("the scene's initial vibration",),
        solve=solve,
        operations=OPERATIONS,
        sets=_sets(times, laws),
    )


def _hierarchy(
    scene: Scene,
    book: LawBook,
    *,
    quantity: str,
    title: str,
    values: tuple[str, ...],
    points: tuple[str, ...],
    solve: Callable[..., FloatArray],
    operations: float,
    sets: list[ModelPair],
) -> ModelHierarchy:
    hump = scene.tube.hump_radius is not None
    width = velocity_uncertainty(scene, book)
    return ModelHierarchy(
        quantity=quantity,
        title=title,
        values=values,
        points=points,
        check=tuple(range(len(points))),
        relative_to="each",
        contributions=_operation_contributions(scene),
        fidelities=tuple(
            Fidelity(
                name=f"{law_name(law, hump=hump)}; {time.name}",
                models={**law.named(), "operation in time": time.name},
                leaves_out=lacks(law, hump=hump) | frozenset(time.lacks),
                work={kind: count * operations for kind, count in time.work.items()} | {"step": operations},
                fixed_work={} if time.name == CLOSED_FORM else law.work(scene),
                solve=partial(solve, law=law, time=time),
                prepare=None if time.name == CLOSED_FORM else partial(book.make, law),
            )
            for law, time in sets
        ),
        top_uncertainty=width,
        top_uncertainty_from="that of the velocity, as `calibrate` has it",
        status=chamber_status(scene),
    )
