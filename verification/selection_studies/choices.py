"""The choice of models judged: error against the finest model, cost against the cheapest that would do."""

# ruff: noqa: ARG001 - every study has the uniform case interface
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from ringbalance.reduced_model.contribution import Contribution
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.selection_studies.chamber_models import chamber_hierarchies
from ringbalance.verification.selection_studies.choice import Values, choose
from ringbalance.verification.selection_studies.cost import committed_costs
from ringbalance.verification.selection_studies.hierarchy import ModelHierarchy
from ringbalance.verification.selection_studies.law_models import base_law
from ringbalance.verification.selection_studies.operation import mass_hierarchy, settling_hierarchy
from ringbalance.verification.selection_studies.scenes import random_scene
from ringbalance.verification.selection_studies.tube_models import LawBook, k_hierarchy, velocity_hierarchy

CHAMBER: Final = ("wall_pressure", "moment")
TOLERANCES: Final = (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_FEW: Final = 12
"""Scenes on which a mutation shows."""
_DEFECTS: Final = {"estimate_off": 1e-3, "estimate_large": 1e3}
"""Factors on every contribution, by the mutation's name."""


@dataclass(frozen=True, kw_only=True)
class _Judged:
    """One choice, judged."""

    scene: str
    quantity: str
    tolerance: float
    fidelity: str
    error: float
    """Against the finest model over all points of the hierarchy."""
    cost_ratio: float
    """Cost over that of the cheapest model that keeps the tolerance; 1 where none does."""
    climbed: bool
    said: bool
    """Whether a tolerance below the finest model's own uncertainty is answered with that."""

    @property
    def held(self) -> bool:
        """Whether the tolerance is kept."""
        return self.error <= self.tolerance


def hierarchies_for(scene: Scene, quantities: Sequence[str]) -> Iterator[ModelHierarchy]:
    """Model hierarchies of some quantities, made one after the other.

    Args: `quantities`: "wall_pressure", "moment", "k", "velocity", "transferred_mass", "settling_time".
    """
    chamber = chamber_hierarchies(scene) if set(quantities) & set(CHAMBER) else ()
    makers = {
        "velocity": velocity_hierarchy,
        "transferred_mass": mass_hierarchy,
        "settling_time": settling_hierarchy,
    }
    flow = [quantity for quantity in quantities if quantity in makers]
    yield from (hierarchy for hierarchy in chamber if hierarchy.quantity in quantities)
    if "k" in quantities:
        yield k_hierarchy(scene)
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
) -> list[_Judged]:
    """Choose models for a scene at every tolerance, and judge each choice by the finest model.

    Args: `check`: whether choices are checked; without it the estimates alone decide. `worth`: factor on
        every contribution; anything but 1 is a deliberate error.
    """
    found = []
    for hierarchy in hierarchies_for(scene, quantities):
        if not hierarchy.points:
            continue
        spoiled = replace(hierarchy, contributions=_spoiled(hierarchy.contributions, worth))
        values = Values(spoiled)
        found += [_judged(scene, spoiled, values, tolerance, check=check) for tolerance in tolerances]
    return found


def _spoiled(contributions: Mapping[str, Contribution], worth: float) -> Mapping[str, Contribution]:
    return {
        term: replace(c, value=None if c.value is None else c.value * worth)
        for term, c in contributions.items()
    }


def _judged(
    scene: Scene, hierarchy: ModelHierarchy, values: Values, tolerance: float, *, check: bool
) -> _Judged:
    costs, points = committed_costs(), tuple(range(len(hierarchy.points)))
    choice = choose(hierarchy, tolerance, check=check, costs=costs, values=values)
    cheapest = choice.cost
    for fidelity in costs.ranked(hierarchy):
        cost = costs.of_fidelity(fidelity, points=len(points))
        if cost >= choice.cost:
            break
        if values.error(fidelity, hierarchy.top, points) <= tolerance:
            cheapest = cost
            break
    return _Judged(
        scene=scene.name,
        quantity=hierarchy.quantity,
        tolerance=tolerance,
        fidelity=choice.fidelity.name,
        error=values.error(choice.fidelity, hierarchy.top, points),
        cost_ratio=choice.cost / cheapest,
        climbed=choice.climbed,
        said=tolerance >= hierarchy.top_uncertainty
        or any("is below what" in text for text in choice.reasons),
    )


def study(
    scene: Scene,
    level: Level,
    defect: str | None,
    *,
    scenes: int,
    quantities: Sequence[str],
    more: Sequence[str],
    every: int,
    first: int,
) -> Evidence:
    """Choose models for random scenes at every tolerance, and judge the choices.

    Args: `defect`: with one nothing is checked, and a few scenes do. `quantities`: judged on all `scenes`.
        `more`: judged on every so many of them, from the `first` on.
    """
    taken = range(scenes if defect is None else min(scenes, _FEW))
    worth, check = (1.0, True) if defect is None else (_DEFECTS[defect], False)
    judged = [
        found
        for number in taken
        for found in judge(
            random_scene(scene, number),
            quantities=[*quantities, *(more if number % every == first else ())],
            check=check,
            worth=worth,
        )
    ]
    below = [j for j in judged if not j.said]
    return Evidence(
        found=as_found(
            held=sum(j.held for j in judged) / len(judged),
            dearest=max(j.cost_ratio for j in judged),
            said=1.0 - len(below) / len(judged),
        ),
        numbers={
            "choices": float(len(judged)),
            "scenes": float(len(taken)),
            "climbed": float(sum(j.climbed for j in judged)),
        },
        tables=(_table(judged),),
    )


def _table(judged: list[_Judged]) -> Table:
    """Shares by quantity and tolerance."""
    rows = [(q, t) for q in dict.fromkeys(j.quantity for j in judged) for t in TOLERANCES]
    groups = [[j for j in judged if j.quantity == q and j.tolerance == t] for q, t in rows]
    return Table(
        name="choices by quantity and tolerance",
        columns={
            "quantity": [q.replace("_", " ") for q, _ in rows],
            "tolerance": [t for _, t in rows],
            "choices": [float(len(group)) for group in groups],
            "held": [sum(j.held for j in group) / max(len(group), 1) for group in groups],
            "dearest": [max((j.cost_ratio for j in group), default=1.0) for group in groups],
        },
    )
