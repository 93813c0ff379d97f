"""Solution of the symmetric positive definite systems of the pressure problem, with the true residual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import splu

from ringbalance.mesh.chamber import ChamberMesh
from ringbalance.physics import deferred
from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray

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
        values, iterations, extra = _factorise(matrix, right), 0, dict[str, float]()
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


def linear_prolongation(chamber: ChamberMesh, *, pinned_surface: bool) -> csr_matrix:
    """Interpolation to the free nodes from those that linear elements on the same mesh would have.

    Only axes along which cells are short become linear: along a long axis neighbours are coupled too weakly
    for sweeps to smooth, and coarsening there would cost more steps than it saves.
    Args: `pinned_surface`: True when all nodes of the free surface are fixed, False when the last node alone
        is.
    Returns: Matrix with a row for every free node, in the order of `ChamberMesh.grid`.
    """
    factors = [
        _halfway(n) if short else csr_matrix(eye_array(2 * n + 1))
        for n, short in zip(chamber.cells, _short_axes(chamber), strict=True)
    ]
    if pinned_surface:
        factors[0] = factors[0][1:, 1:]
    total = factors[0]
    for factor in factors[1:]:
        total = kron(total, factor, format="csr")
    return csr_matrix(total if pinned_surface else total[:-1, :-1])


def _short_axes(chamber: ChamberMesh) -> list[bool]:
    """Axes along which cells are at most eight times as long as along the shortest, in the middle of the

    mesh.
    """
    places = chamber.mesh.doflocs[:, chamber.grid]
    lengths = []
    for axis, count in enumerate(chamber.cells):
        line = tuple(slice(None) if k == axis else n for k, n in enumerate(chamber.cells))
        steps = np.linalg.norm(np.diff(places[(slice(None), *line)], axis=1), axis=0)
        lengths.append(float(steps.sum()) / count)
    return [length <= 8 * min(lengths) for length in lengths]


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


def _status(residual: float, rounding: float) -> Status:
    limit = max(_ACCEPTED, min(rounding, _MOST_ROUNDING))
    if residual <= limit:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {limit:.0e}; "
        "use fewer or less elongated cells",
    )
