"""Speed against accuracy, measured on a scene: hierarchies, fronts and trade-off points, and the models it
asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.reduced_model.selection.estimates import term_estimates
from ringbalance.reduced_model.selection.registry import models_used
from ringbalance.results.result import CommandResult
from ringbalance.scene.joint import without_fitted
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Level
from ringbalance.verification.selection_studies.chambers import chamber_hierarchies
from ringbalance.verification.selection_studies.choice import TOLERANCES, Choice, choose
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Values, Work
from ringbalance.verification.selection_studies.laws import (
    QUADRATURE,
    LawBook,
    k_hierarchy,
    velocity_hierarchy,
)
from ringbalance.verification.selection_studies.measure import (
    Clock,
    CostModel,
    Measured,
    Trade,
    committed_costs,
    fitted_costs,
    measure,
)
from ringbalance.verification.selection_studies.operation import EXPLICIT, mass_hierarchy, settling_hierarchy
from ringbalance.verification.selection_studies.scene_numbers import scene_numbers

Record = dict[str, Any]

_CHAMBER: Final = ("wall_pressure", "moment")
_BY_LAW: Final = {
    "velocity": velocity_hierarchy,
    "transferred_mass": mass_hierarchy,
    "settling_time": settling_hierarchy,
}
_LOOP: Final = "settling_time"
"""Takes whole runs of the loop, so that a light trade leaves it out."""


def hierarchies_of(scene: Scene, quantities: Sequence[str]) -> Iterator[ModelHierarchy]:
    """Model hierarchies of some quantities, made one after the other.

    Args: `quantities`: "wall_pressure", "moment", "k", "velocity", "transferred_mass", "settling_time".
    """
    if set(quantities) & set(_CHAMBER):
        yield from (h for h in chamber_hierarchies(scene) if h.quantity in quantities)
    if "k" in quantities:
        yield k_hierarchy(scene)
    flow = [_BY_LAW[quantity] for quantity in quantities if quantity in _BY_LAW]
    if flow:
        book = LawBook(scene)
        yield from (hierarchy(book) for hierarchy in flow)


@dataclass(frozen=True, kw_only=True, repr=False)
class TradeStudy(CommandResult):
    """All model hierarchies of one scene, measured."""

    scene: Scene
    trades: tuple[Trade, ...]
    choices: Mapping[str, tuple[Choice, ...]]
    """By quantity, for each tolerance and last for the scene's own."""
    costs: CostModel
    refit: CostModel | None
    """Fitted to this run's times; None when nothing was timed."""

    def lines(self) -> Iterator[str]:
        """For a terminal: the models chosen for each quantity."""
        yield f"Speed against accuracy of {self.scene.name} ({self.scene.source})"
        for trade in self.trades:
            title, choices = trade.hierarchy.title, self.choices[trade.hierarchy.quantity]
            if choices:
                chosen = choices[-1]
                yield f"{title}: {chosen.fidelity.name} at {chosen.tolerance:.0e}, {chosen.cost:.2g} s"

    def to_dict(self) -> dict[str, Any]:
        """See `document`."""
        return self.document()

    def document(self) -> Record:
        """Plain numbers and texts; all but `times` is the same on every machine."""
        scene = self.scene
        return {
            "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
            "tolerance": scene.tolerance,
            "numbers": [asdict(number) for number in scene_numbers(scene)],
            "terms": terms_document(scene),
            "models_used": [asdict(used) for used in models_used(scene)],
            "cost_model": {"fitted_on": self.costs.fitted_on, "seconds": dict(self.costs.seconds)},
            "quantities": [_quantity(trade, self.choices[trade.hierarchy.quantity]) for trade in self.trades],
            "times": _times(self),
        }


def trade_study(
    scene: Scene,
    *,
    level: Level = "heavy",
    tolerances: Sequence[float] = TOLERANCES,
    timed: bool = True,
    progress: Callable[[str], None] | None = None,
) -> TradeStudy:
    """Measure every model hierarchy of a scene and choose its models; all but times repeats on every machine.

    Args: `level`: "light" leaves out the settling time and models close to others, takes times once and
        chooses models for the mass for the scene's own tolerance alone. `timed`: whether times and memory are
        taken as well. `progress`: called with each quantity's name.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    """
    check_ring(scene)
    scene = without_fitted(scene)
    light, costs = level == "light", committed_costs()
    trades, chosen = [], {}
    clock = Clock(repeats=1, memory=False) if light else Clock()
    quantities = [q for q in (*_CHAMBER, "k", *_BY_LAW) if q != _LOOP or not light]
    for hierarchy in hierarchies_of(scene, quantities):
        if progress is not None:
            progress(hierarchy.title)
        values, quantity = Values(hierarchy), hierarchy.quantity
        # Runs of the whole loop are timed once each, and not traced; a light study times no laws.
        timer = Clock(repeats=1, memory=False) if quantity == _LOOP else clock
        counts = timed and not (light and quantity in _BY_LAW)
        shown = thinned(hierarchy) if light else hierarchy
        trades.append(measure(shown, values=values, costs=costs, clock=timer if counts else None))
        wanted = () if light and quantity == "transferred_mass" else tolerances
        chosen[quantity] = tuple(
            choose(hierarchy, tolerance, costs=costs, values=values)
            for tolerance in (*wanted, held_tolerance(scene.tolerance))
            if hierarchy.points
        )
    refit = _refitted(trades, costs=costs)
    return TradeStudy(scene=scene, trades=tuple(trades), choices=chosen, costs=costs, refit=refit)


def thinned(hierarchy: ModelHierarchy) -> ModelHierarchy:
    """A model hierarchy without the models that lie close to others; choices are made on the whole one."""

    def kept(fidelity: Fidelity) -> bool:
        close = {QUADRATURE, EXPLICIT[-1]} & set(fidelity.models.values())
        return fidelity is hierarchy.top or "level of a chamber" not in fidelity.models or not close

    return replace(hierarchy, fidelities=tuple(filter(kept, hierarchy.fidelities)))


def _timed(trades: Sequence[Trade]) -> list[tuple[Work, float]]:
    """Counted work over all points, and s, of all timed models."""
    return [(m.counted, m.seconds) for trade in trades for m in trade.fidelities if m.seconds is not None]


def _refitted(trades: Sequence[Trade], *, costs: CostModel) -> CostModel | None:
    """Fit the cost model again to measured times; kinds of work without a time keep to `costs`."""
    if not (timed := _timed(trades)):
        return None
    works, seconds = zip(*timed, strict=True)
    told = f"processor times of {len(seconds)} models"
    return fitted_costs(works=works, seconds=seconds, fitted_on=told, prior=costs)


def held_tolerance(tolerance: float) -> float:
    """A tolerance, held within the range that models are chosen for."""
    return min(max(tolerance, min(TOLERANCES)), max(TOLERANCES))


def tolerance_text(tolerance: float, say: Callable[[float], str]) -> str:
    """The tolerance that models are chosen for, beside the scene's own where that is out of range."""
    taken, told = held_tolerance(tolerance), f"this scene's tolerance of {say(tolerance)}"
    return told if taken == tolerance else f"{say(taken)}, the nearest to {told} that models are chosen for"


def terms_document(scene: Scene) -> list[Record]:
    """Estimated contribution of every physical term of a scene, as plain numbers and texts."""
    return [
        {
            "term": c.term,
            "estimated_contribution": c.value,
            "above": c.above(scene.tolerance),
            "why": c.reason(scene.tolerance),
        }
        for c in term_estimates(scene).values()
    ]


def _quantity(trade: Trade, choices: Sequence[Choice]) -> Record:
    hierarchy = trade.hierarchy
    return {
        "quantity": hierarchy.quantity,
        "title": hierarchy.title,
        "values": list(hierarchy.values),
        "points": list(hierarchy.points),
        "status": {"code": str(hierarchy.status.code), "text": hierarchy.status.text},
        "top": hierarchy.top.name,
        "top_uncertainty": hierarchy.top_uncertainty,
        "top_uncertainty_from": hierarchy.top_uncertainty_from,
        "contributions": [
            {"term": c.term, "value": c.value, "formula": c.formula, "source": c.source}
            for c in hierarchy.contributions.values()
        ],
        "rungs": [_fidelity(found) for found in trade.fidelities],
        "knee": trade.knee,
        "choices": [_choice_document(choice) for choice in choices],
    }


def _fidelity(found: Measured) -> Record:
    return {
        "name": found.fidelity.name,
        "models": dict(found.fidelity.models),
        "leaves_out": sorted(found.fidelity.leaves_out),
        "work": dict(found.fidelity.work),
        "fixed_work": dict(found.fidelity.fixed_work),
        "error": found.error,
        "cost_s": found.cost,
        "on_front": found.on_front,
    }


def _choice_document(choice: Choice) -> Record:
    """A choice as plain numbers and texts."""
    return {
        "tolerance": choice.tolerance,
        "first": choice.first.name,
        "rung": choice.fidelity.name,
        "models": dict(choice.fidelity.models),
        "reference": None if choice.reference is None else choice.reference.name,
        "measured": choice.measured,
        "climbed": choice.climbed,
        "cost_s": choice.cost,
        "checking_cost_s": choice.checking_cost,
        "reasons": list(choice.reasons),
    }


def _times(study: TradeStudy) -> Record | None:
    if study.refit is None:
        return None
    ratios = np.array([study.costs.cost(work) / seconds for work, seconds in _timed(study.trades)])
    low, middle, high = (float(np.quantile(ratios, q)) for q in (0.1, 0.5, 0.9))
    return {
        "rungs": {
            trade.hierarchy.quantity: [
                {"name": found.fidelity.name, "seconds": found.seconds, "memory_bytes": found.memory}
                for found in trade.fidelities
            ]
            for trade in study.trades
        },
        "refit_seconds": dict(study.refit.seconds),
        "counted_over_measured": {"median": middle, "low": low, "high": high},
    }
