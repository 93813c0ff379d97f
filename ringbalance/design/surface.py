"""Fraction of the devices that designs serve, as a smooth function of their places.

The logit of the fraction is a Gaussian process of the coordinates, seen through the counts of the designs
that ran; how fast it changes along each coordinate follows from the counts themselves.  So many designs of 64
devices say together what each of them says within 3 % alone, and a cliff in one direction does not hide what
another does on the plain behind it.
Source: Rasmussen and Williams, "Gaussian Processes for Machine Learning" (2006), algorithm 2.1, equations
    4.17 (Matern, 5/2) and 5.9; the logit of a count and its variance: Haldane, "The Estimation and
    Significance of the Logarithm of a Ratio of Frequencies", Annals of Human Genetics 20 (1956).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.draws import BLOCK

_PRIOR: Final = (2.0, 0.5)
"""Standard deviation of the process in logits and lengths on which it changes: medians of their priors, whose
logarithms have a standard deviation of 1."""
_MEAN_SIGMA: Final = 1.0
"""Standard deviation of the process's mean, in logits."""
_BLOCK_VARIANCE_FACTOR: Final = 0.5
"""Variance of the count of a block, relative to that of independent devices: the block's inputs are spread
evenly."""
_ROUGH_VARIANCE: Final = 0.01
"""Variance of what is not smooth, such as the settings that served best."""
_MAX_STEPS: Final = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """The process, given the counts."""

    places: FloatArray
    """Coordinates of the designs, shape (n, k)."""
    mean: float
    scale: float
    """Standard deviation, in logits."""
    lengths: FloatArray
    """Lengths on which the process changes, shape (k,)."""
    factor: tuple[FloatArray, bool]
    """Cholesky factor of the covariance of the logits, as `scipy.linalg.cho_factor` has it."""
    weights: FloatArray
    """Inverse of that covariance times what was counted, shape (n,)."""

    @classmethod
    def of(cls, places: FloatArray, *, met: IntArray, devices: IntArray) -> Surface:
        """Fit the process. Args: `places`: coordinates, shape (n, k). `met`, `devices`: counts of designs."""
        seen = np.log((met + 0.5) / (devices - met + 0.5))
        even = np.where(devices >= BLOCK, _BLOCK_VARIANCE_FACTOR, 1.0)
        noise = even * (1 / (met + 0.5) + 1 / (devices - met + 0.5)) + _ROUGH_VARIANCE
        mean = float(np.average(seen, weights=1 / (noise + 1.0)))
        start = np.log([_PRIOR[0], *[_PRIOR[1]] * places.shape[1]])
        apart = (places[:, np.newaxis] - places) ** 2
        loss = partial(_loss, start=start, apart=apart, seen=seen - mean, noise=noise)
        best = np.exp(minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": _MAX_STEPS}).x)
        covariance = best[0] ** 2 * _matern(_distance(apart, best[1:])) + _MEAN_SIGMA**2
        factor = cho_factor(covariance + np.diag(noise), lower=True)
        return cls(
            places=places,
            mean=mean,
            scale=float(best[0]),
            lengths=best[1:],
            factor=factor,
            weights=cho_solve(factor, seen - mean),
        )

    def logits(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Logits of the fractions at places, shape (n, k), and their standard deviations."""
        apart = (places[:, np.newaxis] - self.places) ** 2
        shared = self.scale**2 * _matern(_distance(apart, self.lengths)) + _MEAN_SIGMA**2
        explained = np.einsum("ij,ji->i", shared, cho_solve(self.factor, shared.T))
        variance = np.maximum(self.scale**2 + _MEAN_SIGMA**2 - explained, 0.0)
        return self.mean + shared @ self.weights, np.sqrt(variance)


def _loss(
    parameters: FloatArray, *, start: FloatArray, apart: FloatArray, seen: FloatArray, noise: FloatArray
) -> tuple[float, FloatArray]:
    """Minus the logarithm of the parameters' posterior density, with its gradient.

    Args: `parameters`: logarithms of scale and lengths. `start`: means of their priors. `apart`: squared
        differences of coordinates, shape (n, n, k).
    """
    scale, lengths = np.exp(2 * parameters[0]), np.exp(parameters[1:])
    distance = _distance(apart, lengths)
    smooth = scale * _matern(distance)
    factor = cho_factor(smooth + _MEAN_SIGMA**2 + np.diag(noise), lower=True)
    weights = cho_solve(factor, seen)
    from_prior = parameters - start
    loss = 0.5 * seen @ weights + np.sum(np.log(np.diag(factor[0]))) + 0.5 * from_prior @ from_prior
    change = cho_solve(factor, np.eye(seen.size)) - np.outer(weights, weights)
    steep = change * (scale * 5 / 3 * (1 + distance) * np.exp(-distance))
    by_length = 0.5 * np.einsum("ij,ijk->k", steep, apart) / lengths**2
    return float(loss), from_prior + np.array([np.sum(change * smooth), *by_length])


def _distance(apart: FloatArray, lengths: FloatArray) -> FloatArray:
    return np.sqrt(5 * (apart @ lengths**-2.0))


def _matern(distance: FloatArray) -> FloatArray:
    """Correlation at a distance in lengths, times the root of 5."""
    return np.asarray((1 + distance + distance**2 / 3) * np.exp(-distance))
