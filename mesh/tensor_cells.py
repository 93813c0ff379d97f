"""Cells of any order on Gauss-Lobatto nodes, and fields on them: products of one function along each axis.

A field on many cells is an array with one axis for each axis of a cell and the cells last; it is taken to
quadrature points one axis at a time (sum factorisation), which costs p + 1 products a point and axis instead
of (p + 1)^dimension.  Every product is then a matrix times long rows.
Source: Orszag (1980), doi:10.1016/0021-9991(80)90005-4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ringbalance.scene.arrays import FloatArray


@lru_cache(maxsize=32)
def stations(order: int) -> FloatArray:
    """Gauss-Lobatto points of one axis, from -1 to 1: both ends and the zeros of P_p', shape (p + 1,)."""
    inner = np.polynomial.legendre.Legendre.basis(order).deriv().roots().real if order > 1 else np.empty(0)
    points = np.concatenate([[-1.0], np.sort(inner), [1.0]])
    symmetric = np.asarray((points - points[::-1]) / 2, dtype=np.float64)
    symmetric.flags.writeable = False
    return symmetric


def line_stations(cells: int, order: int) -> FloatArray:
    """Nodes of a line of equal cells from 0 to 1, shape (p cells + 1,)."""
    inner = (np.arange(cells)[:, None] + (1 + stations(order)[:-1]) / 2) / cells
    return np.append(inner.ravel(), 1.0)


def line_shapes(places: FloatArray, order: int = 2) -> tuple[FloatArray, FloatArray]:
    """Values and slopes of the functions along one axis, each one at its own node, shape (p + 1, places)."""
    nodes = stations(order)
    values, slopes = [], []
    for own in range(order + 1):
        factors = np.delete(places - nodes[:, None], own, axis=0)
        scale = 1 / np.prod(np.delete(nodes[own] - nodes, own))
        values.append(scale * np.prod(factors, axis=0))
        less_one = [np.prod(np.delete(factors, k, axis=0), axis=0) for k in range(order)]
        slopes.append(scale * np.sum(less_one, axis=0))
    return np.stack(values), np.stack(slopes)


def products(along: Sequence[FloatArray]) -> FloatArray:
    """All products of one number along each axis; the last axis runs fastest."""
    total = along[0]
    for other in along[1:]:
        total = (total[:, None] * other).ravel()
    return total


def contracted(matrix: FloatArray, field: FloatArray, axis: int) -> FloatArray:
    """A matrix applied along one axis of a field, which must not be its last one."""
    before, size, after = field.shape[:axis], field.shape[axis], field.shape[axis + 1 :]
    rows = field.reshape(math.prod(before), size, math.prod(after))
    return np.asarray(matrix @ rows).reshape(*before, len(matrix), *after)


def contracted_all(matrices: Sequence[FloatArray], field: FloatArray) -> FloatArray:
    """One matrix applied along each of the first axes of a field, which has at least one axis more."""
    for axis, matrix in enumerate(matrices):
        field = contracted(matrix, field, axis)
    return field
