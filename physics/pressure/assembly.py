"""Assembly of the Poisson problem on curved quadratic cells, and integrals over cells and named boundaries.

scikit-fem gives mesh, elements and quadrature; the sums over cells are matrix products here, because a loop
over pairs of its 27 shape functions costs more than the solve.  Facets are integrated from inside their
cells, at the cell's own reference points: finding those points again by Newton's method, as a general facet
basis does, fails in a cell a thousand times longer than deep.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from skfem import ElementHex2, ElementQuad2, Mesh
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex, RefLine, RefQuad

from ringbalance.scene.arrays import FloatArray, IntArray

PointFunction = Callable[[FloatArray], FloatArray]
NormalFunction = Callable[[FloatArray, FloatArray], FloatArray]

# Three Gauss points along each axis: exact for the load on the cells of a chamber, of order six for the rest.
_ORDER = 5
_CHUNK = 8192


@dataclass(frozen=True, kw_only=True)
class _Rule:
    """Shape functions of one reference cell at the points of a quadrature."""

    weights: FloatArray
    """Shape (points,)."""
    values: FloatArray
    """Shape (functions, points)."""
    gradients: FloatArray
    """Shape (functions, points, dimension)."""
    normal: FloatArray
    """Outward on the reference cell for a rule on one of its facets; zero for the cell itself."""


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Quadrature points of one named boundary; lengths in the mesh's unit."""

    points: FloatArray
    """Shape (dimension, facets, points)."""
    normals: FloatArray
    """Outward unit normals, the shape of `points`."""
    weights: FloatArray
    """Shape (facets, points)."""
    values: FloatArray
    """Shape functions, shape (facets, functions, points)."""
    nodes: IntArray
    """Shape (facets, functions)."""


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


def _element(dimension: int) -> ElementQuad2 | ElementHex2:
    return ElementQuad2() if dimension == 2 else ElementHex2()


def _rule(dimension: int, points: FloatArray, weights: FloatArray, normal: FloatArray) -> _Rule:
    element = _element(dimension)
    shapes = [element.lbasis(points, i) for i in range(element.doflocs.shape[0])]
    return _Rule(
        weights=weights,
        values=np.stack([np.broadcast_to(value, weights.shape) for value, _ in shapes]),
        gradients=np.stack([np.asarray(gradient).T for _, gradient in shapes]),
        normal=normal,
    )


@lru_cache(maxsize=4)
def _cell_rule(dimension: int) -> _Rule:
    """Shape functions at the Gauss points of a cell.

    Args: `dimension`: 2 or 3.
    """
    points, weights = get_quadrature(RefQuad if dimension == 2 else RefHex, _ORDER)
    return _rule(dimension, points, weights, np.zeros(dimension))


@lru_cache(maxsize=16)
def _facet_rule(dimension: int, side: int) -> _Rule:
    """Shape functions at the Gauss points of one side of a reference cell.

    Args: `dimension`: 2 or 3. `side`: number of the side, in scikit-fem's order.
    Returns: The rule, three points along each axis of the side.
    """
    normal = np.asarray((RefQuad if dimension == 2 else RefHex).normals[side], dtype=np.float64)
    axis = int(np.argmax(np.abs(normal)))
    inside, weights = get_quadrature(RefLine if dimension == 2 else RefQuad, _ORDER)
    points = np.insert(inside, axis, 0.5 + 0.5 * normal[axis], axis=0)
    return _rule(dimension, points, weights, normal)


@lru_cache(maxsize=4)
def _gradient_products(dimension: int) -> FloatArray:
    """Products of reference gradients, shape (points * dimension^2, functions^2)."""
    gradients = _cell_rule(dimension).gradients
    products = np.einsum("iqa,jqb->qabij", gradients, gradients)
    functions = gradients.shape[0]
    return np.ascontiguousarray(products.reshape(-1, functions**2))


def _jacobians(mesh: Mesh, nodes: IntArray, rule: _Rule) -> tuple[FloatArray, FloatArray]:
    """Cofactor matrix and determinant of dx/dX, shapes (cells, points, dim, dim) and (cells, points)."""
    corner = mesh.doflocs[:, nodes[:, :1]]
    local = mesh.doflocs[:, nodes] - corner  # differences first: a film's depth would cancel in the sums
    dimension, functions = local.shape[0], local.shape[2]
    flat = local.reshape(-1, functions) @ rule.gradients.reshape(functions, -1)
    jacobian = flat.reshape(dimension, len(nodes), -1, dimension).transpose(1, 2, 0, 3)
    cofactor = _cofactor(jacobian)
    determinant = np.einsum("eqa,eqa->eq", jacobian[..., 0], cofactor[..., 0])
    return cofactor, determinant


def _cofactor(jacobian: FloatArray) -> FloatArray:
    if jacobian.shape[-1] == 2:
        return np.asarray(jacobian[..., ::-1, ::-1] * np.array([[1, -1], [-1, 1]]))
    first, second, third = np.moveaxis(jacobian, -1, 0)
    columns = [np.cross(second, third), np.cross(third, first), np.cross(first, second)]
    return np.stack(columns, axis=-1)


def _chunks(mesh: Mesh) -> Iterator[IntArray]:
    nodes = mesh.dofs.element_dofs.T
    for start in range(0, len(nodes), _CHUNK):
        yield np.asarray(nodes[start : start + _CHUNK])


def stiffness(mesh: Mesh) -> csr_matrix:
    """Matrix of the integrals of grad u . grad v.

    Args: `mesh`: quadratic quadrilaterals or hexahedra.
    Returns: Symmetric matrix over the mesh's nodes; in the mesh's unit to the power dimension - 2.
    Source: standard Galerkin form, Gauss quadrature with three points along each axis.
    """
    dimension, unknowns = mesh.dim(), mesh.doflocs.shape[1]
    rule = _cell_rule(dimension)
    total = csr_matrix((unknowns, unknowns))
    for nodes in _chunks(mesh):
        cofactor, determinant = _jacobians(mesh, nodes, rule)
        scale = rule.weights / np.abs(determinant)
        metric = np.einsum("eq,eqka,eqkb->eqab", scale, cofactor, cofactor, optimize=True)
        local = metric.reshape(len(nodes), -1) @ _gradient_products(dimension)
        functions = nodes.shape[1]
        rows = np.repeat(nodes, functions, axis=1).ravel()
        columns = np.tile(nodes, (1, functions)).ravel()
        total = total + coo_matrix((local.ravel(), (rows, columns)), shape=total.shape).tocsr()
    return total


def volume_points(mesh: Mesh) -> Volume:
    """Quadrature points over all cells.

    Args: `mesh`: quadratic quadrilaterals or hexahedra.
    Returns: Points, weights and shape functions, in the mesh's unit.
    """
    rule, nodes = _cell_rule(mesh.dim()), np.asarray(mesh.dofs.element_dofs.T)
    _, determinant = _jacobians(mesh, nodes, rule)
    return Volume(
        points=np.asarray(mesh.doflocs[:, nodes] @ rule.values),
        weights=np.asarray(np.abs(determinant) * rule.weights),
        nodes=nodes,
        values=rule.values,
    )


def facet_points(mesh: Mesh, boundary: str) -> Facets:
    """Quadrature points over one named boundary, with outward normals.

    Args: `mesh`: quadratic quadrilaterals or hexahedra with named boundaries. `boundary`: its name.
    Returns: Points, normals, weights and shape functions, in the mesh's unit.
    Raises: KeyError: the mesh has no boundary of that name.
    Source: Nanson's formula, n dS = det(J) J^-T N dS_ref.
    """
    facets = np.asarray(mesh.boundaries[boundary])
    cells = mesh.f2t[0, facets]
    sides = np.argmax(mesh.t2f[:, cells] == facets, axis=0)
    parts = [_side_points(mesh, cells[sides == side], int(side)) for side in np.unique(sides)]
    return Facets(
        points=np.concatenate([part.points for part in parts], axis=1),
        normals=np.concatenate([part.normals for part in parts], axis=1),
        weights=np.concatenate([part.weights for part in parts]),
        values=np.concatenate([part.values for part in parts]),
        nodes=np.concatenate([part.nodes for part in parts]),
    )


def _side_points(mesh: Mesh, cells: IntArray, side: int) -> Facets:
    rule = _facet_rule(mesh.dim(), side)
    nodes = np.asarray(mesh.dofs.element_dofs[:, cells].T)
    cofactor, determinant = _jacobians(mesh, nodes, rule)
    vector = np.moveaxis(cofactor @ rule.normal, -1, 0) * np.sign(determinant)
    size = np.linalg.norm(vector, axis=0)
    return Facets(
        points=np.asarray(mesh.doflocs[:, nodes] @ rule.values),
        normals=vector / size,
        weights=size * rule.weights,
        values=np.broadcast_to(rule.values, (len(cells), *rule.values.shape)),
        nodes=nodes,
    )


def volume_load(volume: Volume, density: FloatArray, *, unknowns: int) -> FloatArray:
    """Vector of the integrals of f v over the cells.

    Args: `unknowns`: number of nodes of the mesh.
    """
    local = (density * volume.weights) @ volume.values.T
    return _summed(volume.nodes, local, unknowns)


def facet_load(facets: Facets, density: FloatArray, *, unknowns: int) -> FloatArray:
    """Vector of the integrals of f v over a boundary.

    Args: `unknowns`: number of nodes of the mesh.
    """
    local = np.einsum("fq,fiq->fi", density * facets.weights, facets.values)
    return _summed(facets.nodes, local, unknowns)


def _summed(nodes: IntArray, local: FloatArray, unknowns: int) -> FloatArray:
    total = np.bincount(nodes.ravel(), weights=local.ravel(), minlength=unknowns)
    return np.asarray(total, dtype=np.float64)


def facet_mass(facets: Facets, *, unknowns: int) -> csr_matrix:
    """Matrix of the integrals of u v over a boundary.

    Args: `facets`: quadrature points. `unknowns`: number of nodes of the mesh.
    Returns: Symmetric matrix over all nodes, zero away from the boundary.
    """
    local = np.einsum("fq,fiq,fjq->fij", facets.weights, facets.values, facets.values, optimize=True)
    functions = facets.nodes.shape[1]
    rows = np.repeat(facets.nodes, functions, axis=1).ravel()
    columns = np.tile(facets.nodes, (1, functions)).ravel()
    return coo_matrix((local.ravel(), (rows, columns)), shape=(unknowns, unknowns)).tocsr()


def at_facets(facets: Facets, nodal: FloatArray) -> FloatArray:
    """Values of a nodal field at the quadrature points of a boundary.

    Args: `nodal`: the field at the mesh's nodes, shape (unknowns,).
    """
    return np.asarray(np.einsum("fi,fiq->fq", nodal[facets.nodes], facets.values))


def at_cells(volume: Volume, nodal: FloatArray) -> FloatArray:
    """Values of a nodal field at the quadrature points of all cells.

    Args: `nodal`: the field at the mesh's nodes, shape (unknowns,).
    """
    return np.asarray(nodal[volume.nodes] @ volume.values)
