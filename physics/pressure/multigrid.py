"""Algebraic multigrid, for systems too large to factorise."""

from __future__ import annotations

from collections.abc import Callable

import pyamg
from pyamg.relaxation.smoothing import change_smoothers
from scipy.sparse import csr_matrix

from ringbalance.scene.arrays import FloatArray


def multigrid(matrix: csr_matrix, prolongation: csr_matrix | None) -> Callable[[FloatArray], FloatArray]:
    """One cycle as a near inverse. Args: `prolongation`: as for `hierarchy_of`."""
    cycle: Callable[[FloatArray], FloatArray] = (
        hierarchy_of(csr_matrix(matrix), prolongation).aspreconditioner(cycle="V").matvec
    )
    return cycle


def hierarchy_of(matrix: csr_matrix, prolongation: csr_matrix | None) -> pyamg.multilevel.MultilevelSolver:
    """Linear elements below quadratic ones, aggregates below those.

    `prolongation` is the interpolation from linear elements on the same mesh, where there is one.
    Aggregates of quadratic elements would swallow whole stencils.  No part needs a spectral radius, which
    pyamg would estimate from random vectors.
    """
    coarse = matrix if prolongation is None else csr_matrix(prolongation.T @ matrix @ prolongation)
    hierarchy = pyamg.smoothed_aggregation_solver(
        coarse,
        symmetry="symmetric",
        strength=("symmetric", {"theta": 0.1}),
        smooth=("energy", {"krylov": "cg", "maxiter": 2}),
        max_coarse=500,
    )
    if prolongation is not None:
        finest = pyamg.multilevel.MultilevelSolver.Level()
        finest.A, finest.P, finest.R = matrix, prolongation, csr_matrix(prolongation.T)
        hierarchy = pyamg.multilevel.MultilevelSolver([finest, *hierarchy.levels], coarse_solver="pinv")
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    change_smoothers(hierarchy, presmoother=sweeps, postsmoother=sweeps)
    return hierarchy
