"""Fraction of the devices that designs serve, as a smooth function of their places.

Each design ran as some devices of one block.  The logit of the fraction is a quadratic of the coordinates and
an effect of the block, fitted to the counts; normal priors hold what few designs determine.  So many designs
of 64 devices say together what each of them says within 3 % alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import expit

from ringbalance.scene.arrays import FloatArray, IntArray

_WIDE, _CURVED, _BLOCK = 10.0, 5.0, 0.3
"""Standard deviations of the priors in logits: of constant and slopes, of curvatures, of a block's effect."""
_STEPS: Final = 25
"""Of Newton's method, which needs some six."""
_LONGEST: Final = 2.0
"""Step of the logits at the most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """Normal approximation of the coefficients."""

    centre: FloatArray
    """Coordinates about which powers are taken, shape (k,)."""
    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(
        cls, places: FloatArray, *, met: IntArray, devices: IntArray, blocks: IntArray, weights: FloatArray
    ) -> Surface:
        """Fit.

        Args: `places`: coordinates, shape (n, k). `met`, `devices`: counts of each design. `blocks`: number
            of its block. `weights`: of the counts, from 0 to 1, less for designs far away.
        """
        centre = np.average(places, axis=0, weights=weights)
        terms = _terms(places - centre)
        effects = (blocks[:, np.newaxis] == np.unique(blocks)).astype(np.float64)
        x, k = np.hstack([terms, effects]), places.shape[1]
        widths = np.concatenate(
            [
                np.full(1 + k, _WIDE),
                np.full(terms.shape[1] - 1 - k, _CURVED),
                np.full(effects.shape[1], _BLOCK),
            ]
        )
        prior, mean = np.diag(widths**-2.0), np.zeros(x.shape[1])
        for _ in range(_STEPS):
            fraction = expit(x @ mean)
            force = x.T @ (weights * (met - devices * fraction)) - prior @ mean
            curvature = (x.T * (weights * devices * fraction * (1 - fraction))) @ x + prior
            step = np.linalg.solve(curvature, force)
            mean = mean + step * min(1.0, _LONGEST / max(float(np.max(np.abs(x @ step))), 1e-9))
        size = terms.shape[1]
        return cls(centre=centre, mean=mean[:size], covariance=np.linalg.inv(curvature)[:size, :size])

    def logits(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Logits of the fractions at places, shape (n, k), and their standard deviations."""
        terms = _terms(places - self.centre)
        spread = np.sqrt(np.einsum("ni,ij,nj->n", terms, self.covariance, terms))
        return np.asarray(terms @ self.mean), np.asarray(spread)


def _terms(z: FloatArray) -> FloatArray:
    """Powers up to the second, shape (n, 1 + k + k (k + 1)/2)."""
    one, other = np.triu_indices(z.shape[1])
    return np.hstack([np.ones((len(z), 1)), z, z[:, one] * z[:, other]])
