"""Sparse matrices of the pressure problem, for meshes too large for dense ones."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import splu

from ringbalance.mesh.chamber import ChamberMesh
from ringbalance.scene.arrays import FloatArray, IntArray


def sparse_matrix(rows: IntArray, columns: IntArray, entries: FloatArray, size: int) -> csr_matrix:
    """Square matrix from its entries; those at one place are added."""
    return coo_matrix((entries, (rows, columns)), shape=(size, size)).tocsr()


def factorised(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    """u of A u = b for a symmetric positive definite A. Raises: LinAlgError: A is singular to rounding."""
    # Symmetric mode halves the fill of the default ordering; a positive definite matrix needs no pivoting.
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise np.linalg.LinAlgError(str(error)) from error
    return np.asarray(factor.solve(right))


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
    """Axes along which cells in the middle are at most eight times as long as along the shortest."""
    places = chamber.nodes[:, chamber.grid]
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
