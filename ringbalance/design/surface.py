"""Fraction of the devices that designs serve, as a smooth function of their coordinates.

The logit of the fraction is a Gaussian process of the coordinates, observed through the counts of the designs
that ran; its length along each coordinate is fitted to the counts.  Many designs with 64 devices each
together give a more precise fraction than one of them alone, and a steep change along one coordinate does not
mask the influence of another.
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
"""Median of the priors of standard deviation, in logits, and of lengths; both log-normal, with a standard
deviation of 1 of the logarithm."""
_MEAN_SIGMA: Final = 1.0
"""Standard deviation of the process's mean, in logits."""
_BLOCK_VARIANCE_FACTOR: Final = 0.5
"""Variance of the count of a block, relative to that of independent devices: smaller, since the block's
inputs are evenly spread."""
_ROUGH_VARIANCE: Final = 0.01
"""Variance of the part that is not smooth, such as the effect of different best settings."""
_MAX_STEPS: Final = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """Gaussian process conditioned on the counts."""

    places: FloatArray
    """Coordinates of the designs, shape (n, k)."""
    mean: float
    scale: float
    """Standard deviation of the process, in logits."""
    lengths: FloatArray
    """Correlation lengths along the coordinates, shape (k,)."""
    factor: tuple[FloatArray, bool]
    """Cholesky factor of the covariance of the observed logits, as from `scipy.linalg.cho_factor`."""
    weights: FloatArray
    """Inverse of that covariance times the observed logits less their mean, shape (n,)."""

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
        """Logits of the fractions, and their standard deviations, at coordinates of shape (n, k)."""
        apart = (places[:, np.newaxis] - self.places) ** 2
        shared = self.scale**2 * _matern(_distance(apart, self.lengths)) + _MEAN_SIGMA**2
        explained = np.einsum("ij,ji->i", shared, cho_solve(self.factor, shared.T))
        variance = np.maximum(self.scale**2 + _MEAN_SIGMA**2 - explained, 0.0)
        return self.mean + shared @ self.weights, np.sqrt(variance)


def _loss(
    parameters: FloatArray, *, start: FloatArray, apart: FloatArray, seen: FloatArray, noise: FloatArray
) -> tuple[float, FloatArray]:
    """Negative logarithm of the parameters' posterior density, with its gradient.

    Args: `parameters`: logarithms of scale and lengths. `start`: prior means of these. `apart`: squared
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
    """Matern correlation (5/2) at a distance of sqrt(5) times that in correlation lengths."""
    return np.asarray((1 + distance + distance**2 / 3) * np.exp(-distance))
