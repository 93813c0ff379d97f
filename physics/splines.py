"""Splines through points in numpy alone: importing those of scipy takes longer than a calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.scene.arrays import FloatArray

_HERMITE = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [-3, 3, -2, -1], [2, -2, 1, 1]], dtype=np.float64)
"""From (y0, y1, h y0', h y1') to the coefficients of a cubic piece in t from 0 to 1."""


def _cubic_slopes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Slopes at its knots of the cubic spline through points, without knots at the second and last but one.

    Args: `x`: ascending, shape (n,), n at least 4. `y`: shape (n, ...), along the first axis.
    Source: de Boor, A Practical Guide to Splines (2001), chapter IV.
    """
    h = np.diff(x)
    chord = np.diff(y, axis=0) / h.reshape(-1, *(1,) * (y.ndim - 1))
    matrix, right = np.zeros((x.size, x.size)), np.zeros(y.shape)
    i = np.arange(1, x.size - 1)
    matrix[i, i - 1], matrix[i, i], matrix[i, i + 1] = h[1:], 2 * (h[1:] + h[:-1]), h[:-1]
    column = (-1, *(1,) * (y.ndim - 1))
    right[1:-1] = 3 * (h[1:].reshape(column) * chord[:-1] + h[:-1].reshape(column) * chord[1:])
    for row, k, step in ((0, 0, 1), (-1, -1, -1)):
        first, second = h[k] ** 2, h[k + step] ** 2
        matrix[row, [k, k + step, k + 2 * step]] = second, second - first, -first
        right[row] = 2 * (second * chord[k] - first * chord[k + step])
    return np.asarray(np.linalg.solve(matrix, right.reshape(x.size, -1)).reshape(y.shape))


@dataclass(frozen=True, kw_only=True, eq=False)
class CubicSpline:
    """y(x) by cubic pieces; the end pieces reach on."""

    knots: FloatArray
    coefficients: FloatArray
    """Of the pieces in t from 0 to 1, ascending, shape (4, n - 1)."""

    @classmethod
    def through(cls, x: FloatArray, y: FloatArray) -> CubicSpline:
        """Spline of `_cubic_slopes`, shape (n,) each."""
        h, slope = np.diff(x), _cubic_slopes(x, y)
        ends = np.array([y[:-1], y[1:], h * slope[:-1], h * slope[1:]])
        return cls(knots=x, coefficients=_HERMITE @ ends)

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values, the shape of `x`."""
        cell, t = _cell(self.knots, np.asarray(x, dtype=np.float64))
        c0, c1, c2, c3 = self.coefficients[:, cell]
        return np.asarray(c0 + t * (c1 + t * (c2 + t * c3)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """z(x, y) by pieces that are polynomials in x times polynomials in y."""

    x: FloatArray
    y: FloatArray
    coefficients: FloatArray
    """Of t_x^i t_y^j, t from 0 to 1, shape (powers, powers, x cells, y cells)."""

    @classmethod
    def bicubic(cls, x: FloatArray, y: FloatArray, z: FloatArray) -> Surface:
        """Products of the splines of `_cubic_slopes`, z of shape (x, y)."""
        dx, dy = np.diff(x)[:, None], np.diff(y)[None, :]
        along_x = _cubic_slopes(x, z)
        along_y, twist = _cubic_slopes(y, z.T).T, _cubic_slopes(y, along_x.T).T

        def corners(values: FloatArray) -> FloatArray:
            lower, upper = values[:-1], values[1:]
            return np.array([[lower[:, :-1], lower[:, 1:]], [upper[:, :-1], upper[:, 1:]]])

        data = np.empty((4, 4, x.size - 1, y.size - 1))
        data[:2, :2], data[2:, :2] = corners(z), dx * corners(along_x)
        data[:2, 2:], data[2:, 2:] = dy * corners(along_y), dx * dy * corners(twist)
        return cls(x=x, y=y, coefficients=np.einsum("ia,jb,abkl->ijkl", _HERMITE, _HERMITE, data))

    @classmethod
    def bilinear(cls, x: FloatArray, y: FloatArray, z: FloatArray) -> Surface:
        """Straight along both axes, z of shape (x, y)."""
        low, rise = z[:-1], np.diff(z, axis=0)
        pieces = [[low[:, :-1], np.diff(low, axis=1)], [rise[:, :-1], np.diff(rise, axis=1)]]
        return cls(x=x, y=y, coefficients=np.array(pieces))

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Values, of the broadcast shape."""
        (i, s), (j, t) = _cell(self.x, x), _cell(self.y, y)
        value = np.zeros(np.broadcast(s, t).shape)
        for row in self.coefficients[:, :, i, j][::-1]:
            along = row[-1]
            for piece in row[-2::-1]:
                along = along * t + piece
            value = value * s + along
        return value


def _cell(knots: FloatArray, x: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Number of the piece, and the place in it from 0 to 1."""
    cell = np.minimum(np.maximum(np.searchsorted(knots, x, side="right") - 1, 0), knots.size - 2)
    return cell, (x - knots[cell]) / (knots[cell + 1] - knots[cell])


def monotone_slopes(y: FloatArray) -> FloatArray:
    """Slopes at equally spaced samples, a unit apart, of the cubics that never leave two neighbours' span.

    Args: `y`: shape (n,), n at least 2.
    Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300: harmonic means of the chords; at the
        ends the parabola's slope, limited.
    """
    chord = np.diff(y)
    if chord.size == 1:
        return np.repeat(chord, 2)
    before, after = chord[:-1], chord[1:]
    same = before * after > 0
    inner = np.where(same, 2 * before * after / np.where(same, before + after, 1.0), 0.0)
    return np.concatenate([[_end_slope(chord[0], chord[1])], inner, [_end_slope(chord[-1], chord[-2])]])


def _end_slope(outer: float, inner: float) -> float:
    slope = (3 * outer - inner) / 2
    if np.sign(slope) != np.sign(outer):
        return 0.0
    return 3 * outer if np.sign(outer) != np.sign(inner) and abs(slope) > 3 * abs(outer) else slope
