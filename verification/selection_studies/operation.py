"""The hierarchies of what a controller does with the tube: mass moved by one operation, and settling time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.plant import DiscState, LiquidRing
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.chamber.range import chamber_status
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.reduced_model.law.model import BalancerModel, CompleteLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_law
from ringbalance.reduced_model.selection.estimates import (
    FILLING,
    HELD,
    INERTIA,
    LAG,
    injection_estimates,
    injection_time,
)
from ringbalance.reduced_model.selection.range_flow import CONSTANT, equal_velocity
from ringbalance.reduced_model.selection.tube_terms import flow_contributions
from ringbalance.reduced_model.time_scales import first_gas_time
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.transfers import closed_form, explicit_segments, paper_drive
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy
from ringbalance.verification.selection_studies.laws import CLOSED, EQ_12, Course, LawBook, LawModels

_OPERATIONS: Final = 12.0
"""Of a run to balance, for the count of work."""
_WATCHED: Final = 30.0
"""s, for which a run is watched: short of the scene's own limit, so that a model hierarchy can be refined."""
_CLOSED_FORM: Final = "closed form in time"
_SEGMENTS: Final = (4, 16)
"""Of Eq. 20."""
EXPLICIT: Final = tuple(f"{count} explicit segments" for count in _SEGMENTS)


def courses(scene: Scene) -> tuple[Course, ...]:
    """Ways through an injection that a scene has numbers for, in order of increasing cost."""
    numbers = ((HELD, scene.tube.hump_radius), (FILLING, scene.gas.conductance), (LAG, scene.gas.valve_lag))
    given = tuple(term for term, number in numbers if number is not None)
    left = (INERTIA, *given)
    quasi_steady = [
        Course(_CLOSED_FORM, left, {"closed_operation": 1.0}, closed_form),
        *(
            Course(name, (name, *left), {"segment": float(count)}, explicit_segments(count))
            for count, name in zip(_SEGMENTS, EXPLICIT, strict=True)
        ),
        Course("march by the flow law alone", left, {"dynamic_operation": 1.0}),
    ]
    carried = dict.fromkeys([left[:1], left])
    dynamic = [
        Course("with " + ", ".join(terms), left[len(terms) :], {"dynamic_operation": 1.0}, modelled=terms)
        for terms in carried
    ]
    return (*quasi_steady, *dynamic)


def _laws(book: LawBook) -> list[LawModels]:
    """Flow laws of an injection, in order of increasing cost.

    The paper's law, and every loss with Eq. 12 and with the exact level, with the crest's regimes where the
    scene has a crest; last the scene's finest law.
    """
    every = book.models()
    regimes = every[-1].regimes
    kept = [law for law in every if law.regimes == regimes and law.level in (EQ_12, CLOSED)]
    return list(dict.fromkeys([every[0], *kept, every[-1]]))


def _law(book: LawBook, law: LawModels, course: Course) -> CompleteLaw:
    """The paper's own law where the closed form in time needs its two coefficients."""
    return paper_law(book.scene) if course.name == _CLOSED_FORM else book.law(law)


def _gas_times(scene: Scene) -> tuple[float, float]:
    """Valve-open times of an injection at which it is judged: the shortest that matters and the first, s."""
    low, high = sorted((injection_time(scene), first_gas_time(scene)))
    return low, high


def _operation_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the ways through time leave out, and what their laws do, relative to the mass moved."""
    change = _velocity_change(scene, max(_gas_times(scene)))
    segments = {
        name: Contribution(
            term=name,
            value=change / (2 * count),
            formula="change of the velocity over an operation / (2 n)",
            source="Euler's step, first order",
            rough=True,
        )
        for count, name in zip(_SEGMENTS, EXPLICIT, strict=True)
    }
    return {**flow_contributions(scene), **segments, **injection_estimates(scene)}


def _velocity_change(scene: Scene, duration: float) -> float:
    """Relative change of the velocity while the levels shift, (dP/dx) 2 dx/(2 p)."""
    velocity, disc = equal_velocity(scene), scene.disc
    if scene.gas.pressure <= 0:
        return 0.0
    per_fill = scene.liquid.density * scene.rotor.speed**2 / (disc.axial_width * disc.central_angle)
    return float(min(per_fill * scene.tube.area * velocity * duration / scene.gas.pressure, 1.0))


def mass_hierarchy(book: LawBook) -> ModelHierarchy:
    """Models of the mass that one injection moves, from equal fills and an empty tube, after its wait."""
    times = _gas_times(book.scene)

    def solve(point: int, *, law: LawModels, course: Course) -> FloatArray:
        made = _law(book, law, course)
        return np.array([moved_mass(book.scene, law=made, course=course, gas_time=times[point])])

    return ModelHierarchy(
        quantity="transferred_mass",
        title="mass moved by one operation",
        values=("kg out of the driven chamber",),
        points=tuple(f"{time:.3g} s of gas" for time in times),
        check=(0, 1),
        relative_to="each",
        contributions=_operation_contributions(book.scene),
        fidelities=_fidelities(book, _laws(book), courses(book.scene), solve, operations=1.0),
        top_uncertainty=book.uncertainty(),
        top_uncertainty_from="that of the velocity, as `calibrate` has it",
        status=chamber_status(book.scene),
    )


def moved_mass(scene: Scene, *, law: CompleteLaw, course: Course, gas_time: float) -> float:
    """Mass that leaves the driven chamber by one injection of `gas_time`, s, and the wait after it, kg."""
    model = BalancerModel.of(law)
    if course.integrator is not None and isinstance(law, PaperLaw):
        fill = scene.disc.initial_fill
        drive = paper_drive(law, gas_pressure=scene.gas.pressure, fill=fill, total=2 * fill)
        valve = course.integrator(drive, np.array([gas_time]))
        return (fill - float(valve.fill[-1])) * model.density * model.chamber_volume
    plant = LiquidRing(
        model=model,
        chambers=scene.disc.chambers,
        dynamics=dynamics_of(scene=scene, model=model, modelled=course.modelled),
    )
    start = DiscState.initial(disc=scene.disc)
    opened = plant.advance(start, gas_times={0: gas_time}, duration=gas_time, points=1)
    end = plant.advance(opened.state, gas_times={}, duration=scene.controller.period, points=1)
    return (start.fills()[0] - end.state.fills()[0]) * model.density * model.chamber_volume


def settling_hierarchy(book: LawBook) -> ModelHierarchy:
    """Models of the settling time with the scene's controller and an exact sensor; zero: not settled."""
    scene = book.scene
    exact = replace(
        scene,
        sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0),
        run=replace(scene.run, time_limit=min(scene.run.time_limit, _WATCHED)),
    )
    first, *others = _laws(book)
    laws = [law for law in others if law.level == CLOSED and law.loss != CONSTANT]
    ways = [course for course in courses(scene) if course.integrator is None]

    def solve(_: int, *, law: LawModels, course: Course) -> FloatArray:
        found = simulate(exact, flow_law=_law(book, law, course), modelled=course.modelled)
        return np.array([found.settling_time or 0.0])

    return replace(
        mass_hierarchy(book),
        quantity="settling_time",
        title="settling time",
        values=("s; 0 for a run that does not settle",),
        points=("the scene's initial vibration",),
        check=(0,),
        fidelities=_fidelities(
            book, dict.fromkeys([first, *laws, *others[-1:]]), ways, solve, operations=_OPERATIONS
        ),
    )


def _fidelities(
    book: LawBook,
    laws: Iterable[LawModels],
    ways: Iterable[Course],
    solve: Callable[..., FloatArray],
    *,
    operations: float,
) -> tuple[Fidelity, ...]:
    """Every law with every way through time that suits it; the finest last.

    The closed form in time goes with Eq. 19 alone, which is no table that has to be made.
    """
    paper, found = book.models()[0], []
    for law in laws:
        for course in ways:
            closed = course.name == _CLOSED_FORM
            if closed and law != paper:
                continue
            work = {kind: count * operations for kind, count in course.work.items()} | {"step": operations}
            counted = course._replace(work=work)
            fidelity = book.fidelity(law, partial(solve, law=law, course=course), counted)
            found.append(replace(fidelity, fixed_work={}, prepare=None) if closed else fidelity)
    return tuple(found)
