"""Assembly of the Poisson problem on the quadratic cells of a chamber, and integrals over them and its sides.

The sums over cells are matrix products.  A side is integrated from inside its cells, at the cells' own
reference points: finding those points again by Newton's method, as a general facet basis does, fails in a
cell a thousand times longer than deep.  Three Gauss points along each axis are exact for the load on the
cells of a chamber, of order six for the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ringbalance.mesh.chamber import SIDES, ChamberMesh
from ringbalance.mesh.quadratic import cell_shapes, jacobians, products
from ringbalance.physics import deferred
from ringbalance.scene.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    Matrix: TypeAlias = FloatArray | csr_matrix

DENSE_LIMIT = 450
"""Unknowns up to which a matrix is dense: its solve is then shorter than the import of sparse matrices."""
_GAUSS, _WEIGHT = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0]), np.array([5.0, 8.0, 5.0]) / 9
_CHUNK = 8192


@dataclass(frozen=True, kw_only=True)
class Volume:
    """Quadrature points of all cells; lengths in the mesh's unit."""

    points: FloatArray
    """Shape (dimension, cells, points)."""
    weights: FloatArray
    """Shape (cells, points)."""
    nodes: IntArray
    """Shape (cells, functions)."""
    values: FloatArray
    """Shape functions, shape (functions, points)."""

    def load(self, density: FloatArray, *, unknowns: int) -> FloatArray:
        """Vector of the integrals of f v over the cells or a side, f given at the points."""
        return _summed(self.nodes, (density * self.weights) @ self.values.T, unknowns)

    def mass(self, *, unknowns: int) -> Matrix:
        """Symmetric matrix of the integrals of u v over these cells, among the first `unknowns` nodes."""
        local = np.einsum("fq,iq,jq->fij", self.weights, self.values, self.values, optimize=True)
        return _matrix(self.nodes, local.reshape(len(local), -1), unknowns)

    def at_points(self, nodal: FloatArray) -> FloatArray:
        """Values at the quadrature points of a field given at the mesh's nodes."""
        return np.asarray(nodal[self.nodes] @ self.values)


@dataclass(frozen=True, kw_only=True)
class Facets(Volume):
    """Quadrature points of one side, one facet for each cell at it; the functions that are not zero there."""

    normals: FloatArray
    """Outward unit normals, the shape of `points`."""


@dataclass(frozen=True, kw_only=True)
class _Rule:
    """Shape functions of one reference cell at the points of a quadrature."""

    weights: FloatArray
    """Shape (points,)."""
    values: FloatArray
    """Shape (functions, points)."""
    gradients: FloatArray
    """Shape (functions, points, dimension)."""


@lru_cache(maxsize=16)
def _rule(dimension: int, axis: int = -1, end: float = 0.0) -> _Rule:
    """Gauss points of a cell, or of its side at the `end`, -1 or 1, of an axis."""
    points, weights = [_GAUSS] * dimension, [_WEIGHT] * dimension
    if axis >= 0:
        points[axis], weights[axis] = np.array([end]), np.ones(1)
    values, gradients = cell_shapes(points)
    return _Rule(weights=products(weights), values=values, gradients=gradients)


@lru_cache(maxsize=4)
def _gradient_products(dimension: int) -> FloatArray:
    """Products of reference gradients, shape (points * dimension^2, functions^2)."""
    gradients = _rule(dimension).gradients
    products = np.einsum("iqa,jqb->qabij", gradients, gradients)
    return np.ascontiguousarray(products.reshape(-1, gradients.shape[0] ** 2))


def _jacobians(chamber: ChamberMesh, nodes: IntArray, rule: _Rule) -> tuple[FloatArray, FloatArray]:
    """Cofactor matrix and determinant of dx/dX, shapes (cells, points, dim, dim) and (cells, points)."""
    jacobian = jacobians(chamber.nodes[:, nodes], rule.gradients)
    cofactor = _cofactor(jacobian)
    determinant = np.einsum("eqa,eqa->eq", jacobian[..., 0], cofactor[..., 0])
    return cofactor, determinant


def _cofactor(jacobian: FloatArray) -> FloatArray:
    if jacobian.shape[-1] == 2:
        return np.asarray(jacobian[..., ::-1, ::-1] * np.array([[1, -1], [-1, 1]]))
    first, second, third = np.moveaxis(jacobian, -1, 0)
    columns = [np.cross(second, third), np.cross(third, first), np.cross(first, second)]
    return np.stack(columns, axis=-1)


def stiffness(chamber: ChamberMesh) -> Matrix:
    """Symmetric matrix over the nodes of the integrals of grad u . grad v, by three Gauss points an axis."""
    dimension, unknowns = chamber.dimension, chamber.grid.size
    rule, total = _rule(dimension), None
    for start in range(0, len(chamber.cell_nodes), _CHUNK):
        nodes = chamber.cell_nodes[start : start + _CHUNK]
        cofactor, determinant = _jacobians(chamber, nodes, rule)
        scale = rule.weights / np.abs(determinant)
        metric = np.einsum("eq,eqka,eqkb->eqab", scale, cofactor, cofactor, optimize=True)
        local = metric.reshape(len(nodes), -1) @ _gradient_products(dimension)
        part = _matrix(nodes, local, unknowns)
        total = part if total is None else total + part
    return total


def _matrix(nodes: IntArray, local: FloatArray, unknowns: int) -> Matrix:
    """Sum of the cells' matrices, given as rows of functions^2 numbers."""
    functions = nodes.shape[1]
    rows = np.repeat(nodes, functions, axis=1).ravel()
    columns = np.tile(nodes, (1, functions)).ravel()
    if unknowns > DENSE_LIMIT:
        return deferred.sparse_matrix(rows, columns, local.ravel(), unknowns)
    return _summed(rows * unknowns + columns, local, unknowns**2).reshape(unknowns, unknowns)


def _summed(places: IntArray, local: FloatArray, size: int) -> FloatArray:
    total = np.bincount(places.ravel(), weights=local.ravel(), minlength=size)
    return np.asarray(total, dtype=np.float64)


def volume_points(chamber: ChamberMesh) -> Volume:
    """Quadrature points over all cells, in the mesh's unit."""
    rule, nodes = _rule(chamber.dimension), chamber.cell_nodes
    _, determinant = _jacobians(chamber, nodes, rule)
    return Volume(
        points=np.asarray(chamber.nodes[:, nodes] @ rule.values),
        weights=np.asarray(np.abs(determinant) * rule.weights),
        nodes=nodes,
        values=rule.values,
    )


def facet_points(chamber: ChamberMesh, boundary: str) -> Facets:
    """Quadrature points over one side, with outward normals by Nanson: n dS = det(J) J^-T N dS_ref."""
    dimension, (axis, end) = chamber.dimension, SIDES[boundary]
    outward = 2 * end + 1  # the last place is -1, the first is 0
    rule = _rule(dimension, axis, -float(outward))
    nodes = np.take(chamber.cell_nodes.reshape(*chamber.cells, -1), end, axis=axis)
    nodes = nodes.reshape(-1, 3**dimension)
    cofactor, determinant = _jacobians(chamber, nodes, rule)
    vector = -outward * np.moveaxis(cofactor[..., axis], -1, 0) * np.sign(determinant)
    size = np.linalg.norm(vector, axis=0)
    present = np.take(np.arange(3**dimension).reshape((3,) * dimension), end, axis=axis).ravel()
    return Facets(
        points=np.asarray(chamber.nodes[:, nodes] @ rule.values),
        normals=vector / size,
        weights=size * rule.weights,
        values=rule.values[present],
        nodes=nodes[:, present],
    )
