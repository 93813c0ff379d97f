"""Intervals (95 %) of fitted parameters by profile likelihood.

A value x_i belongs to the interval while the sum of squares S, minimised over all other parameters with x_i
held, is within q = t^2 of its least value; t is Student's for the degrees of freedom behind the noise,
normal where the noise is given. For several noises, by Welch and Satterthwaite, nu = (sum
c_g)^2/sum(c_g^2/nu_g), c_g the part of group g in the parameter's variance. Weights from
estimated noises favour data that look quieter by chance: the true variance is larger by about 2 L with

    L = C sum (2/nu_g) (W_g - W_g C W_g) C,

W_g the information of group g and C the covariance, both of all unknowns; q grows by as much.
If the threshold is not reached within the rules of the scene, the end is the bound.
Source: Bates and Watts, "Nonlinear Regression Analysis" (1988), section 6.1; Satterthwaite, Biometrics
Bull. 2 (1946) 110; Kenward and Roger, Biometrics 53 (1997) 983.

`Joint` is the distribution of parameters and held inputs together, with their covariance: at the
optimum the residuals r are linear in the parameters t, the eliminated unknowns b and the held inputs n, so
that all of them are jointly normal with (A'A)^-1, A = dr/d(t, b, n), priors and n's own rows among them. A
group whose noise is estimated with nu degrees of freedom has its rows divided by t_nu(0.975)/1.96, which
makes 95 % intervals as wide as Student's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import stdtrit

from ringbalance.identification.optimisation import Optimum, optimum, searched
from ringbalance.identification.parameters import inputs_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.errors import MODEL_ERRORS
from ringbalance.scene.fitted import LARGEST_ERROR
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.uncertain import NORMAL_95

_END_TOLERANCE: Final = 0.01
"""Relative tolerance of the root of the rise of S at an end of the interval."""
_GAIN: Final = 1e-3
"""Reduction of S below which the search over the other parameters ends."""
_TRIALS: Final = 16
_MAX_STEP: Final = 0.7
"""Largest step, in t, beyond the last trial inside the interval."""
_LARGEST_STEP: Final = 3.0
"""Largest ratio of a trial's distance to the last one inside or to that by the curvature at the optimum."""


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Profile likelihood of one parameter."""

    low: float
    """t at the lower end."""
    high: float
    low_bound: bool
    """True if the lower end is a bound, not the threshold."""
    high_bound: bool
    factor: float
    """Threshold of the root of the rise of S: Student's t, with the effect of estimated weights."""
    ends: tuple[tuple[float, ...], tuple[float, ...]]
    """Values t of all parameters at both ends."""
    points: tuple[tuple[float, float], ...]
    """Pairs of t and rise of S above its minimum, ascending in t."""


def covariance(slopes: FloatArray) -> FloatArray:
    """Covariance (A'A)^-1, A = d(residuals)/dt; variance very large along directions that A leaves open."""
    _, s, vt = np.linalg.svd(slopes, full_matrices=False)
    # Lower bound: the variance is finite even for data without any information.
    largest = np.max(s, initial=1e-100)
    scaled = vt.T / np.where(s <= 1e-10 * largest, 1e-10 * largest, s)
    return np.asarray(scaled @ scaled.T)


def profiles(best: Optimum, spread: FloatArray) -> list[Profile]:
    """Interval of each parameter. Args: `spread`: `covariance` at the optimum."""
    # t(0.975) of each parameter, increased for estimated weights.
    (data, priors), count, group = best.of_all, best.t.size, best.residuals.problem.group
    inverse, parts = covariance(np.concatenate([data, priors])), np.linalg.pinv(best.slopes, rcond=1e-10) ** 2
    total, below, added = np.sum(parts, axis=1), np.zeros(count), np.zeros(count)
    for g, nu in enumerate(best.freedom.tolist()):
        below += np.sum(parts[:, : group.size][:, group == g], axis=1) ** 2 / nu
        mine = data[group == g]
        rows = mine @ inverse
        # Diagonal of C (W - W C W) C, from the covariance of the rows.
        left = (rows.T @ rows) @ (np.eye(len(inverse)) - mine.T @ rows)
        added += 2 / nu * np.diag(left)[:count]
    freedom = np.divide(total**2, below, out=np.full(count, np.inf), where=below > 1e-9 * total**2)
    by_weights = np.maximum(added, 0.0) / np.diag(inverse)[:count]
    limited = np.minimum(np.maximum(freedom, 1.0), 1e9)
    factors = stdtrit(limited, 0.975) * np.sqrt(1 + 2 * by_weights)
    least, intervals = float(np.sum(best.at**2)), []
    for i, factor in enumerate(factors.tolist()):
        low, low_bound, low_t, points = _end(best, i, -1.0, factor, spread, least)
        high, high_bound, high_t, more = _end(best, i, 1.0, factor, spread, least)
        intervals.append(
            Profile(
                low=low,
                high=high,
                low_bound=low_bound,
                high_bound=high_bound,
                factor=factor,
                ends=(tuple(low_t.tolist()), tuple(high_t.tolist())),
                points=tuple(sorted([*points, (float(best.t[i]), 0.0), *more])),
            )
        )
    return intervals


def _end(
    best: Optimum, which: int, sign: float, factor: float, spread: FloatArray, least: float
) -> tuple[float, bool, FloatArray, list[tuple[float, float]]]:
    """Find the end of an interval, at which the root of S - S0, nearly linear in t, is `factor`.

    Secant method with limited steps. Returns: t of the parameter there; True if it is a bound; t of all
    parameters in the last trial; t and rise of S of all trials.
    """
    bounds = best.residuals.problem.bounds
    bound, best_t = float(bounds[0 if sign < 0 else 1][which]), float(best.t[which])
    sigma = math.sqrt(float(spread[which, which]))
    direction = spread[:, which] / max(float(spread[which, which]), 1e-300)
    inside, outside, start = (0.0, 0.0), (math.inf, math.inf), best.t
    points: list[tuple[float, float]] = []
    distance = min(factor * sigma, _MAX_STEP)
    for _ in range(_TRIALS):
        trial = best_t + sign * distance
        if (trial - bound) * sign >= 0:
            trial, distance = bound, abs(bound - best_t)
        begin = np.clip(start + direction * (trial - start[which]), *bounds)
        begin[which] = trial
        end, at = searched(best.residuals, begin, gain=_GAIN, fixed=which)
        rise = float(at @ at) - least
        root = math.sqrt(max(rise, 0.0))
        points.append((trial, rise))
        at_bound = root < factor and trial == bound
        if at_bound or abs(root - factor) <= _END_TOLERANCE * factor:
            return trial, at_bound, end, points
        if root < factor:
            inside, start = (distance, root), end
            if len(points) > 1:
                direction = (end - best.t) / (trial - best_t)
        else:
            outside = (distance, root)
        reach, root = inside
        if math.isinf(outside[0]):
            slope = root / reach if reach > 0 else 1 / sigma
            furthest = min(reach + _MAX_STEP, _LARGEST_STEP * max(reach, factor * sigma))
            distance = min(factor / max(slope, 1e-300), furthest)
        else:
            part = (factor - root) / (outside[1] - root)
            distance = reach + min(max(part, 0.05), 0.95) * (outside[0] - reach)
    trial = best_t + sign * (inside[0] if math.isinf(outside[0]) else outside[0])
    return trial, False, end, points


_ROUNDS: Final = 4
_LINEAR: Final = 0.1
"""Largest error of the linearised prediction with all pulls, in standard deviations of a measured number."""
_UNKNOWN: Final = 0.5
"""Largest standard deviation, in t, without a prior: the interval in a scene must not reach beyond zero."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """Normal distribution of fitted parameters and held inputs."""

    names: tuple[str, ...]
    """Names of the parameters, then of the held inputs, in the order of the fit."""
    covariance: FloatArray
    """Covariance, SI, of errors of models in standard deviations, shape (n, n)."""

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations, as in the covariance, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))


def about_pulls(best: Optimum, held: Mapping[str, float], *, scene: AnyScene, loss: str) -> Optimum:
    """Optimum with the effects of held inputs linearised at the values to which the data pull them.

    Repeated until a prediction with all pulls agrees with the linear one; models are those of the resulting
    device.
    Args: `held`: standard deviations, SI, in the order of the problem. `scene`: before the fit.
    """
    for _ in range(_ROUNDS):
        residuals, t = best.residuals, best.t
        problem, pulls = residuals.problem, _allowed(held, residuals.linear_values(t)[1])
        pulled = scene
        for (name, sd), pull in zip(held.items(), pulls.tolist(), strict=True):
            pulled = inputs_of(pulled).changed(name, pull * sd)
        moved_problem = replace(problem, scene=pulled)
        models = inputs_of(moved_problem.scene_at(t)).models
        if models is not None:
            # The gauge error of the data remains relative to the scene before the fit.
            moved_problem = replace(
                moved_problem, models=replace(models, gas_pressure=problem.models.gas_pressure)
            )
        linear = problem.at(t) + residuals.held @ (pulls - residuals.pulled)
        if np.max(residuals.scale * np.abs(moved_problem.at(t) - linear), initial=0.0) < _LINEAR:
            break
        effects = moved_problem.held_effects(
            t, [inputs_of(pulled).both_sides(*each) for each in held.items()]
        )
        moved = replace(residuals, problem=moved_problem, held=effects, pulled=pulls)
        best = optimum(
            moved_problem, effects, loss=loss, starts=best.starts, before=replace(best, residuals=moved)
        )
    return best


def _allowed(held: Mapping[str, float], pulls: FloatArray) -> FloatArray:
    """Pulls, those of model errors limited to `LARGEST_ERROR`."""
    limits = [LARGEST_ERROR if name in MODEL_ERRORS else np.inf for name in held]
    return np.clip(pulls, -np.array(limits), limits)


def joint_of(best: Optimum, held: Mapping[str, float]) -> Joint:
    """Joint distribution of parameters and held inputs at the optimum."""
    problem, t, parameters = best.residuals.problem, best.t, best.residuals.problem.parameters
    data, priors = best.of_all
    count, free = t.size, problem.free.shape[1]
    student = np.append(stdtrit(np.clip(best.freedom, 1.0, 1e9), 0.975) / NORMAL_95, 1.0)
    # Weak priors of parameters without a prior.
    weak = np.zeros((count, data.shape[1]))
    weak[np.arange(count), np.arange(count)] = [0.0 if p.prior else 1 / _UNKNOWN for p in parameters]
    inverse = covariance(np.concatenate([data / student[problem.group][:, None], priors, weak]))
    columns = np.r_[:count, count + free : count + free + len(held)]
    slopes = [p.slope(inner) for p, inner in zip(parameters, t.tolist(), strict=True)]
    scale = np.concatenate([slopes, list(held.values())])
    return Joint(
        names=(*(p.name for p in parameters), *held),
        covariance=inverse[np.ix_(columns, columns)] * np.outer(scale, scale),
    )


def scene_as_fitted(best: Optimum, held: Mapping[str, float]) -> AnyScene:
    """Scene with fitted values, most likely values of held inputs, and corrected models."""
    residuals, scene = best.residuals, best.residuals.problem.scene
    steps = _allowed(held, residuals.linear_values(best.t)[1]) - residuals.pulled
    for (name, sd), step in zip(held.items(), steps.tolist(), strict=True):
        scene = inputs_of(scene).changed(name, step * sd)
    as_fitted: AnyScene = replace(residuals.problem, scene=scene).scene_at(best.t)
    models = residuals.problem.models
    if models is None:
        return as_fitted
    # The difference in gas pressure is the error of the gauge of the data.
    ring = liquid_ring_scene(as_fitted)
    off = ring.gas.pressure - models.gas_pressure
    return replace(ring, gas=replace(ring.gas, gauge_correction=off))
