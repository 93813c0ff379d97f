"""Displacement fields on the liquid's body that keep its volume and slide along its walls.

A field is a column: three rows for each quadrature point, those of the body first and those of the walls
behind, each times the root of its point's weight.  So sums of products are integrals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.sparse import csr_matrix, diags_array, vstack
from scipy.sparse.linalg import LinearOperator, cg

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.liquid_body import Level
from ringbalance.physics.pressure.multigrid import multigrid
from ringbalance.physics.pressure.tetrahedra import CELL_POINTS, TetrahedronSpace
from ringbalance.scene.arrays import ComplexArray, FloatArray, IntArray

TOLERANCE: Final = 1e-7
"""Relative residual of a harmonic potential, whose gradient is small beside it."""
_TURNED_TOLERANCE: Final = 1e-5
"""Relative residual of what is taken from a turned field: far below what the mesh leaves of the field."""

_SHIFT: Final = 0.3
"""Of the squared frequencies."""


class _RepeatedSolves:
    """Repeated solves with one positive definite matrix of quadratic elements."""

    def __init__(self, matrix: csr_matrix, prolongation: csr_matrix) -> None:
        self.matrix = matrix
        self.cycle = LinearOperator(matrix.shape, matvec=multigrid(matrix, prolongation), dtype=np.float64)
        self.residual = 0.0
        """Largest relative one of all solves."""
        self.excess = 0.0
        """Largest residual over the one asked for."""

    def solve(self, right: FloatArray, start: FloatArray, tolerance: float) -> FloatArray:
        """Columns of u for columns of b, to a residual relative to b."""
        result = start.copy()
        for column, b in enumerate(right.T):
            size = float(np.linalg.norm(b))
            if size == 0.0:
                continue
            found, _ = cg(
                self.matrix, b, x0=result[:, column], rtol=tolerance, atol=0.0, maxiter=500, M=self.cycle
            )
            result[:, column] = found
            left = float(np.linalg.norm(b - self.matrix @ found)) / size
            self.residual, self.excess = max(self.residual, left), max(self.excess, left / tolerance)
        return result


@dataclass(frozen=True)
class Fields:
    """Operators on fields on one mesh, lengths in outer radii."""

    space: TetrahedronSpace
    level: Level

    @cached_property
    def surface_mass(self) -> csr_matrix:
        """Integrals of N_i N_j / g over the free surface, all nodes."""
        facets = self.space.facets(FREE_SURFACE)
        weight = 1 / np.linalg.norm(self.level.gradient(facets.points), axis=-1)
        return facets.mass(weight, unknowns=self.space.unknowns)

    @cached_property
    def surface(self) -> IntArray:
        """Nodes on the free surface."""
        return np.unique(self.space.facets(FREE_SURFACE).nodes)

    @cached_property
    def inner(self) -> IntArray:
        """All other nodes."""
        return np.setdiff1d(np.arange(self.space.unknowns), self.surface)

    @cached_property
    def body_rows(self) -> int:
        """Rows of a field that belong to the body."""
        return 3 * self.space.weights.size

    @cached_property
    def gradient(self) -> csr_matrix:
        """Fields of nodal potentials."""
        walls = [name for name in self.space.boundaries if name != FREE_SURFACE]
        weights = [self.space.weights, *(self.space.facets(name).weights.ravel() for name in walls)]
        parts = [self.space.gradient, *map(self.space.gradient_at, walls)]
        return csr_matrix(diags_array(np.repeat(np.sqrt(np.concatenate(weights)), 3)) @ vstack(parts))

    @cached_property
    def _body_gradient(self) -> csr_matrix:
        """The body's rows of `gradient`, not copied."""
        whole, rows = self.gradient, self.body_rows
        end = whole.indptr[rows]
        parts = (whole.data[:end], whole.indices[:end], whole.indptr[: rows + 1])
        return csr_matrix(parts, shape=(rows, self.space.unknowns))

    @cached_property
    def shifted(self) -> _RepeatedSolves:
        """The stiffness of all nodes and a part of the surface's mass, which makes it positive."""
        matrix = csr_matrix(self.space.stiffness + _SHIFT * self.surface_mass)
        return _RepeatedSolves(matrix, self.space.prolongation(np.arange(self.space.unknowns)))

    @cached_property
    def pinned(self) -> _RepeatedSolves:
        """The stiffness of the nodes that are not on the surface."""
        inside = self.space.stiffness[self.inner][:, self.inner]
        return _RepeatedSolves(inside, self.space.prolongation(self.inner))

    def harmonic(self, values: FloatArray) -> FloatArray:
        """Columns of nodal values, those inside replaced by the harmonic ones with walls without flux."""
        right = -(self.space.stiffness[self.inner][:, self.surface] @ values[self.surface])
        result = values.copy()
        result[self.inner] = self.pinned.solve(right, values[self.inner], TOLERANCE)
        return result

    def products(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Integrals over the body of the products of columns."""
        return np.asarray(first[: self.body_rows].T @ second[: self.body_rows])

    def turned_products(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Integrals over the body of first . e_z x second."""
        (x, y), (u, v) = ([f[k : self.body_rows : 3] for k in (0, 1)] for f in (first, second))
        return np.asarray(y.T @ u - x.T @ v)

    def along_gradients(self, fields: FloatArray) -> FloatArray:
        """Integrals over the body of grad N_i . u for columns u."""
        return np.asarray(self._body_gradient.T @ fields[: self.body_rows])

    def coriolis_part(self, fields: FloatArray) -> FloatArray:
        """The part of e_z x u that keeps volume and walls."""
        turned = np.zeros_like(fields)
        turned[0::3], turned[1::3] = -fields[1::3], fields[0::3]
        potential = np.zeros((self.space.unknowns, fields.shape[1]))
        right = self.along_gradients(turned)[self.inner]
        potential[self.inner] = self.pinned.solve(right, potential[self.inner], _TURNED_TOLERANCE)
        turned -= self.gradient @ potential
        return turned

    def new_directions(
        self, fields: FloatArray, before: list[FloatArray], least: float
    ) -> tuple[FloatArray, float]:
        """Orthonormal columns of what is new in fields of norm 1, without what is smaller than `least`.

        Args: `fields`: changed, memory being short.
        Returns: The columns, and the largest squared norm of what was left out.
        """
        for _ in range(2):
            for block in before:
                fields -= block @ self.products(block, fields)
        squares, axes = np.linalg.eigh(self.products(fields, fields))
        kept = squares > least**2
        left_out = float(squares[~kept].max(initial=0.0))
        return np.asarray(fields @ (axes[:, kept] / np.sqrt(squares[kept]))), left_out


def gradient_errors(
    space: TetrahedronSpace, gradients: FloatArray | ComplexArray
) -> FloatArray | ComplexArray:
    """Distance of each column's gradient from the mean of the cells around each corner, of the same shape.

    Source: Zienkiewicz and Zhu (1987), doi:10.1002/nme.1620240206.
    """
    cells, count = space.body.cells[:, :4], gradients.shape[1]
    points = gradients.reshape(len(cells), 4, 3 * count)
    # Linear in the cell: from its four points to its corners.
    corners = np.einsum("cp,epk->eck", np.linalg.inv(CELL_POINTS), points)
    size = space.weights.reshape(len(cells), 4).sum(axis=1)
    gather = csr_matrix(
        (np.repeat(size, 4), (cells.ravel(), np.arange(cells.size))), shape=(space.unknowns, cells.size)
    )
    total = np.maximum(gather @ np.ones(cells.size), np.finfo(np.float64).tiny)
    smooth = (diags_array(1 / total) @ (gather @ corners.reshape(cells.size, -1)))[cells]
    back = np.einsum("pc,eck->epk", CELL_POINTS, smooth - corners)
    return np.asarray(back).reshape(gradients.shape)
