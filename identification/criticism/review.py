"""What a fit's residuals say of its laws: whether they describe the data, and which others would not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.identification.criticism.at_solution import AtSolution, at_solution
from ringbalance.identification.criticism.law_comparison import LawComparison, compare_laws
from ringbalance.identification.criticism.other_laws import EXPONENTS, WITHOUT, laws_to_compare, other_law
from ringbalance.identification.criticism.patterns import Criticism, criticise
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.predict.device import device_of
from ringbalance.identification.result import FitResult
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import eccentric_with

_BY_LAW: Final = ("injection", "transfer", "flow")
"""Kinds that the law of the tube's flow decides on."""


@dataclass(frozen=True, kw_only=True)
class Review:
    """Criticism of a fit."""

    criticism: Criticism
    laws: tuple[LawComparison, ...]
    """The fitted law against others; empty where no data depend on one."""

    @property
    def holds(self) -> bool:
        """Whether the fit describes the data, and no other law does so better."""
        return self.criticism.describes and all(each.outcome != "other" for each in self.laws)

    @property
    def sentences(self) -> tuple[str, ...]:
        """All that is to be said, the verdict on the fit first."""
        return (self.criticism.text, *(each.text for each in self.laws))


def review(result: FitResult) -> Review:
    """Test the residuals of a fit and compare its law with others."""
    found = at_solution(result)
    return Review(
        criticism=criticise(found.fit, found.covariates),
        laws=tuple(_comparisons(result, found)),
    )


def _comparisons(result: FitResult, found: AtSolution) -> Iterator[LawComparison]:
    best = result.optimum
    problem, scene = best.residuals.problem, best.residuals.problem.scene_at(best.t)
    predictions = _by_other_tubes if isinstance(scene, Scene) else _by_other_machines
    for name, predicted in predictions(problem, scene):
        residuals = found.turned(best.residuals.at(best.t, predicted=predicted))
        yield compare_laws(found.fit, other=name, residuals=residuals)


def _by_other_machines(problem: Problem, scene: EccentricScene) -> Iterator[tuple[str, FloatArray]]:
    """Without one of the effects that move the data, unless its size is fitted: then its interval tells."""
    fitted = {parameter.name for parameter in problem.parameters}
    kinds = {block.observations.kind for block in problem.blocks}
    for name, (kind, paths) in WITHOUT.items():
        if kind in kinds and not fitted & set(paths):
            other = scene
            for path in paths:
                other = eccentric_with(other, 0.0, name=path)
            yield name, problem.predicted(other)


def _by_other_tubes(problem: Problem, scene: Scene) -> Iterator[tuple[str, FloatArray]]:
    """By other laws of the tube's flow, where data depend on it."""
    blocks = [b for b in problem.blocks if b.observations.kind in _BY_LAW]
    if not blocks:
        return
    law, velocity = device_of(scene, problem.models).law, _typical_velocity(scene, problem, blocks)
    for name in laws_to_compare(law):
        models = replace(problem.models, other=partial(other_law, name=name, velocity=velocity))
        other = replace(problem, models=models)
        yield (
            name,
            np.concatenate(
                [b.whiten @ _predicted(b, scene, other, EXPONENTS.get(name)) for b in problem.blocks]
            ),
        )


def _predicted(block: Block, scene: Scene, problem: Problem, exponent: float | None) -> FloatArray:
    """By the other law; flow at rest follows a power of the pressure through its middle value."""
    own = block.kind.predict(scene, block.observations, problem.models)
    if block.observations.kind != "flow" or exponent is None:
        return own
    pressure = block.observations.columns["pressure_difference"]
    middle = int(np.argsort(pressure)[pressure.size // 2])
    return np.asarray(own[middle] * (pressure / pressure[middle]) ** (1 / exponent))


def _typical_velocity(scene: Scene, problem: Problem, blocks: list[Block]) -> float:
    """At equal fills under the middle of the data's gas pressures, m/s; 1 where nothing flows there."""
    pressures = [b.observations.columns["pressure"] for b in blocks if "pressure" in b.observations.columns]
    pressure = float(np.median(np.concatenate(pressures))) if pressures else scene.gas.pressure
    law, x = device_of(scene, problem.models).law, scene.disc.initial_fill
    flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure, primed=True)
    return abs(float(flow.velocity)) or 1.0
