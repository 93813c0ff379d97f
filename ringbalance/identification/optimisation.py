"""Maximum-likelihood parameters, with the noise of each group, from several starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from ringbalance.identification.likelihood import Problem, Residuals
from ringbalance.identification.parameters import FitError, inputs_of
from ringbalance.scene.arrays import FloatArray

_FIRST_NOISE: Final = 0.02
"""Initial noise over the root mean square of a group's data."""
_LEAST_NOISE: Final = 1e-9
"""Smallest noise over the root mean square of a group's data; below it the data agree to round-off."""
_ROUNDS: Final = 25
"""Largest number of iterations of noise or robust weights."""
_AGREES: Final = 1e-3
"""Relative change of the noise at which its iteration ends."""
_EVALUATIONS: Final = 40
_NO_EFFECT: Final = 1e-3
"""Norm of the effect of a held input, in standard deviations of the data, below which it is left out."""
_NEARBY: Final = 1e-2
"""Difference of the sums of squares, relative or in few standard deviations, beyond which the minima of two
starts count as different."""
_START_DISTANCE: Final = 1.0
"""Largest distance of a further start in t, over the prior standard deviation or half of ln 2, if less."""
_MAX_START_REACH: Final = 0.35
_LEAST_GAIN: Final = 1e-8
"""Reduction of the sum of squares below which the search ends: a ten-thousandth of a standard deviation of a
parameter."""
_ROBUST: Final = 1.345
"""Residual in standard deviations beyond which soft_l1 becomes linear, for 95 % efficiency."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """Maximum of the likelihood."""

    t: FloatArray
    residuals: Residuals
    """Residuals with the noise at the optimum."""
    freedom: FloatArray
    """Degrees of freedom of each estimated group."""
    starts: int

    @property
    def at(self) -> FloatArray:
        """Residuals and priors at the optimum."""
        return self.residuals.at(self.t)

    @cached_property
    def of_prediction(self) -> FloatArray:
        """d(L^-1 f)/dt."""
        return self.residuals.problem.slopes(self.t)

    @cached_property
    def slopes(self) -> FloatArray:
        """d(residuals)/dt."""
        return self.residuals.slopes(self.t, self.of_prediction)

    @cached_property
    def of_all(self) -> tuple[FloatArray, FloatArray]:
        """Slopes by parameters, b and n: of the data, and of the priors and n."""
        residuals, priors = self.residuals, self.residuals.problem.prior_slopes(self.t)
        count, held = self.residuals.problem.measured.size, self.residuals.held.shape[1]
        data = np.hstack([residuals.scale[:, None] * self.of_prediction, residuals.linear[:count]])
        prior_rows = np.zeros((priors.shape[0] + held, data.shape[1]))
        prior_rows[: priors.shape[0], : self.t.size] = priors
        prior_rows[priors.shape[0] :, data.shape[1] - held :] = np.eye(held)
        return data, prior_rows


def optimum(
    problem: Problem, held: FloatArray, *, loss: str, starts: int, before: Optimum | None = None
) -> Optimum:
    """Maximise the likelihood over parameters and noise.

    The noise follows the residuals by s_g^2 = |e_g|^2/(n_g - sum h), h the leverages: restricted maximum
    likelihood, which accounts for parameters, priors and held inputs.  A robust loss weighs each
    number by 1/sqrt(1 + (e/c s)^2) with its residual e, and takes s from the median of |e|.
    Args: `held`: effects of held inputs. `loss`: "linear" or "soft_l1". `starts`: searches from the scene and
        from around it. `before`: an optimum to begin at instead.
    Raises: FitError: no more numbers than unknowns in a group whose noise is to be estimated.
    Source: Harville, J. Am. Stat. Assoc. 72 (1977) 320 (restricted likelihood); additive recurrence with the
        generalised golden ratio (Roberts, 2018) for the starts.
    """
    noise = _first_noise(problem) if before is None else before.residuals.noise
    weights = np.ones(problem.measured.size) if before is None else before.residuals.weights
    same = before is not None and before.residuals.held.shape == held.shape
    pulled = before.residuals.pulled if before is not None and same else np.zeros(held.shape[1])
    residuals = Residuals(problem=problem, noise=noise, held=held, weights=weights, pulled=pulled)
    if before is None:
        # Quasi-random points around that of the scene, within the bounds.
        low, high = problem.bounds
        ratio, size = 2.0, problem.start.size
        for _ in range(30):
            ratio = (1 + ratio) ** (1 / (size + 1))
        both = zip(problem.parameters, problem.start.tolist(), strict=True)
        reach = np.array(
            [min(p.prior / p.slope(t), _MAX_START_REACH) if p.prior else _MAX_START_REACH for p, t in both]
        )
        points = [problem.start]
        for n in range(1, starts):
            part = np.mod(n * ratio ** -np.arange(1, size + 1), 1.0)
            points.append(np.clip(problem.start + _START_DISTANCE * reach * (2 * part - 1), low, high))
        ends = [searched(residuals, point, gain=_NEARBY) for point in points]
        t = min(ends, key=lambda end: float(end[1] @ end[1]))[0]
    else:
        t = before.t
    of_prediction = problem.slopes(t)
    for _ in range(_ROUNDS):
        t, _ = searched(residuals, t, gain=_LEAST_GAIN)
        changed, freedom = _settled_noise(residuals, t, of_prediction, loss)
        done = _same(changed, residuals)
        residuals = changed
        if done:
            break
    used = starts if before is None else before.starts
    return Optimum(t=t, residuals=residuals, freedom=freedom, starts=used)


def optimum_as_stated(problem: Problem, *, loss: str, starts: int) -> tuple[Optimum, dict[str, float]]:
    """Optimum with held inputs as stated, and the standard deviations, SI, of inputs with an effect.

    Raises: FitError: see `optimum`.
    """
    inputs = inputs_of(problem.scene)
    held = inputs.held([each.name for each in problem.parameters])
    nothing = np.zeros((problem.measured.size, 0))
    first = optimum(problem, nothing, loss=loss, starts=starts)
    effects = problem.held_effects(first.t, [inputs.both_sides(*each) for each in held.items()])
    counts = np.linalg.norm(first.residuals.scale[:, None] * effects, axis=0) > _NO_EFFECT
    relevant = {name: sd for (name, sd), matters in zip(held.items(), counts, strict=True) if matters}
    return optimum(problem, effects[:, counts], loss=loss, starts=starts, before=first), relevant


def _same(first: Residuals, second: Residuals) -> bool:
    by_noise = np.max(np.abs(first.noise / second.noise - 1), initial=0.0)
    return bool(by_noise < _AGREES and np.max(np.abs(first.weights - second.weights)) < 1e-2)


def _first_noise(problem: Problem) -> FloatArray:
    sizes = [problem.measured[problem.group == g] for g in range(len(problem.estimated_groups))]
    return np.array([_FIRST_NOISE * max(float(np.sqrt(np.mean(y**2))), 1e-300) for y in sizes])


def _settled_noise(
    residuals: Residuals, t: FloatArray, of_prediction: FloatArray, loss: str
) -> tuple[Residuals, FloatArray]:
    """Residuals with converged noise and robust weights at t, and degrees of freedom by group."""
    problem, predicted = residuals.problem, residuals.problem.at(t)
    freedom = np.zeros(len(problem.estimated_groups))
    for _ in range(_ROUNDS):
        errors = residuals.at(t, predicted=predicted)[: problem.measured.size] / np.sqrt(residuals.weights)
        taken = residuals.leverage(residuals.slopes(t, of_prediction))
        noise = residuals.noise.copy()
        for g, name in enumerate(problem.estimated_groups):
            mine = problem.group == g
            freedom[g] = float(np.count_nonzero(mine) - np.sum(taken[mine]))
            if freedom[g] < 0.5:
                raise FitError(
                    f"{name}: {np.count_nonzero(mine)} numbers are too few to find both the parameters and "
                    "the noise: measure more, fit fewer parameters, or give the uncertainty in the file"
                )
            if loss == "linear":
                noise[g] *= math.sqrt(float(np.sum(errors[mine] ** 2)) / float(freedom[g]))
            else:
                # The median magnitude of a normal quantity is 0.6745 standard deviations.
                size = float(np.median(np.abs(errors[mine]))) / 0.6745
                noise[g] *= size * math.sqrt(np.count_nonzero(mine) / float(freedom[g]))
        floor = _LEAST_NOISE / _FIRST_NOISE * _first_noise(problem)
        noise = np.maximum(noise, floor)
        weights = residuals.weights if loss == "linear" else 1 / np.sqrt(1 + (errors / _ROBUST) ** 2)
        changed = replace(residuals, noise=noise, weights=weights)
        if _same(changed, residuals):
            return changed, freedom
        residuals = changed
    return residuals, freedom


def searched(
    residuals: Residuals, t: FloatArray, *, gain: float, fixed: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Local minimum of the sum of squares, by a trust-region method.

    Args: `t`: start, with the value of a `fixed` parameter. `gain`: reduction of the sum of squares below
        which the search ends. `fixed`: index of a parameter that is not varied.
    Returns: t, and residuals and priors at t.
    """
    problem, free = residuals.problem, np.arange(t.size) != fixed
    # Reported optima need central differences; profiles do not.
    differences = problem.slopes if fixed is None else problem.quick_slopes

    def full(part: FloatArray) -> FloatArray:
        point = t.copy()
        point[free] = part
        return point

    def jacobian(part: FloatArray) -> FloatArray:
        point = full(part)
        return np.asarray(residuals.slopes(point, differences(point))[:, free])

    start = residuals.at(t)
    if not np.any(free):
        return t, start
    low, high = problem.bounds
    margin = 1e-9 * (high - low)
    end = least_squares(
        lambda part: residuals.at(full(part)),
        np.clip(t, low + margin, high - margin)[free],
        jac=jacobian,
        bounds=(low[free], high[free]),
        method="trf",
        x_scale="jac",
        ftol=max(gain / max(float(start @ start), 1.0), 1e-12),
        xtol=1e-8,
        gtol=1e-10,
        max_nfev=_EVALUATIONS,
    )
    return full(end.x), np.asarray(end.fun)
