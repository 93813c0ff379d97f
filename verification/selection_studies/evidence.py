"""Choices of models on random scenes as evidence: shares kept, and the most expensive."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Table
from ringbalance.verification.selection_studies.choices import TOLERANCES, Judged, judge
from ringbalance.verification.selection_studies.scenes import random_scene

DEFECTS: Final = {"estimate_off": 1e-3, "estimate_large": 1e3}
"""Factors on every contribution, by the mutation's name."""


def choices_evidence(
    scene: Scene,
    *,
    numbers: Iterable[int],
    quantities_of: Callable[[int], tuple[str, ...]],
    defect: str | None,
) -> Evidence:
    """Choose models for random scenes at every tolerance, and judge the choices.

    Args: `scene`: the base of the random scenes. `quantities_of`: judged on a scene, by its number. `defect`:
        with one of `DEFECTS` nothing is checked.
    """
    taken = list(numbers)
    worth, check = (1.0, True) if defect is None else (DEFECTS[defect], False)
    judged = [
        found
        for number in taken
        for found in judge(
            random_scene(scene, number), quantities=quantities_of(number), check=check, worth=worth
        )
    ]
    below = [j for j in judged if not j.said]
    return Evidence(
        found={
            "held": Found(value=sum(j.held for j in judged) / len(judged)),
            "dearest": Found(value=max(j.cost_ratio for j in judged)),
            "said": Found(value=1.0 - len(below) / len(judged)),
        },
        numbers={
            "choices": float(len(judged)),
            "scenes": float(len(taken)),
            "climbed": float(sum(j.climbed for j in judged)),
        },
        tables=(_table(judged),),
    )


def _table(judged: list[Judged]) -> Table:
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
