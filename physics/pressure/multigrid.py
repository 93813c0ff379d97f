"""Conjugate gradients with algebraic multigrid, for systems too large to factorise."""

from __future__ import annotations

import pyamg
from pyamg.relaxation.smoothing import change_smoothers
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, cg

from ringbalance.scene.arrays import FloatArray

_TOLERANCE = 1e-12
_MAX_ITERATIONS = 1000


def multigrid(
    matrix: csr_matrix, right: FloatArray, prolongation: csr_matrix | None
) -> tuple[FloatArray, int, dict[str, float]]:
    """Solve A u = b by conjugate gradients, preconditioned with one cycle.

    Args: `prolongation`: interpolation from linear elements on the same mesh, where there is one.
    Returns: u, the number of steps, and the hierarchy's operator complexity.
    """
    matrix = csr_matrix(matrix)
    hierarchy = hierarchy_of(matrix, prolongation)
    preconditioner: LinearOperator = hierarchy.aspreconditioner(cycle="V")
    count = 0

    def step(_: FloatArray) -> None:
        nonlocal count
        count += 1

    values, _ = cg(
        matrix, right, rtol=_TOLERANCE, atol=0.0, maxiter=_MAX_ITERATIONS, M=preconditioner, callback=step
    )
    return values, count, {"operator_complexity": float(hierarchy.operator_complexity())}


def hierarchy_of(matrix: csr_matrix, prolongation: csr_matrix | None) -> pyamg.multilevel.MultilevelSolver:
    """Linear elements below quadratic ones, aggregates below those.

    Aggregates of quadratic elements would swallow whole stencils of 125 points.  No part needs a spectral
    radius, which pyamg would estimate from random vectors.
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
