"""The fit of a scene's parameters to measurements: maximum likelihood, profiles, verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from ringbalance.identification.balancers import both_sides, held_for, informed, models_for, parameters_for
from ringbalance.identification.identifiability import Combination, Identified, combinations, verdicts
from ringbalance.identification.intervals import Profile, covariance, profiles
from ringbalance.identification.joint import about_pulls, joint_of, scene_as_fitted
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.kinds.registry import KINDS, kinds_of
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.optimisation import Optimum, optimum
from ringbalance.identification.parameters import FitError, Parameter
from ringbalance.identification.result import FileResiduals, FitResult, FittedParameter, Noise
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.uncertain import NORMAL_95

Loss = Literal["linear", "soft_l1"]
STARTS: Final = 3
_NO_EFFECT: Final = 1e-3
"""Of a standard deviation of the data, in all, below which a held input is left out."""
_HALF: Final = 0.5


def fit(
    scene: AnyScene,
    *,
    data: Sequence[Observations],
    parameters: Sequence[str] | None = None,
    loss: Loss = "linear",
    starts: int = STARTS,
) -> FitResult:
    """Fit parameters of a scene to measurements.

    Args: `parameters`: names; None: those that the kinds of data inform. `loss`: "linear" (normal noise) or
        "soft_l1" (outliers count less). `starts`: searches from the scene and from around it.
    Raises: FitError: data or parameters that cannot be fitted. ValueError: data that do not fit the scene.
    Source: `likelihood`, `optimisation`, `intervals`, `identifiability`.
    """
    problem = problem_of(scene, data, parameters)
    names = [p.name for p in problem.parameters]
    held = held_for(scene, names)
    nothing = np.zeros((problem.measured.size, 0))
    first = optimum(problem, nothing, loss=loss, starts=starts)
    effects = problem.held_effects(first.t, [both_sides(scene, name, sd) for name, sd in held.items()])
    counts = np.linalg.norm(first.residuals.scale[:, None] * effects, axis=0) > _NO_EFFECT
    best = optimum(problem, effects[:, counts], loss=loss, starts=starts, before=first)
    kept = {name: sd for (name, sd), one in zip(held.items(), counts, strict=True) if one}
    return _result(about_pulls(best, kept, scene=scene, loss=loss), kept, loss)


def problem_of(
    scene: AnyScene, data: Sequence[Observations], parameters: Sequence[str] | None = None
) -> Problem:
    """The problem that `fit` solves. Raises: FitError: as `fit`."""
    if not data:
        raise FitError("give at least one file of measurements")
    for each in data:
        if each.kind not in kinds_of(scene.balancer):
            raise FitError(f"{each.file}: data of kind {each.kind} do not belong to this balancer")
        if reason := KINDS[each.kind].obstacle(scene, each):
            raise FitError(f"{each.file}: {reason}")
    names = informed(scene, data) if parameters is None else list(parameters)
    return Problem(
        scene=scene,
        models=models_for(scene),
        parameters=parameters_for(scene, names),
        blocks=tuple(Block.of(each) for each in data),
    )


def _result(best: Optimum, held: dict[str, float], loss: str) -> FitResult:
    problem, spread = best.residuals.problem, covariance(best.slopes)
    data = best.slopes[: best.slopes.shape[0] - int(np.count_nonzero(problem.with_prior))]
    intervals = profiles(best, spread)
    found = verdicts(problem.parameters, best.t, data, intervals)
    products = combinations(problem.parameters, best.t, data, found, intervals)
    each = zip(problem.parameters, best.t.tolist(), intervals, found, strict=True)
    size = np.sqrt(np.diag(spread))
    return FitResult(
        parameters=tuple(_fitted(*one, products) for one in each),
        correlations=spread / np.outer(size, size),
        combinations=products,
        noise=_noises(best),
        residuals=_residuals(best),
        held=held,
        pulls=dict(zip(held, (best.residuals.held_values(best.t) / NORMAL_95).tolist(), strict=True)),
        loss=loss,
        starts=best.starts,
        evaluations=problem.evaluations,
        log_likelihood=_log_likelihood(best),
        scene=scene_as_fitted(best, held),
        joint=joint_of(best, held),
        optimum=best,
    )


def _fitted(
    parameter: Parameter, t: float, found: Profile, verdict: Identified, products: Sequence[Combination]
) -> FittedParameter:
    before = None
    if parameter.prior:
        width = NORMAL_95 * parameter.prior
        before = parameter.start - width, parameter.start + width
    return FittedParameter(
        name=parameter.name,
        value=parameter.value(t),
        interval=(parameter.value(found.low), parameter.value(found.high)),
        at_bound=(found.low_bound, found.high_bound),
        before=parameter.start,
        before_interval=before,
        verdict=verdict,
        text=_verdict_text(parameter, verdict, products),
        profile=found,
        curve=tuple((parameter.value(at), rise / found.factor**2) for at, rise in found.points),
    )


def _verdict_text(parameter: Parameter, verdict: Identified, found: Sequence[Combination]) -> str:
    if verdict is Identified.IDENTIFIED:
        return "identified by the data"
    within = [c.text for c in found if parameter.name in c.names]
    only = f"; the data identify {' and '.join(within)}" if within else ""
    rest = (
        "its interval is that of the scene's [uncertainty]"
        if parameter.prior
        else "nothing else is known of it"
    )
    reason = {
        Identified.STRUCTURALLY: "no data of these kinds can tell it apart",
        Identified.PRACTICALLY: "these data hardly narrow it down",
    }[verdict]
    return f"{verdict}: {reason}{only}; {rest}"


def _noises(best: Optimum) -> tuple[Noise, ...]:
    problem = best.residuals.problem
    estimated = problem.estimated_groups
    given = dict.fromkeys(b.group for b in problem.blocks if not b.estimated)
    rows = [
        Noise(group=name, standard_deviation=float(s), estimated=True, freedom=float(f))
        for name, s, f in zip(estimated, best.residuals.noise, best.freedom, strict=True)
    ]
    return (
        *rows,
        *(Noise(group=name, standard_deviation=None, estimated=False, freedom=None) for name in given),
    )


def _residuals(best: Optimum) -> tuple[FileResiduals, ...]:
    """Normalised after what is no parameter has taken up its part."""
    problem, residuals = best.residuals.problem, best.residuals
    whole = best.at[: problem.measured.size] / np.sqrt(residuals.weights)
    found = []
    for block, mine in problem.rows:
        weights = block.observations.rows_of(residuals.weights[mine])
        found.append(
            FileResiduals(
                file=block.observations.file,
                kind=block.observations.kind,
                lines=block.observations.lines,
                normalised=block.observations.rows_of(whole[mine]),
                down_weighted=np.asarray(np.min(weights, axis=1) < _HALF),
            )
        )
    return tuple(found)


def _log_likelihood(best: Optimum) -> float:
    problem = best.residuals.problem
    logs = [np.sum(np.log(np.diag(b.whiten))) for b in problem.blocks]
    noise = np.sum(np.log(best.residuals.noise[problem.group[problem.group >= 0]]))
    return float(sum(logs) - noise - np.sum(best.at**2) / 2)
