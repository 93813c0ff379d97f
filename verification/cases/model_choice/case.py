"""Choices of models on random scenes, each judged by the highest rung and by the cheapest that would do.

Light: the loss of the tube on twelve scenes and the chamber of one.  Heavy: chamber, loss and velocity on 300
scenes, the mass moved by one operation and the settling time on every tenth of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ringbalance.physics.results import Status
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference, Table
from ringbalance.verification.trade_choices import CHAMBER, TOLERANCES, Judged, judge
from ringbalance.verification.trade_scenes import random_scene

SCENES: Final = 300
_LIGHT: Final = 12
_ALONE: Final = 2
"""Number of the one scene whose chamber is judged at the light level."""
_TERMS: Final = {"estimate_off": 1e-3, "estimate_large": 1e3}


def reference(_scene: Scene) -> Mapping[str, Reference]:
    """None: shares and ratios are judged against limits.

    Args:
        _scene: not used.

    Returns:
        Nothing.
    """
    return {}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Judge the choices.

    Args:
        scene: the base of the random scenes.
        level: "heavy" for 300 scenes.
        defect: "estimate_off" or "estimate_large".

    Returns:
        Evidence.
    """
    judged: list[Judged] = []
    if defect is not None:
        # A few scenes are enough for a mutation to show.
        level = "light"
    count = SCENES if level == "heavy" else _LIGHT
    for number in range(count):
        judged += _of(random_scene(scene, number), quantities_of(number, level), defect)
    below = [j for j in judged if not j.said]
    return Evidence(
        found={
            "held": Found(value=sum(j.held for j in judged) / len(judged)),
            "dearest": Found(value=max(j.cost_ratio for j in judged)),
            "said": Found(value=1.0 - len(below) / len(judged)),
        },
        numbers={
            "choices": float(len(judged)),
            "scenes": float(count),
            "climbed": float(sum(j.climbed for j in judged)),
        },
        tables=(_table(judged),),
        status=Status(),
    )


def quantities_of(number: int, level: Level) -> tuple[str, ...]:
    """Quantities that are judged on a scene.

    Args:
        number: of the scene.
        level: how much work may be done.

    Returns:
        Their names.
    """
    if level == "light":
        return ("k", *CHAMBER) if number == _ALONE else ("k",)
    more = ("transferred_mass", "settling_time") if number % 10 == 0 else ()
    return (*CHAMBER, "k", "velocity", *more)


def _of(scene: Scene, quantities: tuple[str, ...], defect: str | None) -> list[Judged]:
    if defect is None:
        return judge(scene, quantities=quantities)
    factor = _TERMS[defect]
    return judge(scene, quantities=quantities, check=False, worth=factor)


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
