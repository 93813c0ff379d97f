"""Piecewise polynomials through tables in numpy: loading SciPy takes longer than a thousand designs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Pieces:
    """A polynomial between each two nodes."""

    nodes: FloatArray
    """x_i, rising."""
    coefficients: FloatArray
    """By power of x - x_i, shape (powers, intervals, ...)."""

    @classmethod
    def straight(cls, nodes: FloatArray, values: FloatArray) -> Pieces:
        """Through values that run along their first axis."""
        return cls(nodes=nodes, coefficients=np.stack([values[:-1], _chords(nodes, values)]))

    @classmethod
    def hermite(cls, nodes: FloatArray, values: FloatArray, slopes: FloatArray) -> Pieces:
        """The cubics with these values and slopes."""
        chord, h = _chords(nodes, values), _steps(nodes, values)
        bend = (slopes[:-1] + slopes[1:] - 2 * chord) / h
        return cls(
            nodes=nodes,
            coefficients=np.stack([values[:-1], slopes[:-1], (chord - slopes[:-1]) / h - bend, bend / h]),
        )

    @classmethod
    def spline(cls, nodes: FloatArray, values: FloatArray) -> Pieces:
        """The cubic spline of four nodes and more, without a knot at the second and at the last but one."""
        return cls.hermite(nodes, values, _spline_slopes(nodes, values))

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values at places of any shape; beyond the nodes the outermost piece goes on."""
        place, beyond = _interval(self.nodes, x)
        of_each = (*beyond.shape, *[1] * (self.coefficients.ndim - 2))
        return _power_sum(self.coefficients.take(place, axis=1), beyond.reshape(of_each))

    def derivative(self) -> Pieces:
        """Of the pieces, by x."""
        powers = np.arange(1, self.coefficients.shape[0])
        factors = powers.reshape(-1, *[1] * (self.coefficients.ndim - 1))
        return Pieces(nodes=self.nodes, coefficients=factors * self.coefficients[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class GridPieces:
    """The same over a grid of two coordinates."""

    first: FloatArray
    second: FloatArray
    coefficients: FloatArray
    """By power of the second and of the first coordinate, then interval of both as one number."""

    @classmethod
    def straight(cls, first: FloatArray, second: FloatArray, values: FloatArray) -> GridPieces:
        """Args: `values`: of shape (nodes of `first`, nodes of `second`)."""
        along = Pieces.straight(first, values).coefficients
        return cls._of(first, second, Pieces.straight(second, np.moveaxis(along, -1, 0)))

    @classmethod
    def spline(cls, first: FloatArray, second: FloatArray, values: FloatArray) -> GridPieces:
        """As `Pieces.spline` along both coordinates."""
        along = Pieces.spline(first, values).coefficients
        return cls._of(first, second, Pieces.spline(second, np.moveaxis(along, -1, 0)))

    @classmethod
    def _of(cls, first: FloatArray, second: FloatArray, both: Pieces) -> GridPieces:
        powers = both.coefficients.shape[0]
        cells = np.moveaxis(both.coefficients, 1, -1).reshape(powers, powers, -1)
        return cls(first=first, second=second, coefficients=cells)

    def __call__(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Values at places (a, b), of one shape."""
        (i, s), (j, t) = _interval(self.first, a), _interval(self.second, b)
        cell = i * (self.second.size - 1) + j
        return _power_sum(_power_sum(self.coefficients.take(cell, axis=2), t), s)


def _steps(nodes: FloatArray, values: FloatArray) -> FloatArray:
    return np.diff(nodes).reshape(-1, *[1] * (values.ndim - 1))


def _chords(nodes: FloatArray, values: FloatArray) -> FloatArray:
    return np.asarray(np.diff(values, axis=0) / _steps(nodes, values))


def _spline_slopes(nodes: FloatArray, values: FloatArray) -> FloatArray:
    """Slopes at the nodes, from a continuous second derivative and, at two nodes, a continuous third one."""
    h, chord, count = np.diff(nodes), _chords(nodes, values), nodes.size
    system, right = np.zeros((count, count)), np.empty_like(values)
    for i in range(1, count - 1):
        system[i, i - 1 : i + 2] = h[i], 2 * (h[i - 1] + h[i]), h[i - 1]
        right[i] = 3 * (h[i] * chord[i - 1] + h[i - 1] * chord[i])
    for end, (i, j) in ((0, (0, 1)), (-1, (-1, -2))):
        both = h[i] + h[j]
        system[end, [i, j]] = h[j], both
        right[end] = ((h[i] + 2 * both) * h[j] * chord[i] + h[i] ** 2 * chord[j]) / both
    return np.asarray(np.linalg.solve(system, right.reshape(count, -1)).reshape(values.shape))


def _interval(nodes: FloatArray, x: FloatArray) -> tuple[IntArray, FloatArray]:
    """Number of the interval that holds x, and how far x lies in it."""
    place = np.minimum(np.maximum(np.searchsorted(nodes, x, side="right") - 1, 0), nodes.size - 2)
    return place, x - nodes[place]


def _power_sum(coefficients: FloatArray, x: FloatArray) -> FloatArray:
    """Coefficients along the first axis times powers of x."""
    return reduce(lambda higher, lower: higher * x + lower, coefficients[::-1])
