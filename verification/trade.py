"""Speed against accuracy, measured on a scene: ladders, fronts and knees, and the models it asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from ringbalance.reduced_model.cost_model import CostModel, committed_costs, fitted_costs
from ringbalance.reduced_model.gravity import check_ring
from ringbalance.reduced_model.ladder_choice import Choice, Values, choose
from ringbalance.reduced_model.law_rungs import QUADRATURE, SERIES, base_law
from ringbalance.reduced_model.rungs import Ladder, Rung
from ringbalance.reduced_model.rungs_chamber import chamber_ladders
from ringbalance.reduced_model.rungs_flow import LawBook, k_ladder, velocity_ladder
from ringbalance.reduced_model.scene_numbers import scene_numbers
from ringbalance.scene.models import Scene
from ringbalance.verification.trade_measure import Clock, Measured, Trade, measure, works_and_seconds
from ringbalance.verification.trade_operation import EXPLICIT, MANY, mass_ladder, settling_ladder

Record = dict[str, Any]
Level = Literal["light", "heavy"]

TOLERANCES: Final = (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
QUICK: Final = ("wall_pressure", "moment", "k", "velocity", "transferred_mass")
"""Quantities of a light trade; the settling time takes whole runs of the loop."""
_OWN_ALONE: Final = (("light", "transferred_mass"),)
"""Where models are chosen for the scene's own tolerance alone."""
_LAWS: Final = ("velocity", "transferred_mass")


@dataclass(frozen=True, kw_only=True)
class TradeStudy:
    """All ladders of one scene, measured."""

    scene: Scene
    trades: tuple[Trade, ...]
    choices: Mapping[str, tuple[Choice, ...]]
    """By quantity, for each tolerance and last for the scene's own."""
    costs: CostModel
    refit: CostModel | None
    """Fitted to this run's times; None when nothing was timed."""


def ladders_of(scene: Scene, *, level: Level = "heavy") -> tuple[Ladder, ...]:
    """The ladders of a scene.

    Args:
        scene: the scene.
        level: "light" leaves the settling time out.

    Returns:
        Wall pressure, moment, k, velocity, transferred mass and, heavy, settling time.

    Raises:
        SceneError: a rotor too slow for the liquid to form a ring.
    """
    check_ring(scene)
    book = LawBook(scene, base_law(scene))
    quick = (
        *chamber_ladders(scene),
        k_ladder(scene),
        velocity_ladder(scene, book=book),
        mass_ladder(scene, book=book),
    )
    return quick if level == "light" else (*quick, settling_ladder(scene, book=book))


def trade_study(
    scene: Scene,
    *,
    level: Level = "heavy",
    tolerances: Sequence[float] = TOLERANCES,
    timed: bool = True,
    progress: Callable[[str], None] | None = None,
) -> TradeStudy:
    """Measure every ladder of a scene and choose its models.

    Args:
        scene: the scene.
        level: "light" leaves the settling time out.
        tolerances: for which models are chosen, beside the scene's own.
        timed: whether times and memory are taken as well.
        progress: called with the name of each quantity; None for silence.

    Returns:
        TradeStudy; all but its times is the same on every machine.

    Raises:
        SceneError: a rotor too slow for the liquid to form a ring.
    """
    costs = committed_costs()
    trades, chosen = [], {}
    clock = _clock(level) if timed else None
    for ladder in ladders_of(scene, level=level):
        if progress is not None:
            progress(ladder.title)
        values = Values(ladder)
        shown = thinned(ladder) if level == "light" else ladder
        trades.append(measure(shown, values=values, costs=costs, clock=_no_longer(clock, ladder)))
        wanted = _wanted(scene, () if (level, ladder.quantity) in _OWN_ALONE else tolerances)
        chosen[ladder.quantity] = tuple(
            choose(ladder, tolerance, costs=costs, values=values) for tolerance in wanted if ladder.points
        )
    return TradeStudy(
        scene=scene, trades=tuple(trades), choices=chosen, costs=costs, refit=refitted(trades, costs=costs)
    )


def thinned(ladder: Ladder) -> Ladder:
    """A ladder of laws with every second rung left out: levels and ways through time that lie close together.

    Args:
        ladder: any ladder.

    Returns:
        The ladder; the highest rung stays, and choices are made on the whole one.
    """

    def kept(rung: Rung) -> bool:
        close = rung.models.get("level of a chamber") in (SERIES, QUADRATURE)
        return rung is ladder.top or not (close or rung.models.get("operation in time") == EXPLICIT[MANY])

    return replace(ladder, rungs=tuple(rung for rung in ladder.rungs if kept(rung)))


def _clock(level: Level) -> Clock:
    return Clock(repeats=3) if level == "heavy" else Clock(repeats=1, memory=False)


def _no_longer(clock: Clock | None, ladder: Ladder) -> Clock | None:
    """Runs of the whole loop are timed once each, and not traced; a light study times no laws."""
    if clock is None or (clock.repeats == 1 and ladder.quantity in _LAWS):
        return None
    return Clock(repeats=1, memory=False) if ladder.quantity == "settling_time" else clock


def refitted(trades: Sequence[Trade], *, costs: CostModel) -> CostModel | None:
    """Fit the cost model anew to the times of measured ladders.

    Args:
        trades: measured; may be of several scenes.
        costs: the model that kinds of work without a time of their own keep to.

    Returns:
        CostModel; None where nothing was timed.
    """
    works, seconds = works_and_seconds(trades)
    if not seconds:
        return None
    told = f"processor times of {len(seconds)} rungs"
    return fitted_costs(works=works, seconds=seconds, fitted_on=told, prior=costs)


def _wanted(scene: Scene, tolerances: Sequence[float]) -> tuple[float, ...]:
    """The tolerances and, last, the scene's own held within what choices are made for."""
    return (*tolerances, held_tolerance(scene.tolerance))


def held_tolerance(tolerance: float) -> float:
    """A scene's tolerance, held within the range that models are chosen for.

    Args:
        tolerance: relative.

    Returns:
        The same within 1e-6 and 0.1.
    """
    return min(max(tolerance, min(TOLERANCES)), max(TOLERANCES))


def tolerance_text(tolerance: float, say: Callable[[float], str]) -> str:
    """The tolerance that models are chosen for, beside the scene's own where that is out of range.

    Args:
        tolerance: the scene's.
        say: writes a tolerance.

    Returns:
        "this scene's tolerance of 1 %", or the nearest to it that models are chosen for.
    """
    taken, told = held_tolerance(tolerance), f"this scene's tolerance of {say(tolerance)}"
    return told if taken == tolerance else f"{say(taken)}, the nearest to {told} that models are chosen for"


def trade_document(study: TradeStudy) -> Record:
    """A study as plain numbers and texts.

    Args:
        study: the study.

    Returns:
        Record; all but `times` is the same on every machine.
    """
    scene = study.scene
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "tolerance": scene.tolerance,
        "numbers": [
            {"name": n.name, "value": n.value, "formula": n.formula, "tells": n.tells}
            for n in scene_numbers(scene)
        ],
        "cost_model": {"fitted_on": study.costs.fitted_on, "seconds": dict(study.costs.seconds)},
        "quantities": [_quantity(trade, study.choices[trade.ladder.quantity]) for trade in study.trades],
        "times": _times(study),
    }


def _quantity(trade: Trade, choices: Sequence[Choice]) -> Record:
    ladder = trade.ladder
    return {
        "quantity": ladder.quantity,
        "title": ladder.title,
        "values": list(ladder.values),
        "points": list(ladder.points),
        "status": {"code": str(ladder.status.code), "text": ladder.status.text},
        "top": ladder.top.name,
        "top_uncertainty": ladder.top_uncertainty,
        "top_uncertainty_from": ladder.top_uncertainty_from,
        "contributions": [
            {"term": c.term, "value": c.value, "formula": c.formula, "source": c.source}
            for c in ladder.contributions.values()
        ],
        "rungs": [_rung(found) for found in trade.rungs],
        "knee": trade.knee,
        "choices": [choice_document(choice) for choice in choices],
    }


def _rung(found: Measured) -> Record:
    return {
        "name": found.rung.name,
        "models": dict(found.rung.models),
        "leaves_out": sorted(found.rung.leaves_out),
        "work": dict(found.rung.work),
        "fixed_work": dict(found.rung.fixed_work),
        "error": found.error,
        "cost_s": found.cost,
        "on_front": found.on_front,
    }


def choice_document(choice: Choice) -> Record:
    """A choice as plain numbers and texts.

    Args:
        choice: the choice.

    Returns:
        Record.
    """
    return {
        "tolerance": choice.tolerance,
        "first": choice.first.name,
        "rung": choice.rung.name,
        "models": dict(choice.rung.models),
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
    works, seconds = works_and_seconds(study.trades)
    ratios = np.array([study.costs.cost(w) for w in works]) / np.array(seconds)
    return {
        "rungs": {
            trade.ladder.quantity: [
                {"name": found.rung.name, "seconds": found.seconds, "memory_bytes": found.memory}
                for found in trade.rungs
            ]
            for trade in study.trades
        },
        "refit_seconds": dict(study.refit.seconds),
        "counted_over_measured": {
            "median": float(np.median(ratios)),
            "low": float(np.quantile(ratios, 0.1)),
            "high": float(np.quantile(ratios, 0.9)),
        },
    }
