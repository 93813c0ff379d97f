"""The choice of models judged: error against the highest rung, cost against the cheapest that would do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from ringbalance.reduced_model.cost_model import committed_costs
from ringbalance.reduced_model.ladder_choice import Values, choose, ranked_rungs
from ringbalance.reduced_model.law_rungs import base_law
from ringbalance.reduced_model.rungs import Contribution, Ladder
from ringbalance.reduced_model.rungs_chamber import chamber_ladders
from ringbalance.reduced_model.rungs_flow import LawBook, k_ladder, velocity_ladder
from ringbalance.scene.models import Scene
from ringbalance.verification.trade_operation import mass_ladder, settling_ladder

CHAMBER: Final = ("wall_pressure", "moment")
TOLERANCES: Final = (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One choice, judged."""

    scene: str
    quantity: str
    tolerance: float
    rung: str
    error: float
    """Against the highest rung over all points of the ladder."""
    cost_ratio: float
    """Cost over that of the cheapest rung that keeps the tolerance; 1 where none does."""
    climbed: bool
    said: bool
    """Whether a tolerance below the highest rung's own uncertainty is answered with that."""

    @property
    def held(self) -> bool:
        """Whether the tolerance is kept."""
        return self.error <= self.tolerance


def ladders_for(scene: Scene, quantities: Sequence[str]) -> Iterator[Ladder]:
    """Ladders of some quantities, made one after the other.

    Args:
        scene: the scene.
        quantities: "wall_pressure", "moment", "k", "velocity", "transferred_mass", "settling_time".

    Yields:
        Ladders that have points.
    """
    chamber = chamber_ladders(scene) if set(quantities) & set(CHAMBER) else ()
    makers = {"velocity": velocity_ladder, "transferred_mass": mass_ladder, "settling_time": settling_ladder}
    flow = [quantity for quantity in quantities if quantity in makers]
    yield from (ladder for ladder in chamber if ladder.quantity in quantities and ladder.points)
    if "k" in quantities:
        yield k_ladder(scene)
    if flow:
        book = LawBook(scene, base_law(scene))
        yield from (makers[quantity](scene, book=book) for quantity in flow)


def judge(
    scene: Scene,
    *,
    quantities: Sequence[str],
    tolerances: Sequence[float] = TOLERANCES,
    check: bool = True,
    worth: float = 1.0,
) -> list[Judged]:
    """Choose models for a scene at every tolerance, and judge each choice by the highest rung.

    Args:
        scene: the scene.
        quantities: names.
        tolerances: relative.
        check: whether choices are checked; without it the estimates alone decide.
        worth: factor on every contribution; anything but 1 is a deliberate fault.

    Returns:
        One record for each quantity and tolerance.
    """
    found = []
    for ladder in ladders_for(scene, quantities):
        spoiled = replace(ladder, contributions=_spoiled(ladder.contributions, worth))
        values = Values(spoiled)
        found += [_judged(scene, spoiled, values, tolerance, check=check) for tolerance in tolerances]
    return found


def _spoiled(contributions: Mapping[str, Contribution], worth: float) -> Mapping[str, Contribution]:
    return {
        term: replace(c, value=None if c.value is None else c.value * worth)
        for term, c in contributions.items()
    }


def _judged(scene: Scene, ladder: Ladder, values: Values, tolerance: float, *, check: bool) -> Judged:
    costs, points = committed_costs(), tuple(range(len(ladder.points)))
    choice = choose(ladder, tolerance, check=check, costs=costs, values=values)
    cheapest = choice.cost
    for rung in ranked_rungs(ladder, costs):
        cost = costs.of_rung(rung, points=len(points))
        if cost >= choice.cost:
            break
        if values.error(rung, ladder.top, points) <= tolerance:
            cheapest = cost
            break
    return Judged(
        scene=scene.name,
        quantity=ladder.quantity,
        tolerance=tolerance,
        rung=choice.rung.name,
        error=values.error(choice.rung, ladder.top, points),
        cost_ratio=choice.cost / cheapest,
        climbed=choice.climbed,
        said=tolerance >= ladder.top_uncertainty or any("is below what" in text for text in choice.reasons),
    )
