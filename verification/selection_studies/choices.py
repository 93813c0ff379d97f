"""The choice of models judged: error against the finest model, cost against the cheapest that would do."""

# ruff: noqa: ARG001 - every study has the uniform case interface
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.models import Bend, Disc, Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.selection_studies.choice import TOLERANCES, choose
from ringbalance.verification.selection_studies.hierarchy import Values
from ringbalance.verification.selection_studies.measure import committed_costs
from ringbalance.verification.selection_studies.study import hierarchies_of

_FEW: Final = 12
"""Scenes on which a mutation shows."""
_DEFECTS: Final = {"estimate_off": 1e-3, "estimate_large": 1e3}
"""Factors on every contribution, by the mutation's name."""
_SEED: Final = 20_260
"""Of the random scenes, drawn from wide ranges and the same for the same number."""
_LOWEST_RATIO: Final = 1.3
"""Smallest omega^2 a/g at the largest fill."""
_ANGLES: Final = (45.0, 60.0, 90.0)
"""Central angles, degrees."""


@dataclass(frozen=True, kw_only=True)
class _Judged:
    """One choice, judged."""

    quantity: str
    tolerance: float
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
    for hierarchy in hierarchies_of(scene, quantities):
        contributions = {
            term: replace(c, value=None if c.value is None else c.value * worth)
            for term, c in hierarchy.contributions.items()
        }
        values = Values(replace(hierarchy, contributions=contributions))
        found += [_judged(values, tolerance, check=check) for tolerance in tolerances if hierarchy.points]
    return found


def _judged(values: Values, tolerance: float, *, check: bool) -> _Judged:
    hierarchy, costs = values.hierarchy, committed_costs()
    choice = choose(hierarchy, tolerance, check=check, costs=costs, values=values)
    enough = (
        cost
        for fidelity in costs.ranked(hierarchy)
        if (cost := costs.cost(fidelity.counted(len(hierarchy.points)))) >= choice.cost
        or values.error(fidelity) <= tolerance
    )
    return _Judged(
        quantity=hierarchy.quantity,
        tolerance=tolerance,
        error=values.error(choice.fidelity),
        cost_ratio=choice.cost / next(enough),
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


def random_scene(base: Scene, number: int) -> Scene:
    """A scene with disc, liquid, tube, gas, shaft and speed drawn at random, the rest as in `base`.

    A ring exists: the speed lies between 1.3 times what gravity allows and 15 000 rpm.
    """
    rng = np.random.default_rng([_SEED, number])
    disc = _disc(base.disc, rng)
    gravity = base.environment.gravity
    a = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio))
    slowest = math.sqrt(_LOWEST_RATIO * gravity / a)
    speed = _between(rng, slowest, 15_000 * math.pi / 30, even_in_log=True)
    density = _between(rng, 700.0, 2500.0)
    liquid = replace(
        base.liquid,
        name="custom",
        density=density,
        kinematic_viscosity=_between(rng, 3e-7, 2e-4, even_in_log=True),
        density_uncertainty=0.0,
        viscosity_uncertainty=0.0,
    )
    level = density * speed**2 * (disc.outer_radius**2 - a**2) / 2
    pressure = max(_between(rng, 0.5, 4.0) * level, 2e3)
    scene = replace(
        base,
        name=f"random scene {number}",
        disc=disc,
        liquid=liquid,
        rotor=replace(base.rotor, speed=speed),
        environment=replace(base.environment, shaft="vertical" if rng.random() < 0.05 else "horizontal"),
        gas=replace(base.gas, pressure=pressure),
        uncertainty=(),
        source=f"random {number}",
    )
    return _with_tube(scene, rng)


def _between(rng: np.random.Generator, low: float, high: float, *, even_in_log: bool = False) -> float:
    if even_in_log:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))
    return float(rng.uniform(low, high))


def _disc(base: Disc, rng: np.random.Generator) -> Disc:
    outer = _between(rng, 0.03, 0.12, even_in_log=True)
    angle = float(rng.choice(_ANGLES))
    inner = outer * _between(rng, 0.3, 0.6)
    largest = _between(rng, 0.25, 0.6)
    return replace(
        base,
        outer_radius=outer,
        inner_radius=inner,
        axial_width=outer * _between(rng, 0.4, 2.0),
        central_angle=math.radians(angle),
        chambers=round(360 / angle),
        plate_thickness=inner * math.sin(math.radians(angle) / 2) * _between(rng, 0.0, 0.25),
        max_fill_ratio=largest,
        initial_fill=largest / 2,
    )


def _with_tube(scene: Scene, rng: np.random.Generator) -> Scene:
    disc, bore = scene.disc, _between(rng, 0.8e-3, 4e-3, even_in_log=True)
    hump = None
    if rng.random() < 0.6:
        hump = disc.inner_radius + (disc.outer_radius - disc.inner_radius) * _between(rng, 0.3, 0.9)
    tube = replace(
        scene.tube,
        bore=bore,
        port_radius=disc.outer_radius,
        hump_radius=hump,
        length=_between(rng, 2.5, 5.0) * disc.outer_radius + 4 * bore,
        roughness=bore * _between(rng, 1e-4, 1e-2, even_in_log=True),
        bends=(Bend(angle=math.pi / 2, radius=2 * bore),) * int(rng.integers(0, 3)),
        drag_coefficient=None,
    )
    return replace(scene, tube=tube)
