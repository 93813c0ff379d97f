"""A fit near its solution, where predictions are linear in the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ringbalance.identification.likelihood import basis_of
from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearFit:
    """Residuals and derivatives at the solution, each row in units of its own standard deviation."""

    residuals: FloatArray
    """(measured - predicted)/sigma, and of priors (value before - fitted)/sigma, shape (n,)."""
    derivatives: FloatArray
    """Of the predictions by the parameters, over sigma, shape (n, p)."""
    block: StringArray
    """What a row is of, such as "injection amplitude_after", shape (n,); rows of one block share a noise."""
    data: BoolArray
    """Whether a row is a measurement; else it is a prior."""
    known_noise: BoolArray
    """Whether its sigma was given; else it was estimated from the residuals of its block."""

    @cached_property
    def _basis(self) -> FloatArray:
        """Orthonormal basis of what the parameters can do to the predictions."""
        return basis_of(self.derivatives)

    def beyond_parameters(self, rows: FloatArray) -> FloatArray:
        """What no change of the parameters can describe of changes of the predictions, shape (n, ...)."""
        return np.asarray(rows - self._basis @ (self._basis.T @ rows))

    def freedom(self, chosen: BoolArray) -> float:
        """Degrees of freedom that some rows have left: their number less the parameters they determine."""
        return float(np.count_nonzero(chosen) - np.sum(self._basis[chosen] ** 2))
