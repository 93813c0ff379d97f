"""Solution of the symmetric positive definite systems of the pressure problem, with the true residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyamg
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, cg, splu

from ringbalance.physics.results import Statistics, Status, StatusCode

FloatArray = npt.NDArray[np.float64]

# Above these a factorisation costs more time and memory than multigrid does.
DIRECT_LIMIT = {2: 100_000, 3: 30_000}
_TOLERANCE = 1e-12
_ACCEPTED = 1e-10
_MAX_ITERATIONS = 400


@dataclass(frozen=True, kw_only=True)
class LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def solve_linear(
    matrix: csr_matrix, right: FloatArray, *, dimension: int, direct_limit: int | None = None
) -> LinearSolution:
    """Solve A u = b: by factorisation when small, else by conjugate gradients with algebraic multigrid.

    Args:
        matrix: A, symmetric positive definite.
        right: b, shape (unknowns,).
        dimension: of the mesh behind the matrix, 2 or 3; decides where factorisation ends.
        direct_limit: unknowns up to which to factorise; default 100 000 in two dimensions, 30 000 in three.

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
        values, iterations, extra = _multigrid(matrix, right)
    size = float(np.linalg.norm(right))
    residual = float(np.linalg.norm(right - matrix @ values)) / (size if size > 0 else 1.0)
    statistics = Statistics(unknowns=unknowns, iterations=iterations, relative_residual=residual, extra=extra)
    return LinearSolution(values=values, status=_status(residual), statistics=statistics)


def _factorise(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    # Symmetric mode halves the fill of the default ordering; a positive definite matrix needs no pivoting.
    factor = splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.asarray(factor.solve(right))


def _multigrid(matrix: csr_matrix, right: FloatArray) -> tuple[FloatArray, int, dict[str, float]]:
    # Weak couplings are dropped, or aggregates would swallow whole 125-point stencils and the number of
    # iterations would grow with the mesh.  None of these parts needs a spectral radius, which pyamg would
    # estimate from random vectors.
    hierarchy = pyamg.smoothed_aggregation_solver(
        matrix,
        symmetry="symmetric",
        strength=("symmetric", {"theta": 0.25}),
        smooth=("energy", {"krylov": "cg", "maxiter": 2}),
        presmoother=("gauss_seidel", {"sweep": "symmetric"}),
        postsmoother=("gauss_seidel", {"sweep": "symmetric"}),
        max_coarse=500,
    )
    preconditioner: LinearOperator = hierarchy.aspreconditioner(cycle="V")
    count = 0

    def step(_: FloatArray) -> None:
        nonlocal count
        count += 1

    values, _ = cg(
        matrix, right, rtol=_TOLERANCE, atol=0.0, maxiter=_MAX_ITERATIONS, M=preconditioner, callback=step
    )
    return values, count, {"operator_complexity": float(hierarchy.operator_complexity())}


def _status(residual: float) -> Status:
    if residual <= _ACCEPTED:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {_ACCEPTED:.0e}; "
        "use fewer or less elongated cells",
    )
