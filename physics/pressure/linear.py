"""Solution of symmetric positive definite systems, with the true residual: forms without a matrix, or sparse
matrices."""

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

DIRECT_LIMIT = 20_000
"""Unknowns of a body above which a factorisation costs more time and memory than multigrid does."""
_TOLERANCE = 1e-14
"""Of the error in the form's own norm, as its near inverse sees it, over that of zero."""
_MAX_ITERATIONS = 500
_ACCEPTED = 1e-10
_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Of |A| |u| + |b|, that a backward-stable solve may leave of the residual."""
_MOST_ROUNDING = 1e-6
"""Relative residual above which rounding has cost too many digits to call a system solved."""

Form = Callable[[FloatArray], FloatArray]
"""A matrix times a vector."""


@dataclass(frozen=True, kw_only=True)
class LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def solve_form(form: Form, right: FloatArray, *, inverse: Form, magnitude: Form) -> LinearSolution:
    """Solve A u = b by conjugate gradients with a near inverse.

    Args:
        form: A times a vector, A symmetric and positive, but for constants perhaps.
        right: b, shape (unknowns,), in the range of A.
        inverse: near inverse of A times a vector, symmetric.
        magnitude: |A| |u|, the sum of all terms of A u taken positive.
    Returns: u and its status, as in `solve_linear`.
    Source: Hestenes and Stiefel (1952), doi:10.6028/jres.049.044.
    """
    values, iterations = _conjugate_gradients(form, right, inverse)
    return _judged(values, form(values), right, magnitude, iterations)


def solve_linear(
    matrix: csr_matrix,
    right: FloatArray,
    *,
    prolongation: Callable[[], csr_matrix] | None = None,
    direct_limit: int = DIRECT_LIMIT,
) -> LinearSolution:
    """Solve A u = b: by factorisation when small, else by conjugate gradients with algebraic multigrid.

    Args:
        matrix: A, symmetric positive definite.
        right: b, shape (unknowns,).
        prolongation: gives, when multigrid asks for it, the interpolation from linear elements on the same
            mesh; None lets multigrid find its own coarse levels.
        direct_limit: unknowns up to which to factorise.
    Returns: u with the true relative residual |b - A u| / |b|; the status is NOT_CONVERGED when that is above
        1e-10, unless it is rounding, at most 8 eps | |A| |u| + |b| | / |b|, and at most 1e-6: elongated cells
        make terms cancel that are larger than b by the square of their elongation.
    Source: smoothed aggregation of Vanek, Mandel and Brezina (1996), doi:10.1007/BF02238511, through pyamg.
    """
    if right.size <= direct_limit:
        values, iterations = _factorised(matrix, right), 0
    else:
        inverse = deferred.multigrid(matrix, prolongation() if prolongation else None)
        values, iterations = _conjugate_gradients(lambda u: matrix @ u, right, inverse)
    return _judged(values, matrix @ values, right, lambda u: abs(matrix) @ np.abs(u), iterations)


def _conjugate_gradients(form: Form, right: FloatArray, inverse: Form) -> tuple[FloatArray, int]:
    values, residual = np.zeros_like(right), right.copy()
    step = inverse(residual)
    first = square = float(residual @ step)
    for iteration in range(_MAX_ITERATIONS):
        if square <= _TOLERANCE**2 * first:
            return values, iteration
        image = form(step)
        length = square / float(step @ image)
        values += length * step
        residual -= length * image
        nearer = inverse(residual)
        square, before = float(residual @ nearer), square
        step = nearer + square / before * step
    return values, _MAX_ITERATIONS


def _factorised(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    try:
        return np.asarray(deferred.factorised(matrix, right))
    except np.linalg.LinAlgError:  # the residual of zeros says so
        return np.zeros_like(right)


def _judged(
    values: FloatArray,
    image: FloatArray,
    right: FloatArray,
    magnitude: Form,
    iterations: int,
) -> LinearSolution:
    size = float(np.linalg.norm(right))
    size = size if size > 0 else 1.0
    residual = float(np.linalg.norm(right - image)) / size
    limit = _ACCEPTED
    if residual > limit:
        terms = float(np.linalg.norm(magnitude(values) + np.abs(right))) / size
        limit = max(limit, min(_ROUNDING * terms, _MOST_ROUNDING))
    return LinearSolution(
        values=values,
        status=_status(residual, limit),
        statistics=Statistics(unknowns=right.size, iterations=iterations, relative_residual=residual),
    )


def _status(residual: float, limit: float) -> Status:
    if residual <= limit:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {limit:.0e}; "
        "use fewer or less elongated cells",
    )
