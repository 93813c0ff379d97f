"""What a fit leaves of parameters and held inputs together: values as fitted, and their covariance.

At the optimum the residuals r are linear in the parameters t, the eliminated unknowns b and the held inputs
n, so that all of them are jointly normal with (A'A)^-1, A = dr/d(t, b, n), priors and n's own rows among
them.  A group whose noise is estimated with nu degrees of freedom has its rows divided by t_nu(0.975)/1.96,
which makes 95 % intervals as wide as Student's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import stdtrit

from ringbalance.identification.intervals import covariance
from ringbalance.identification.likelihood import Problem
from ringbalance.identification.optimisation import Optimum, optimum
from ringbalance.identification.parameters import MODEL_ERRORS, both_sides, changed, models_for
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.fitted import LARGEST_ERROR
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.uncertain import NORMAL_95

_ROUNDS: Final = 4
_CLOSE: Final = 0.1
"""Standard deviations of a measured number by which a prediction with all pulls may miss the linear one."""
_UNKNOWN: Final = 0.5
"""Standard deviation, in t, at most of what nothing is known of: a scene states no interval beyond zero."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """Normal distribution of fitted parameters and held inputs."""

    names: tuple[str, ...]
    """Of the parameters, then of the held inputs, as the fit names them."""
    values: FloatArray
    """SI; of an error of a model in its standard deviations."""
    covariance: FloatArray
    """Of these, shape (n, n)."""

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations."""
        return np.sqrt(np.diag(self.covariance))


def about_pulls(best: Optimum, held: Mapping[str, float], *, scene: AnyScene, loss: str) -> Optimum:
    """The optimum with the effects of held inputs taken at the values to which the data pull them.

    Until a prediction with all pulls is the linear one; models are those of the device so found.
    Args: `held`: standard deviations, SI, in the order of the problem's. `scene`: that is fitted.
    """
    for _ in range(_ROUNDS):
        residuals, t = best.residuals, best.t
        problem, pulls = residuals.problem, _allowed(held, residuals.held_values(t))
        there = _pulled(problem, scene, t, dict(zip(held, pulls, strict=True)), held)
        linear = problem.at(t) + residuals.held @ (pulls - residuals.pulled)
        if np.max(residuals.scale * np.abs(there.at(t) - linear), initial=0.0) < _CLOSE:
            break
        effects = there.held_effects(t, [both_sides(there.scene, name, sd) for name, sd in held.items()])
        moved = replace(residuals, problem=there, held=effects, pulled=pulls)
        best = optimum(there, effects, loss=loss, starts=best.starts, before=replace(best, residuals=moved))
    return best


def _allowed(held: Mapping[str, float], pulls: FloatArray) -> FloatArray:
    """Pulls as far as models can err."""
    limits = [LARGEST_ERROR if name in MODEL_ERRORS else np.inf for name in held]
    return np.clip(pulls, -np.array(limits), limits)


def _pulled(
    problem: Problem, scene: AnyScene, t: FloatArray, pulls: Mapping[str, float], held: Mapping[str, float]
) -> Problem:
    """The problem of the scene with its held inputs pulled."""
    for name, pull in pulls.items():
        scene = changed(scene, name, pull * held[name])
    there = replace(problem, scene=scene)
    models = models_for(there.scene_at(t))
    before = problem.models
    if models is None or before is None:
        return there
    # What the gauge of the data is off by stays that against the scene that is fitted.
    return replace(there, models=replace(models, gas_pressure=before.gas_pressure, other=before.other))


def joint_of(best: Optimum, held: Mapping[str, float]) -> Joint:
    """Distribution of parameters and held inputs at the optimum."""
    problem, t = best.residuals.problem, best.t
    data, known = best.of_all
    count, free = t.size, problem.free.shape[1]
    rows = np.concatenate([data / _widening(best)[:, None], known, _weak(problem, data.shape[1])])
    whole = covariance(rows)
    kept = np.r_[:count, count + free : count + free + len(held)]
    pulls = best.residuals.held_values(t)
    slopes = [p.slope(inner) for p, inner in zip(problem.parameters, t.tolist(), strict=True)]
    scale = np.concatenate([slopes, list(held.values())])
    values = [p.value(inner) for p, inner in zip(problem.parameters, t.tolist(), strict=True)]
    return Joint(
        names=(*(p.name for p in problem.parameters), *held),
        values=np.concatenate([values, pulls]),
        covariance=whole[np.ix_(kept, kept)] * np.outer(scale, scale),
    )


def _widening(best: Optimum) -> FloatArray:
    """t_nu(0.975)/1.96 of every number of the data."""
    group = best.residuals.problem.group
    by_group = np.append(stdtrit(np.clip(best.freedom, 1.0, 1e9), 0.975) / NORMAL_95, 1.0)
    return np.asarray(by_group[group])


def _weak(problem: Problem, count: int) -> FloatArray:
    """Rows of parameters of which nothing is known beforehand."""
    rows = np.zeros((len(problem.parameters), count))
    for i, parameter in enumerate(problem.parameters):
        rows[i, i] = 0.0 if parameter.prior else 1 / _UNKNOWN
    return rows


def scene_as_fitted(best: Optimum, held: Mapping[str, float]) -> AnyScene:
    """The scene with the fitted values, the values to which held inputs are pulled, and corrected models."""
    residuals, scene = best.residuals, best.residuals.problem.scene
    steps = _allowed(held, residuals.held_values(best.t)) - residuals.pulled
    for (name, sd), step in zip(held.items(), steps.tolist(), strict=True):
        scene = changed(scene, name, step * sd)
    as_fitted: AnyScene = replace(residuals.problem, scene=scene).scene_at(best.t)
    models = residuals.problem.models
    return as_fitted if models is None else models.with_gauge_correction(liquid_ring_scene(as_fitted))
