"""The Poisson problem on the cells of a chamber, without a matrix, and integrals over them and its sides.

A field goes to quadrature points and back one axis at a time.  A side is integrated from inside its cells, at
the cells' own reference points: finding those points again by Newton's method, as a general facet basis does,
fails in a cell a thousand times longer than deep.  One Gauss point more than the order along each axis is
exact for the load on the cells of a chamber, of twice that order for the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ringbalance.mesh.chamber import SIDES, ChamberMesh
from ringbalance.mesh.tensor_cells import contracted, contracted_all, line_shapes, products
from ringbalance.scene.arrays import FloatArray, IntArray

_BLOCK = 2**15
"""Quadrature points worked on at a time: what a processor keeps at hand."""


@dataclass(frozen=True, kw_only=True)
class _Volume:
    """Quadrature points of all cells; lengths in the mesh's unit."""

    points: FloatArray
    """Shape (dimension, points, cells)."""
    weights: FloatArray
    """Shape (points, cells)."""
    nodes: IntArray
    """Shape (order + 1 along each axis, cells)."""
    values: FloatArray
    """Functions of one axis at its points, shape (points, functions)."""

    def load(self, density: FloatArray, *, unknowns: int) -> FloatArray:
        """Vector of the integrals of f v over the cells or a side, f given at the points."""
        axes = self.nodes.ndim - 1
        field = (density * self.weights).reshape(*(len(self.values),) * axes, -1)
        return _summed(self.nodes, contracted_all([self.values.T] * axes, field), unknowns)

    def at_points(self, nodal: FloatArray) -> FloatArray:
        """Values at the quadrature points of a field given at the mesh's nodes."""
        field = contracted_all([self.values] * (self.nodes.ndim - 1), nodal[self.nodes])
        return field.reshape(self.weights.shape)


@dataclass(frozen=True, kw_only=True)
class Facets(_Volume):
    """Quadrature points of one side, one facet for each cell at it; the functions that are not zero there."""

    normals: FloatArray
    """Outward unit normals, the shape of `points`."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """Functions of one axis of a cell at the points of a quadrature."""

    weights: FloatArray
    """Shape (points,)."""
    values: FloatArray
    """Shape (points, functions)."""
    slopes: FloatArray
    """Shape (points, functions)."""


@lru_cache(maxsize=32)
def gauss_line(order: int, extra: int = 0) -> Line:
    """Gauss points of one axis, one more than the order, and some extra."""
    points, weights = np.polynomial.legendre.leggauss(order + 1 + extra)
    return _line(np.asarray(points), np.asarray(weights), order)


@lru_cache(maxsize=32)
def _end_line(order: int, end: float) -> Line:
    """One end of an axis, -1 or 1."""
    return _line(np.array([end]), np.ones(1), order)


def _line(points: FloatArray, weights: FloatArray, order: int) -> Line:
    values, slopes = line_shapes(points, order)
    return Line(weights=weights, values=values.T.copy(), slopes=slopes.T.copy())


def _mapping(places: FloatArray, lines: list[Line]) -> tuple[FloatArray, FloatArray]:
    """Cofactor matrix and determinant of dx/dX in cells, shapes (dim, dim, points, cells), (points, cells).

    Args: `places`: of the cells' nodes, shape (dim, functions along each axis, cells).
    """
    corner = (slice(None), *[slice(1)] * len(lines))
    local = places - places[corner]  # differences first: a film's depth would cancel in the sums
    columns = []
    for own in range(len(lines)):
        field = local
        for axis, line in enumerate(lines):
            field = contracted(line.slopes if axis == own else line.values, field, 1 + axis)
        columns.append(field.reshape(len(local), -1, local.shape[-1]))
    jacobian = np.stack(columns, axis=1)
    cofactor = _cofactor(jacobian)
    return cofactor, np.sum(jacobian[:, 0] * cofactor[:, 0], axis=0)


def _cofactor(jacobian: FloatArray) -> FloatArray:
    if len(jacobian) == 2:
        (xa, xb), (ya, yb) = jacobian
        return np.stack([np.stack([yb, -ya]), np.stack([-xb, xa])])
    following, last = np.array([1, 2, 0]), np.array([2, 0, 1])
    one, other = jacobian[following], jacobian[last]
    return np.asarray(one[:, following] * other[:, last] - one[:, last] * other[:, following])


def _blocks(chamber: ChamberMesh) -> list[slice]:
    """Places of cells that are worked on together."""
    cells, points = chamber.cell_nodes.shape[-1], (chamber.order + 1) ** chamber.dimension
    step = max(1, _BLOCK // points)
    return [slice(start, start + step) for start in range(0, cells, step)]


@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """The symmetric form of the integrals of grad u . grad v over the nodes, applied without a matrix."""

    chamber: ChamberMesh
    metric: tuple[FloatArray, ...]
    """w det(J) J^-1 J^-T at the points of each block of cells, shape (dim, dim, points..., cells)."""
    values: FloatArray
    """Functions of one axis at its points, shape (points, functions)."""
    derivative: FloatArray
    """Takes values at one axis's points to slopes there, exactly, shape (points, points)."""

    @classmethod
    def of(cls, chamber: ChamberMesh) -> Stiffness:
        """The form on a chamber, by one Gauss point more than the order along each axis."""
        line, dimension = gauss_line(chamber.order), chamber.dimension
        weights, metric = products([line.weights] * dimension)[:, None], []
        for block in _blocks(chamber):
            places = chamber.nodes[:, chamber.cell_nodes[..., block]]
            cofactor, determinant = _mapping(places, [line] * dimension)
            found = np.einsum("kapc,kbpc->abpc", cofactor, cofactor) * (weights / np.abs(determinant))
            metric.append(found.reshape(*found.shape[:2], *(line.weights.size,) * dimension, -1))
        derivative = np.asarray(np.linalg.solve(line.values.T, line.slopes.T).T, dtype=np.float64)
        return cls(chamber=chamber, metric=tuple(metric), values=line.values, derivative=derivative)

    def apply(self, nodal: FloatArray) -> FloatArray:
        """Integrals of grad u . grad v for every v, from u at all nodes."""
        cell_nodes, axes = self.chamber.cell_nodes, range(self.chamber.dimension)
        local = np.empty(cell_nodes.shape)
        for block, metric in zip(_blocks(self.chamber), self.metric, strict=True):
            field = contracted_all([self.values] * len(axes), nodal[cell_nodes[..., block]])
            slopes = [contracted(self.derivative, field, axis) for axis in axes]
            gathered = np.zeros_like(field)
            for axis in axes:
                flux = metric[axis, 0] * slopes[0]
                for other in axes[1:]:
                    flux += metric[axis, other] * slopes[other]
                gathered += contracted(self.derivative.T, flux, axis)
            local[..., block] = contracted_all([self.values.T] * len(axes), gathered)
        return _summed(cell_nodes, local, nodal.size)

    def magnitude(self, nodal: FloatArray) -> FloatArray:
        """What `apply` adds up for every v with every term positive: the scale of its rounding."""
        positive = replace(
            self,
            metric=tuple(np.abs(block) for block in self.metric),
            values=np.abs(self.values),
            derivative=np.abs(self.derivative),
        )
        return positive.apply(np.abs(nodal))


def _summed(places: IntArray, local: FloatArray, size: int) -> FloatArray:
    total = np.bincount(places.ravel(), weights=local.ravel(), minlength=size)
    return np.asarray(total, dtype=np.float64)


def volume_points(chamber: ChamberMesh, *, extra: int = 0) -> _Volume:
    """Quadrature points over all cells, in the mesh's unit, with `extra` more than usual along each axis."""
    line, dimension = gauss_line(chamber.order, extra), chamber.dimension
    points, determinants = [], []
    for block in _blocks(chamber):
        places = chamber.nodes[:, chamber.cell_nodes[..., block]]
        determinants.append(np.abs(_mapping(places, [line] * dimension)[1]))
        for axis in range(dimension):
            places = contracted(line.values, places, 1 + axis)
        points.append(places.reshape(dimension, -1, places.shape[-1]))
    return _Volume(
        points=np.concatenate(points, axis=-1),
        weights=np.concatenate(determinants, axis=-1) * products([line.weights] * dimension)[:, None],
        nodes=chamber.cell_nodes,
        values=line.values,
    )


def facet_points(chamber: ChamberMesh, boundary: str) -> Facets:
    """Quadrature points over one side, with outward normals by Nanson: n dS = det(J) J^-T N dS_ref."""
    dimension, (axis, end) = chamber.dimension, SIDES[boundary]
    outward = 2 * end + 1  # the last place is -1, the first is 0
    line = gauss_line(chamber.order)
    lines = [line] * dimension
    lines[axis] = _end_line(chamber.order, -float(outward))
    across = chamber.cell_nodes.reshape(*chamber.cell_nodes.shape[:-1], *chamber.cells)
    nodes = np.take(across, end, axis=dimension + axis).reshape(*across.shape[:dimension], -1)
    cofactor, determinant = _mapping(chamber.nodes[:, nodes], lines)
    vector = -outward * cofactor[:, axis] * np.sign(determinant)
    size = np.linalg.norm(vector, axis=0)
    here = np.take(nodes, end, axis=axis)
    points = chamber.nodes[:, here]
    for side in range(dimension - 1):
        points = contracted(line.values, points, 1 + side)
    return Facets(
        points=points.reshape(vector.shape),
        normals=vector / size,
        weights=size * products([one.weights for one in lines])[:, None],
        values=line.values,
        nodes=here,
    )
