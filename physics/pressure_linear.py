"""Solution of the symmetric positive definite systems of the pressure problem, with the true residual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyamg
from pyamg.relaxation.smoothing import change_smoothers
from scipy.sparse import csr_matrix, diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import LinearOperator, cg, splu

from ringbalance.mesh.chamber import ChamberMesh
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
        prolongation: gives, when multigrid asks for it, the interpolation that `linear_prolongation` makes;
            None lets multigrid find its own coarse levels.
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


def linear_prolongation(chamber: ChamberMesh, *, pinned_surface: bool) -> csr_matrix:
    """Interpolation to the free nodes from those that linear elements on the same mesh would have.

    Only axes along which cells are short become linear: along a long axis neighbours are coupled too weakly
    for sweeps to smooth, and coarsening there would cost more steps than it saves.

    Args:
        chamber: the mesh.
        pinned_surface: True when all nodes of the free surface are fixed, False when the last node alone is.

    Returns:
        Matrix with a row for every free node, in the order of `ChamberMesh.grid`.
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
    mesh."""
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


def _status(residual: float) -> Status:
    if residual <= _ACCEPTED:
        return Status()
    return Status(
        code=StatusCode.NOT_CONVERGED,
        text=f"the linear solve left a relative residual of {residual:.1e}, above {_ACCEPTED:.0e}; "
        "use fewer or less elongated cells",
    )
