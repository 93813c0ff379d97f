"""The parameters of the largest likelihood, with the noise of each group, from several starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from ringbalance.identification.likelihood import Problem, Residuals
from ringbalance.identification.parameters import FitError
from ringbalance.scene.arrays import BoolArray, FloatArray

_FIRST_NOISE: Final = 0.02
"""Of the root mean square of what a group measured: where the search for its noise begins."""
_LEAST_NOISE: Final = 1e-9
"""Of the same: below, the data agree to round-off."""
_ROUNDS: Final = 25
"""Of noise, or of robust weights."""
_AGREES: Final = 1e-3
"""Relative change of the noise at which it is found."""
_EVALUATIONS: Final = 40
_NEARBY: Final = 1e-2
"""Relative change of the sum of squares that tells one start's minimum from another's."""
_APART: Final = 1.0
"""Of t for a further start, in prior standard deviations or, without a prior, in half of ln 2."""
_WIDE: Final = 0.35
_STEPS: Final = 6
_GAIN: Final = 1e-3
"""Of the sum of squares, below which a step is not taken."""
_LONGEST: Final = 1.0
"""Of a step, in t."""
_ROBUST: Final = 1.345
"""Residual over its standard deviation from which soft_l1 bends, for 95 % efficiency."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """Where the likelihood is largest."""

    t: FloatArray
    residuals: Residuals
    """With the noise found there."""
    slopes: FloatArray
    """d(residuals)/dt."""
    of_prediction: FloatArray
    """d(L^-1 f)/dt."""
    freedom: FloatArray
    """Degrees of freedom of each estimated group."""
    starts: int

    @property
    def at(self) -> FloatArray:
        """Residuals and priors at the optimum."""
        return self.residuals.at(self.t)


def optimum(
    problem: Problem, held: FloatArray, *, loss: str, starts: int, before: Optimum | None = None
) -> Optimum:
    """Maximise the likelihood over parameters and noise.

    The noise follows the residuals by s_g^2 = |e_g|^2/(n_g - sum h), h the leverages: restricted maximum
    likelihood, which counts what parameters, priors and held inputs take up.  A robust loss weighs each
    number by 1/sqrt(1 + (e/c s)^2) with its residual e, and takes s from the median of |e|.
    Args: `held`: effects of held inputs. `loss`: "linear" or "soft_l1". `starts`: searches from the scene and
        from around it. `before`: an optimum to begin at instead.
    Raises: FitError: no more numbers than unknowns in a group whose noise is to be estimated.
    Source: Harville, J. Am. Stat. Assoc. 72 (1977) 320 (restricted likelihood).
    """
    noise = _first_noise(problem) if before is None else before.residuals.noise
    weights = np.ones(problem.measured.size) if before is None else before.residuals.weights
    residuals = Residuals(problem=problem, noise=noise, held=held, weights=weights)
    t = _from_starts(residuals, starts) if before is None else before.t
    for _ in range(_ROUNDS):
        t = minimised(residuals, t)
        of_prediction = problem.slopes(t)
        changed, freedom = _settled_noise(residuals, t, of_prediction, loss)
        done = _same(changed, residuals)
        residuals = changed
        if done:
            break
    return Optimum(
        t=t,
        residuals=residuals,
        slopes=residuals.slopes(t, of_prediction=of_prediction),
        of_prediction=of_prediction,
        freedom=freedom,
        starts=starts if before is None else before.starts,
    )


def _same(one: Residuals, other: Residuals) -> bool:
    by_noise = np.max(np.abs(one.noise / other.noise - 1), initial=0.0)
    return bool(by_noise < _AGREES and np.max(np.abs(one.weights - other.weights)) < 1e-2)


def _first_noise(problem: Problem) -> FloatArray:
    sizes = [problem.measured[problem.group == g] for g in range(len(problem.estimated_groups))]
    return np.array([_FIRST_NOISE * max(float(np.sqrt(np.mean(y**2))), 1e-300) for y in sizes])


def _from_starts(residuals: Residuals, starts: int) -> FloatArray:
    ends = [minimised(residuals, t, close=_NEARBY) for t in start_points(residuals.problem, starts)]
    return min(ends, key=lambda t: float(np.sum(residuals.at(t) ** 2)))


def start_points(problem: Problem, count: int) -> list[FloatArray]:
    """t of the scene, and points around it by a quasi-random sequence, within the bounds.

    Source: additive recurrence with the generalised golden ratio (Roberts, 2018).
    """
    low, high = problem.bounds
    size = problem.start.size
    ratio = 2.0
    for _ in range(30):
        ratio = (1 + ratio) ** (1 / (size + 1))
    wide = np.array(
        [
            min(p.prior / p.slope(t), _WIDE) if p.prior else _WIDE
            for p, t in zip(problem.parameters, problem.start.tolist(), strict=True)
        ]
    )
    points = [problem.start]
    for n in range(1, count):
        part = np.mod(n * ratio ** -np.arange(1, size + 1), 1.0)
        points.append(np.clip(problem.start + _APART * wide * (2 * part - 1), low, high))
    return points


def minimised(residuals: Residuals, start: FloatArray, *, close: float = 1e-7) -> FloatArray:
    """t of the least sum of squares near a start. Args: `close`: relative change at which to stop."""
    found = least_squares(
        residuals.at,
        _inside(residuals.problem, start),
        jac=residuals.slopes,
        bounds=residuals.problem.bounds,
        method="trf",
        x_scale="jac",
        ftol=close,
        xtol=1e-8,
        gtol=1e-10,
        max_nfev=_EVALUATIONS,
    )
    return np.asarray(found.x, dtype=np.float64)


def _inside(problem: Problem, t: FloatArray) -> FloatArray:
    low, high = problem.bounds
    margin = 1e-9 * (high - low)
    return np.clip(t, low + margin, high - margin)


def _settled_noise(
    residuals: Residuals, t: FloatArray, of_prediction: FloatArray, loss: str
) -> tuple[Residuals, FloatArray]:
    """The noise, and the weights of a robust loss, that go with the residuals at t."""
    problem, predicted = residuals.problem, residuals.problem.at(t)
    freedom = np.zeros(len(problem.estimated_groups))
    for _ in range(_ROUNDS):
        whole = residuals.at(t, predicted=predicted)[: problem.measured.size] / np.sqrt(residuals.weights)
        taken = residuals.leverage(residuals.slopes(t, of_prediction=of_prediction))
        noise = residuals.noise.copy()
        for g, name in enumerate(problem.estimated_groups):
            mine = problem.group == g
            freedom[g] = float(np.count_nonzero(mine) - np.sum(taken[mine]))
            if freedom[g] < 0.5:
                raise FitError(
                    f"{name}: {np.count_nonzero(mine)} numbers are too few to find both the parameters and "
                    "the noise: measure more, fit fewer parameters, or give the uncertainty in the file"
                )
            noise[g] *= _size(whole[mine], float(freedom[g]), loss)
        floor = _LEAST_NOISE / _FIRST_NOISE * _first_noise(problem)
        noise = np.maximum(noise, floor)
        weights = residuals.weights if loss == "linear" else 1 / np.sqrt(1 + (whole / _ROBUST) ** 2)
        changed = replace(residuals, noise=noise, weights=weights)
        if _same(changed, residuals):
            return changed, freedom
        residuals = changed
    return residuals, freedom


def _size(whole: FloatArray, freedom: float, loss: str) -> float:
    """Standard deviation of residuals; the median of a normal quantity's size is 0.6745 of it."""
    if loss == "linear":
        return math.sqrt(float(np.sum(whole**2)) / freedom)
    return float(np.median(np.abs(whole))) / 0.6745 * math.sqrt(whole.size / freedom)


def constrained(
    residuals: Residuals, t: FloatArray, slopes: FloatArray, fixed: int
) -> tuple[FloatArray, float, FloatArray]:
    """Least sum of squares with one parameter held, by Gauss-Newton steps with Broyden's updates.

    Where these come to no end, slopes are found again by differences.
    Args: `t`: where to begin, with the held parameter's value. `slopes`: d(residuals)/dt nearby.
    Returns: t, the sum of squares, and the updated slopes.
    Source: Broyden, Math. Comput. 19 (1965) 577.
    """
    search = _Search(residuals=residuals, fixed=fixed, t=t, at=residuals.at(t), slopes=slopes)
    for fresh in (False, True):
        if fresh:
            search.renew()
        if any(search.ended() for _ in range(_STEPS)):
            break
    return search.t, float(search.at @ search.at), search.slopes


@dataclass(kw_only=True, eq=False)
class _Search:
    """State of one search; lives inside one call of `constrained`."""

    residuals: Residuals
    fixed: int
    t: FloatArray
    at: FloatArray
    slopes: FloatArray

    def renew(self) -> None:
        """Find the slopes by differences."""
        self.slopes = self.residuals.slopes(self.t)

    def ended(self) -> bool:
        """Take one step; whether there was nothing left to gain."""
        step = self._step()
        if float(np.sum((self.slopes @ step) ** 2)) < _GAIN:
            return True
        step *= min(1.0, _LONGEST / float(np.max(np.abs(step))))
        low, high = self.residuals.problem.bounds
        for part in (1.0, 0.25, 0.0625):
            there = np.clip(self.t + part * step, low, high)
            found, moved = self.residuals.at(there), there - self.t
            missed = found - self.at - self.slopes @ moved
            self.slopes = self.slopes + np.outer(missed, moved) / max(float(moved @ moved), 1e-300)
            if float(found @ found) < float(self.at @ self.at):
                self.t, self.at = there, found
                return False
        return False

    def _step(self) -> FloatArray:
        low, high = self.residuals.problem.bounds
        free = (np.arange(self.t.size) != self.fixed) & ~_blocked(self.t, self.slopes.T @ self.at, low, high)
        step = np.zeros(self.t.size)
        if np.any(free):
            step[free] = -np.linalg.lstsq(self.slopes[:, free], self.at, rcond=1e-10)[0]
        return step


def _blocked(t: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray) -> BoolArray:
    """Parameters at a bound that the descent points through."""
    return np.asarray(((t <= low) & (gradient > 0)) | ((t >= high) & (gradient < 0)))
