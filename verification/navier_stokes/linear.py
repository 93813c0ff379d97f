"""Sparse factors of a saddle-point matrix: the sparsest ordering first, checked, with pivoting in reserve.

On quadrilaterals, eliminating along the diagonal keeps the factors three to four times sparser than partial
pivoting does, because fill-in gives the pressure block its diagonal in time; on triangles it does not, and
pivots off the diagonal make the factors far denser.  It is not safe by construction, so every solve checks
its residual, refines it, and falls back on partial pivoting when that does not help.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.layers import factorize_layers

_GOOD, _USABLE, _REFINEMENTS = 1e-12, 1e-8, 3


@dataclass(eq=False)
class Factors:
    """A matrix with its factors; made by `factorize`."""

    matrix: Any
    factors: Any
    pivoted: bool

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b, refined, with pivots if need be. Raises: RuntimeError: A is singular."""
        x, gap = _refined(self.matrix, self.factors, right)
        if gap > _USABLE and not self.pivoted:
            self.factors, self.pivoted = _with_pivoting(self.matrix), True
            x, gap = _refined(self.matrix, self.factors, right)
        return x


def _refined(matrix: Any, factors: Any, right: FloatArray) -> tuple[FloatArray, float]:
    """Solution with up to three refinements, and its relative residual."""
    scale = float(np.abs(right).max()) or 1.0
    x = np.asarray(factors.solve(right), dtype=np.float64)
    gap = np.inf
    for _ in range(_REFINEMENTS):
        residual = right - matrix @ x
        gap, before = float(np.abs(residual).max()) / scale, gap
        if gap <= _GOOD or not gap < before / 2:
            break
        x = x + factors.solve(residual)
    return x, gap if np.isfinite(gap) else np.inf


def _with_pivoting(matrix: Any) -> Any:
    return splu(matrix, permc_spec="COLAMD")


def factorize(*, matrix: Any, along_diagonal: bool, layers: IntArray | None = None) -> Factors:
    """Factors of a square CSC matrix of symmetric pattern. Raises: RuntimeError: it is singular.

    Args: `along_diagonal`: try without pivoting first. `layers`: of the unknowns on a long, thin mesh, from
        `layers_of`; None for a mesh of any shape.
    """
    if layers is not None:
        return Factors(matrix=matrix, factors=factorize_layers(matrix=matrix, layers=layers), pivoted=True)
    if not along_diagonal:
        return Factors(matrix=matrix, factors=_with_pivoting(matrix), pivoted=True)
    try:
        symmetric = {"SymmetricMode": True}
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
    except RuntimeError:
        return Factors(matrix=matrix, factors=_with_pivoting(matrix), pivoted=True)
    return Factors(matrix=matrix, factors=factors, pivoted=False)
