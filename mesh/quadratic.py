"""Quadratic cells: shape functions as products of the three along each axis, from -1 to 1."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ringbalance.scene.arrays import FloatArray


def line_shapes(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and slopes of the three functions along one axis, shape (3, places)."""
    t = places
    return np.stack([t * (t - 1) / 2, 1 - t**2, t * (t + 1) / 2]), np.stack([t - 0.5, -2 * t, t + 0.5])


def cell_shapes(places: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Shape functions of a cell at the product of places along each axis.

    Returns: Values, shape (functions, points), and gradients, shape (functions, points, dimension); the last
        axis runs fastest in functions and in points.
    """
    lines = [line_shapes(along) for along in places]
    slopes = [
        products([pair[1 if axis == other else 0] for other, pair in enumerate(lines)])
        for axis in range(len(lines))
    ]
    return products([values for values, _ in lines]), np.stack(slopes, axis=-1)


def products(along: Sequence[FloatArray]) -> FloatArray:
    """All products of one entry along each axis; the last axis runs fastest."""
    total = along[0]
    for other in along[1:]:
        total = np.asarray(np.kron(total, other), dtype=np.float64)
    return total


def jacobians(nodes: FloatArray, gradients: FloatArray) -> FloatArray:
    """dx/dX in cells, shape (cells, points, dimension, dimension).

    Args: `nodes`: places of the nodes of each cell, shape (dimension, cells, functions).
    """
    local = nodes - nodes[:, :, :1]  # differences first: a film's depth would cancel in the sums
    dimension, cells, functions = local.shape
    flat = local.reshape(-1, functions) @ gradients.reshape(functions, -1)
    return flat.reshape(dimension, cells, -1, dimension).transpose(1, 2, 0, 3)
