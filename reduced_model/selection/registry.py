"""The registry of physical terms: the models of each in order of cost, and the one that a tolerance selects.

Every command takes `models_used` from here, so that all of them report the same list for the same scene.  A
new term is entered in `TERMS`, its estimate in `estimates`; its model lives with the part that it changes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final, Literal

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.chamber.closed_forms import chamber_pressure
from ringbalance.reduced_model.chamber.range import mean_gravity
from ringbalance.reduced_model.chamber.terms import MEAN, PLATES
from ringbalance.reduced_model.contribution import Contribution, percent
from ringbalance.reduced_model.selection.estimates import (
    FILLING,
    HELD,
    INERTIA,
    LAG,
    RIPPLE_AND_SLOSHING,
    SURFACE_TENSION,
    WALL_FRICTION,
    term_estimates,
)
from ringbalance.reduced_model.selection.range_flow import steady
from ringbalance.reduced_model.selection.tube_terms import (
    BENDS,
    CREST,
    ENDS,
    PART_TERMS,
    ROTATION,
    ROUGHNESS,
    TUBE_LOSS,
    loss_effect,
    tube_models,
)
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import CORRELATION, FINEST, FINEST_MODELS, LEFT_OUT

Part = Literal["chamber", "tube", "injection"]
NOT_MODELLED: Final = "not modelled in this version"
CALIBRATED: Final = "calibrated"
"""Name of the law that is made of the models selected here."""


@dataclass(frozen=True, kw_only=True)
class ModelUsed:
    """The model that serves one term of a scene, as `models_used` lists it."""

    term: str
    model: str
    """The model used, "left out", or "not modelled in this version"."""
    why: str
    """Formula of the estimate, comparison with the tolerance, and further reasons."""
    estimated_contribution: float | None
    """Relative, before solving; None where the scene gives no basis for an estimate."""

    @property
    def modelled(self) -> bool:
        """Whether a model holds the term."""
        return self.model not in (LEFT_OUT, NOT_MODELLED)


Selection = tuple[str, str]
"""Model and further reason."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """One physical term."""

    name: str
    """As in `term_estimates`."""
    part: Part
    """Those of chamber and tube are part of a flow law; those of an injection go beyond it."""
    models: tuple[str, ...]
    """In order of cost; the first neglects the term, and is the only one where none holds it."""
    select: Callable[[Term, Scene, Contribution], Selection]

    @property
    def has_model(self) -> bool:
        """Whether any model holds the term."""
        return len(self.models) > 1


def models_used(
    scene: Scene,
    *,
    law: str = CALIBRATED,
    obstacles: Mapping[str, str] = MappingProxyType({}),
    asked: Collection[str] | None = None,
) -> tuple[ModelUsed, ...]:
    """Model of every term of a scene, with the reason: chamber, tube, injection.

    Args:
        law: name of the flow law; any but the calibrated one has its own models of chamber and tube.
        obstacles: why the flow law cannot carry a term of an injection, by term.
        asked: the terms of an injection to model, whatever the tolerance; None: as the tolerance selects.
    """
    estimates = term_estimates(scene)
    rows = []
    for term in TERMS:
        estimate = estimates[term.name]
        reason = estimate.reason(scene.tolerance)
        model, more = _selected(term, scene, estimate, law=law, obstacles=obstacles, asked=asked)
        rows.append(
            ModelUsed(
                term=term.name,
                model=model,
                why=f"{reason}; {more}" if more else reason,
                estimated_contribution=estimate.value,
            )
        )
    return tuple(rows)


@dataclass(frozen=True, kw_only=True)
class _Neglected:
    """Terms of an injection that a run does not model, and a bound on them."""

    terms: tuple[str, ...]
    bound: float
    """Sum of their contributions, relative to the liquid that the shortest injection that matters moves."""
    unknown: tuple[str, ...]
    """Those that the scene gives no basis for an estimate of; not part of the bound."""
    text: str


def neglected_in_injections(used: Sequence[ModelUsed]) -> _Neglected:
    """What a run neglects beyond its flow law.

    Source: errors of one sign at worst; each estimate is an upper bound.
    """
    injection = {term.name for term in TERMS if term.part == "injection"}
    rows = [row for row in used if row.term in injection and not row.modelled]
    known = {r.term: r.estimated_contribution for r in rows if r.estimated_contribution is not None}
    unknown = tuple(row.term for row in rows if row.estimated_contribution is None)
    bound = float(sum(known.values()))
    # Without their numbers in the scene these two are a default range.
    ranges = [term for term in unknown if term in (FILLING, LAG)]
    others = [term for term in unknown if term not in ranges]
    more = f"; not in the scene, see the gas line's default range: {', '.join(ranges)}" if ranges else ""
    more += f"; not estimated, for lack of numbers in the scene: {', '.join(others)}" if others else ""
    return _Neglected(
        terms=tuple(known),
        bound=bound,
        unknown=unknown,
        text=f"{_change(known, bound, unknown)}{more}",
    )


def _change(terms: Collection[str], bound: float, unknown: Collection[str]) -> str:
    if not terms:
        told = " that the scene gives numbers for" if unknown else ""
        return f"no term of an injection{told} is neglected"
    return (
        f"neglected terms ({', '.join(terms)}) change the liquid moved by the shortest injection that "
        f"matters by {f'at most {percent(bound)}' if bound else 'nothing'}"
    )


def _selected(
    term: Term,
    scene: Scene,
    estimate: Contribution,
    *,
    law: str,
    obstacles: Mapping[str, str],
    asked: Collection[str] | None,
) -> Selection:
    if term.part != "injection":
        return term.select(term, scene, estimate) if law == CALIBRATED else (f"as in the law “{law}”", "")
    if asked is not None and term.has_model:
        return (term.models[-1] if term.name in asked else LEFT_OUT), "the caller's choice"
    model, more = term.select(term, scene, estimate)
    if model != LEFT_OUT and term.name in obstacles:
        return NOT_MODELLED, obstacles[term.name]
    return model, more


def _by_tolerance(term: Term, scene: Scene, estimate: Contribution) -> Selection:
    """The cheapest model where the contribution is within the tolerance, else the one that holds it."""
    if not estimate.above(scene.tolerance):
        return LEFT_OUT, ""
    return (term.models[-1] if term.has_model else NOT_MODELLED), ""


def _plates(term: Term, scene: Scene, _: Contribution) -> Selection:
    strips, exact = paper.chamber_volume_paper(disc=scene.disc), chamber_volume(disc=scene.disc)
    simpler = "flat strips" if scene.disc.geometry is None else "a plain sector"
    off = f"costs nothing; {simpler} would be {percent(abs(strips / exact - 1))} off in volume"
    return term.models[-1], off


def _gravity(term: Term, scene: Scene, _: Contribution) -> Selection:
    return term.models[mean_gravity(scene) > scene.tolerance], ""


def _sloshing(term: Term, scene: Scene, estimate: Contribution) -> Selection:
    return _by_tolerance(term, scene, estimate)[0], "it vanishes in the mean over a turn"


def _crest(term: Term, scene: Scene, _: Contribution) -> Selection:
    if scene.tube.hump_radius is None:
        return term.models[0], "Eq. 18, which levels the chambers out while the gas is off"
    moved = float(chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2)) / 1e6
    threshold = f"vented or trapped moves the threshold by up to {moved:.3g} MPa"
    gas = "vapour" if scene.liquid.dissolved_gas == "none" else "vapour or released gas"
    return (
        f"{term.models[-1]}, {scene.tube.hump_shape}, {scene.tube.hump_gas} gas, cavity of {gas}",
        threshold,
    )


def _tube_loss(term: Term, scene: Scene, _: Contribution) -> Selection:
    prescribed = scene.tube.drag_coefficient is not None
    return term.models[not (prescribed or tube_models(scene).constant)], ""


def _tube_part(term: Term, scene: Scene, estimate: Contribution) -> Selection:
    """The model that keeps the tolerance together with what is left out beside it."""
    if scene.tube.drag_coefficient is not None:
        return LEFT_OUT, ""
    part = PART_TERMS[term.name]
    model = getattr(tube_models(scene), part)
    if model == CORRELATION:
        off = loss_effect(steady(scene), replace(FINEST_MODELS, **{part: model})).k
        return term.models[1], f"the finest model would change it by {percent(off)}"
    below = estimate.value is not None and not estimate.above(scene.tolerance)
    if model == FINEST and below and scene.tolerance:
        return term.models[-1], "with what else is left out it would exceed the tolerance"
    return term.models[0 if model == LEFT_OUT else -1], ""


def _filling(term: Term, scene: Scene, estimate: Contribution) -> Selection:
    """With how far heat from the walls of a chamber moves the estimate."""
    model, _ = _by_tolerance(term, scene, estimate)
    if model == LEFT_OUT or estimate.time is None:
        return model, ""
    if scene.gas.process == "adiabatic":
        return model, "estimated isothermal, modelled without heat from the walls, which takes less"
    sooner = 1e3 * estimate.time * (1 - 1 / HEAT_CAPACITY_RATIO)
    return model, f"isothermal: without heat from the walls it would take up to {sooner:.3g} ms less"


TERMS: Final = (
    Term(name=PLATES, part="chamber", models=("flat strips", "exact geometry"), select=_plates),
    Term(
        name=MEAN,
        part="chamber",
        models=(LEFT_OUT, "quasi-static, free surface found, mean over a turn"),
        select=_gravity,
    ),
    Term(
        name=RIPPLE_AND_SLOSHING,
        part="chamber",
        models=(LEFT_OUT, "apart, by `ringbalance trade`; means over a turn do not hold it"),
        select=_sloshing,
    ),
    Term(name=SURFACE_TENSION, part="chamber", models=(LEFT_OUT,), select=_by_tolerance),
    Term(name=WALL_FRICTION, part="chamber", models=(LEFT_OUT,), select=_by_tolerance),
    Term(
        name=CREST,
        part="tube",
        models=("always a full siphon", "four regimes"),
        select=_crest,
    ),
    Term(
        name=TUBE_LOSS,
        part="tube",
        models=("constant k", "k(u), friction by Churchill's formula and what follows"),
        select=_tube_loss,
    ),
    Term(name=ROUGHNESS, part="tube", models=(LEFT_OUT, "in Churchill's formula"), select=_tube_part),
    Term(
        name=ROTATION,
        part="tube",
        models=(LEFT_OUT, "correlations", "finite-element table laminar, correlation turbulent"),
        select=_tube_part,
    ),
    Term(
        name=BENDS,
        part="tube",
        models=(LEFT_OUT, "correlation of turbulent flow", "finite elements laminar, correlation turbulent"),
        select=_tube_part,
    ),
    Term(
        name=ENDS,
        part="tube",
        models=(
            LEFT_OUT,
            "constants of turbulent flow",
            "finite elements laminar, constants turbulent",
        ),
        select=_tube_part,
    ),
    Term(
        name=INERTIA,
        part="injection",
        models=(LEFT_OUT, "rho L du/dt of the liquid in the tube, in injections"),
        select=_by_tolerance,
    ),
    Term(name=FILLING, part="injection", models=(LEFT_OUT, "ISO 6358, in injections"), select=_filling),
    Term(name=LAG, part="injection", models=(LEFT_OUT, "pure delay, in injections"), select=_by_tolerance),
    Term(
        name=HELD,
        part="injection",
        models=(LEFT_OUT, "lifted from the level to the crest unless the tube is primed, in injections"),
        select=_by_tolerance,
    ),
)
"""All physical terms, in the order of every `models_used`."""
IN_INJECTIONS: Final = tuple(term.name for term in TERMS if term.part == "injection" and term.has_model)
"""Terms that a closed-loop run can model beyond its flow law."""
