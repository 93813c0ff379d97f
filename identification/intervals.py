"""Intervals (95 %) of fitted parameters by profile likelihood.

A value x_i belongs to the interval while the sum of squares S, minimised over all other parameters with x_i
held, is within q = t^2 of its least value; t is Student's for the degrees of freedom behind the noise, normal
where the noise is given.  Several noises count as Welch and Satterthwaite have it,
nu = (sum c_g)^2/sum(c_g^2/nu_g), c_g the part of group g in the parameter's variance.
An end that the threshold does not reach within the scene's rules is the bound.
Source: Bates and Watts, "Nonlinear Regression Analysis" (1988), section 6.1; Satterthwaite, Biometrics
Bull. 2 (1946) 110.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from ringbalance.identification.optimisation import Optimum, constrained
from ringbalance.scene.arrays import FloatArray

_CLOSE: Final = 0.01
"""Relative, of the root of S at an end of the interval."""
_TRIALS: Final = 12
_LARGEST_STEP: Final = 3.0
"""Factor by which a trial may go beyond what the curvature at the optimum says."""


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Profile of one parameter."""

    low: float
    """t at the lower end."""
    high: float
    low_bound: bool
    """Whether the lower end is a bound and not a threshold."""
    high_bound: bool
    factor: float
    """Student's t."""
    points: tuple[tuple[float, float], ...]
    """t and the rise of S above its least, ascending in t."""
    evaluations: int


def covariance(slopes: FloatArray) -> FloatArray:
    """(A'A)^-1 of d(residuals)/dt, with infinite variance along directions that A does not see."""
    _, s, vt = np.linalg.svd(slopes, full_matrices=False)
    weak = s <= 1e-10 * np.max(s, initial=1e-300)
    scaled = vt.T / np.where(weak, 1e-10 * np.max(s, initial=1e-300), s)
    return np.asarray(scaled @ scaled.T)


def student(optimum: Optimum) -> FloatArray:
    """t(0.975) of each parameter."""
    problem, slopes = optimum.residuals.problem, optimum.slopes
    inverse = np.linalg.pinv(slopes, rcond=1e-10)
    n = problem.measured.size
    parts = inverse**2
    total = np.sum(parts, axis=1)
    by_group = [np.sum(parts[:, :n][:, problem.group == g], axis=1) for g in range(optimum.freedom.size)]
    below = sum(
        (c**2 / nu for c, nu in zip(by_group, optimum.freedom, strict=True)), start=np.zeros(total.size)
    )
    freedom = np.divide(total**2, below, out=np.full(total.size, np.inf), where=below > 1e-9 * total**2)
    return np.asarray(stdtrit(np.minimum(np.maximum(freedom, 1.0), 1e9), 0.975), dtype=np.float64)


def profile(optimum: Optimum, which: int, factor: float, spread: FloatArray) -> Profile:
    """Interval of one parameter.

    Args: `factor`: Student's t. `spread`: `covariance` at the optimum.
    """
    least = float(np.sum(optimum.at**2))
    ends = [_end(optimum, which, sign, factor, spread, least) for sign in (-1.0, 1.0)]
    points = sorted([*ends[0][2], (float(optimum.t[which]), 0.0), *ends[1][2]])
    return Profile(
        low=ends[0][0],
        high=ends[1][0],
        low_bound=ends[0][1],
        high_bound=ends[1][1],
        factor=factor,
        points=tuple(points),
        evaluations=ends[0][3] + ends[1][3],
    )


def _end(
    optimum: Optimum, which: int, sign: float, factor: float, spread: FloatArray, least: float
) -> tuple[float, bool, list[tuple[float, float]], int]:
    """t at one end, whether it is a bound, points on the way, and the number of predictions."""
    bound = float(optimum.residuals.problem.bounds[0 if sign < 0 else 1][which])
    here = float(optimum.t[which])
    inside, outside = (here, 0.0), (math.inf * sign, math.inf)
    wide = math.sqrt(float(spread[which, which]))
    along = spread[:, which] / max(float(spread[which, which]), 1e-300)
    distance, slopes, evaluations = factor * wide, optimum.slopes, 0
    points: list[tuple[float, float]] = []
    start = optimum.t
    for _ in range(_TRIALS):
        place = here + sign * distance
        if (place - bound) * sign >= 0:
            place = bound
        begin = np.clip(start + along * (place - start[which]), *optimum.residuals.problem.bounds)
        begin[which] = place
        end, cost, slopes, used = constrained(optimum.residuals, begin, slopes, which)
        evaluations += used
        root = math.sqrt(max(cost - least, 0.0))
        points.append((place, cost - least))
        if abs(root - factor) <= _CLOSE * factor:
            return place, False, points, evaluations
        if root < factor:
            if place == bound:
                return bound, True, points, evaluations
            inside, start = (place, root), end
        else:
            outside = (place, root)
        distance = abs(_next(here, inside, outside, factor, wide) - here)
    return (inside[0] if math.isinf(outside[0]) else outside[0]), False, points, evaluations


def _next(
    here: float, inside: tuple[float, float], outside: tuple[float, float], factor: float, wide: float
) -> float:
    """Where the root of S - S0, nearly linear in t, should be `factor`."""
    if math.isinf(outside[0]):
        reach = abs(inside[0] - here)
        slope = inside[1] / reach if reach > 0 else 1 / wide
        further = min(factor / max(slope, 1e-300), _LARGEST_STEP * max(reach, factor * wide))
        return here + math.copysign(max(further, 1.02 * reach), outside[0])
    part = (factor - inside[1]) / (outside[1] - inside[1])
    return inside[0] + min(max(part, 0.05), 0.95) * (outside[0] - inside[0])
