"""Algebraic multigrid, for systems too large to factorise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyamg
from pyamg.relaxation.relaxation import gauss_seidel
from pyamg.relaxation.smoothing import change_smoothers
from scipy.sparse import csr_matrix, tril, triu

from ringbalance.scene.arrays import FloatArray

Cycle = Callable[[FloatArray], FloatArray]


def multigrid(matrix: csr_matrix, prolongation: csr_matrix | None) -> Cycle:
    """One symmetric cycle as a near inverse: linear elements below quadratic ones, aggregates below those.

    `prolongation` is the interpolation from linear elements on the same mesh, where there is one.
    Aggregates of quadratic elements would swallow whole stencils.
    """
    if prolongation is None:
        return _aggregates(csr_matrix(matrix))
    restriction = csr_matrix(prolongation.T)
    coarse = _aggregates(csr_matrix(restriction @ matrix @ prolongation))
    lower, upper, whole = (_sorted(part) for part in (tril(matrix), triu(matrix, 1), matrix))

    def cycle(right: FloatArray) -> FloatArray:
        right = np.ascontiguousarray(right.ravel())
        result = np.zeros_like(right)
        # From zero, a forward sweep needs the lower triangle alone and leaves a residual of the upper one.
        gauss_seidel(lower, result, right, sweep="forward")
        result -= prolongation @ coarse(restriction @ (upper @ result))
        gauss_seidel(whole, result, right, sweep="backward")
        return result

    return cycle


def _sorted(matrix: csr_matrix) -> csr_matrix:
    result = csr_matrix(matrix)
    result.sort_indices()
    return result


def _aggregates(matrix: csr_matrix) -> Cycle:
    """No part needs a spectral radius, which pyamg would estimate from random vectors."""
    hierarchy = pyamg.smoothed_aggregation_solver(
        matrix,
        symmetry="symmetric",
        strength=("symmetric", {"theta": 0.1}),
        smooth=("energy", {"krylov": "cg", "maxiter": 2}),
        max_coarse=500,
    )
    for level in hierarchy.levels:
        level.A = csr_matrix(level.A)  # blocks of one by one are slower
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    change_smoothers(hierarchy, presmoother=sweeps, postsmoother=sweeps)
    cycle: Cycle = hierarchy.aspreconditioner(cycle="V").matvec
    return cycle
