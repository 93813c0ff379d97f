"""Sparse matrices, for what needs more of a form than its products with vectors."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from ringbalance.mesh.chamber import ChamberMesh
from ringbalance.physics.pressure.assembly import Line, Stiffness, gauss_line
from ringbalance.scene.arrays import FloatArray


def stiffness_matrix(chamber: ChamberMesh) -> csr_matrix:
    """Symmetric matrix over the nodes of the integrals of grad u . grad v."""
    dimension, line = chamber.dimension, gauss_line(chamber.order)
    gradients = np.stack([_product(line, own=own, dimension=dimension) for own in range(dimension)])
    points, functions = gradients.shape[1:]
    metric = np.concatenate(
        [block.reshape(dimension, dimension, points, -1) for block in Stiffness.of(chamber).metric], axis=-1
    )
    local = np.einsum("api,abpc,bpj->ijc", gradients, metric, gradients, optimize=True)
    nodes = chamber.cell_nodes.reshape(functions, -1)
    rows, columns = np.broadcast_arrays(nodes[:, None], nodes[None, :])
    entries = (local.ravel(), (rows.ravel(), columns.ravel()))
    return coo_matrix(entries, shape=(chamber.grid.size,) * 2).tocsr()


def _product(line: Line, *, own: int, dimension: int) -> FloatArray:
    """A cell's functions at its points, differentiated along one axis, shape (points, functions)."""
    total = np.ones((1, 1))
    for axis in range(dimension):
        total = np.asarray(np.kron(total, line.slopes if axis == own else line.values), dtype=np.float64)
    return total


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
