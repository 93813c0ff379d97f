"""Solution of the symmetric positive definite systems of the pressure problem, with the true residual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ringbalance.physics import deferred
from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from ringbalance.physics.pressure.assembly import Matrix

# Above these a factorisation costs more time and memory than multigrid does.
DIRECT_LIMIT = {2: 100_000, 3: 20_000}
_ACCEPTED = 1e-10
_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Of |A| |u| + |b|, that a backward-stable solve may leave of the residual."""
_MOST_ROUNDING = 1e-6
"""Relative residual above which rounding has cost too many digits to call a system solved."""


@dataclass(frozen=True, kw_only=True)
class LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def solve_linear(
    matrix: Matrix,
    right: FloatArray,
    *,
    dimension: int,
    prolongation: Callable[[], csr_matrix] | None = None,
    direct_limit: int | None = None,
) -> LinearSolution:
    """Solve A u = b: by factorisation when small, else by conjugate gradients with algebraic multigrid.

    Args:
        matrix: A, symmetric positive definite, dense or sparse.
        right: b, shape (unknowns,).
        dimension: of the mesh behind the matrix, 2 or 3; decides where factorisation ends.
        prolongation: gives, when multigrid asks for it, the interpolation that `linear_prolongation` makes;
            None lets multigrid find its own coarse levels.
        direct_limit: unknowns up to which to factorise; default 100 000 in two dimensions, 20 000 in three.
    Returns: u with the true relative residual |b - A u| / |b|; the status is NOT_CONVERGED when that is above
        1e-10, unless it is rounding, at most 8 eps | |A| |u| + |b| | / |b|, and at most 1e-6: elongated cells
        make terms cancel that are larger than b by the square of their elongation.
    Source: smoothed aggregation of Vanek, Mandel and Brezina (1996), doi:10.1007/BF02238511, through pyamg.
    """
    unknowns = right.size
    limit = DIRECT_LIMIT[dimension] if direct_limit is None else direct_limit
    if unknowns <= limit:
        values, iterations, extra = _factorised(matrix, right), 0, dict[str, float]()
    else:
        values, iterations, extra = deferred.multigrid(
            matrix, right, prolongation() if prolongation else None
        )
    size = float(np.linalg.norm(right))
    size = size if size > 0 else 1.0
    residual = float(np.linalg.norm(right - matrix @ values)) / size
    terms = float(np.linalg.norm(abs(matrix) @ np.abs(values) + np.abs(right))) / size
    statistics = Statistics(unknowns=unknowns, iterations=iterations, relative_residual=residual, extra=extra)
    return LinearSolution(values=values, status=_status(residual, _ROUNDING * terms), statistics=statistics)


def _factorised(matrix: Matrix, right: FloatArray) -> FloatArray:
    try:
        if isinstance(matrix, np.ndarray):
            return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
        return np.asarray(deferred.factorised(matrix, right))
    except np.linalg.LinAlgError:  # the residual of zeros says so
        return np.zeros_like(right)


def _status(residual: float, rounding: float) -> Status:
    limit = max(_ACCEPTED, min(rounding, _MOST_ROUNDING))
    if residual <= limit:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {limit:.0e}; "
        "use fewer or less elongated cells",
    )
