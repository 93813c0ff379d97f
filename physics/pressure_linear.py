"""Solution of the symmetric positive definite systems of the pressure problem, with the true residual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyamg
from pyamg.relaxation.smoothing import change_smoothers
from scipy.sparse import csr_matrix, diags_array, kron, vstack
from scipy.sparse.linalg import LinearOperator, cg, splu

from ringbalance.physics.results import Statistics, Status, StatusCode

FloatArray = npt.NDArray[np.float64]

# Above these a factorisation costs more time and memory than multigrid does.
DIRECT_LIMIT = {2: 100_000, 3: 20_000}
_TOLERANCE = 1e-12
_ACCEPTED = 1e-10
_MAX_ITERATIONS = 1000


@dataclass(frozen=True, kw_only=True)
class LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def solve_linear(
    matrix: csr_matrix,
    right: FloatArray,
    *,
    dimension: int,
    prolongation: Callable[[], csr_matrix] | None = None,
    direct_limit: int | None = None,
) -> LinearSolution:
    """Solve A u = b: by factorisation when small, else by conjugate gradients with algebraic multigrid.

    Args:
        matrix: A, symmetric positive definite.
        right: b, shape (unknowns,).
        dimension: of the mesh behind the matrix, 2 or 3; decides where factorisation ends.
        prolongation: gives, when multigrid asks for it, the interpolation from linear to quadratic elements,
            the rows and columns of `linear_prolongation` that belong to free nodes; None lets multigrid find
            its own coarse levels.
        direct_limit: unknowns up to which to factorise; default 100 000 in two dimensions, 20 000 in three.

    Returns:
        u with the true relative residual |b - A u| / |b|; the status is NOT_CONVERGED when that is above
        1e-10.

    Source: smoothed aggregation of Vanek, Mandel and Brezina (1996), doi:10.1007/BF02238511, through pyamg.
    """
    unknowns = right.size
    limit = DIRECT_LIMIT[dimension] if direct_limit is None else direct_limit
    if unknowns <= limit:
        values, iterations, extra = _factorise(matrix, right), 0, dict[str, float]()
    else:
        values, iterations, extra = _multigrid(matrix, right, prolongation() if prolongation else None)
    size = float(np.linalg.norm(right))
    residual = float(np.linalg.norm(right - matrix @ values)) / (size if size > 0 else 1.0)
    statistics = Statistics(unknowns=unknowns, iterations=iterations, relative_residual=residual, extra=extra)
    return LinearSolution(values=values, status=_status(residual), statistics=statistics)


def linear_prolongation(cells: tuple[int, ...]) -> csr_matrix:
    """Interpolation from the corners of a structured chamber mesh to all its nodes.

    Args:
        cells: of the mesh along each axis.

    Returns:
        Matrix with a row for every node and a column for every corner, both in the order of
        `ChamberMesh.grid`; the free surface comes first in either.
    """
    total = _halfway(cells[0])
    for count in cells[1:]:
        total = kron(total, _halfway(count), format="csr")
    return csr_matrix(total)


def _halfway(cells: int) -> csr_matrix:
    """Corners, and means of neighbouring corners between them, along one axis."""
    corners = diags_array(np.ones(cells + 1), format="csr")
    means = (corners[:-1] + corners[1:]) / 2
    rows = np.arange(2 * cells + 1)
    order = np.where(rows % 2 == 0, rows // 2, cells + 1 + rows // 2)
    return csr_matrix(vstack([corners, means], format="csr")[order])


def _factorise(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    # Symmetric mode halves the fill of the default ordering; a positive definite matrix needs no pivoting.
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # singular to rounding; the residual of zeros says so
        return np.zeros_like(right)
    return np.asarray(factor.solve(right))


def _multigrid(
    matrix: csr_matrix, right: FloatArray, prolongation: csr_matrix | None
) -> tuple[FloatArray, int, dict[str, float]]:
    hierarchy = _hierarchy(matrix, prolongation)
    preconditioner: LinearOperator = hierarchy.aspreconditioner(cycle="V")
    count = 0

    def step(_: FloatArray) -> None:
        nonlocal count
        count += 1

    values, _ = cg(
        matrix, right, rtol=_TOLERANCE, atol=0.0, maxiter=_MAX_ITERATIONS, M=preconditioner, callback=step
    )
    return values, count, {"operator_complexity": float(hierarchy.operator_complexity())}


def _hierarchy(matrix: csr_matrix, prolongation: csr_matrix | None) -> pyamg.multilevel.MultilevelSolver:
    """Linear elements below quadratic ones, aggregates below those.

    Aggregates of quadratic elements would swallow whole stencils of 125 points.  No part needs a spectral
    radius, which pyamg would estimate from random vectors.
    """
    coarse = matrix if prolongation is None else csr_matrix(prolongation.T @ matrix @ prolongation)
    hierarchy = pyamg.smoothed_aggregation_solver(
        coarse,
        symmetry="symmetric",
        smooth=("jacobi", {"omega": 4.0 / 3.0, "weighting": "local"}),
        max_coarse=500,
    )
    if prolongation is not None:
        finest = pyamg.multilevel.MultilevelSolver.Level()
        finest.A, finest.P, finest.R = matrix, prolongation, csr_matrix(prolongation.T)
        hierarchy = pyamg.multilevel.MultilevelSolver([finest, *hierarchy.levels], coarse_solver="pinv")
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    change_smoothers(hierarchy, presmoother=sweeps, postsmoother=sweeps)
    return hierarchy


def _status(residual: float) -> Status:
    if residual <= _ACCEPTED:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {_ACCEPTED:.0e}; "
        "use fewer or less elongated cells",
    )
