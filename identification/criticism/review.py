"""What a fit's residuals say of its laws: whether they describe the data, and which others would not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.identification.criticism.at_solution import AtSolution, at_solution
from ringbalance.identification.criticism.law_comparison import LawComparison, compare_laws
from ringbalance.identification.criticism.other_laws import EXPONENTS, laws_to_compare, other_law
from ringbalance.identification.criticism.patterns import Criticism, criticise
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.predict.device import device_of
from ringbalance.identification.result import FitResult
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_BY_LAW: Final = ("injection", "transfer", "flow")
"""Kinds that the law of the tube's flow decides on."""


@dataclass(frozen=True, kw_only=True)
class Review:
    """Criticism of a fit."""

    criticism: Criticism
    laws: tuple[LawComparison, ...]
    """The fitted law of the tube's flow against others; empty where no data depend on it."""

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
    problem, t = result.optimum.residuals.problem, result.optimum.t
    blocks = [b for b in problem.blocks if b.observations.kind in _BY_LAW]
    if not blocks or not isinstance(problem.scene, Scene):
        return
    scene, law = problem.scene_at(t), device_of(problem.scene_at(t), problem.models).law
    velocity = _typical_velocity(scene, problem, blocks)
    for name in laws_to_compare(law):
        models = replace(problem.models, other=partial(other_law, name=name, velocity=velocity))
        other = replace(problem, models=models)
        predicted = np.concatenate(
            [b.whiten @ _predicted(b, scene, other, EXPONENTS.get(name)) for b in problem.blocks]
        )
        residuals = found.turned(result.optimum.residuals.at(t, predicted=predicted))
        yield compare_laws(found.fit, other=name, residuals=residuals)


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
