"""Functions of one argument in pieces between knots, which a tolerance places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline, make_interp_spline

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, clipped


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Columns over knots: values with slopes and curvatures, or values that are linear between knots.

    A stack of tables has them on a first axis and gives columns and coefficients only.
    """

    knots: FloatArray
    """The argument, shape (n,) or (tables, n), n at least 2, growing; read-only."""
    columns: FloatArray
    """Shape (columns n,) or (tables, columns n), one column behind the other; read-only."""

    def __post_init__(self) -> None:
        """Copy the arrays, so that nothing outside can change the table."""
        for name in ("knots", "columns"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.ndim not in (1, 2) or not np.all(np.isfinite(array)):
                raise ValueError(f"{name} must be rows of finite numbers")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.knots.shape[-1] < 2 or not np.all(np.diff(self.knots) > 0):
            raise ValueError("a table needs two knots or more, which grow")
        if self.columns.size == 0 or self.columns.size % self.knots.size:
            raise ValueError("a table needs whole columns, with a number for every knot")

    @classmethod
    def stacked(cls, tables: Sequence[Table]) -> Table:
        """The stack of tables with equally many knots and columns."""
        return cls(
            knots=np.stack([each.knots for each in tables]),
            columns=np.stack([each.columns for each in tables]),
        )

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.columns.size // self.knots.size

    def column(self, number: int) -> FloatArray:
        """Values of a column at the knots, of their shape."""
        n = self.knots.shape[-1]
        return self.columns[..., number * n : (number + 1) * n]

    def with_column(self, number: int, values: npt.ArrayLike) -> Table:
        """The table with other values in a column, or one more behind the last."""
        columns = [*self.columns.reshape(-1, self.knots.size)]
        columns[number : number + 1] = [np.broadcast_to(values, self.knots.shape)]
        return replace(self, columns=np.concatenate(columns))

    @cached_property
    def quintics(self) -> FloatArray:
        """The first column, with its slopes and curvatures, in powers of x - end, shape (..., 6, n - 1)."""
        return self._powers(range(3))

    def cubics(self, number: int) -> FloatArray:
        """A column with its slopes in powers of x - end, shape (..., 4, n - 1)."""
        return self._powers((number, number + 1))

    def _powers(self, numbers: Sequence[int]) -> FloatArray:
        """Coefficients of the pieces by a column and its derivatives in further ones."""
        h = np.diff(self.knots)
        ends = [(column[..., :-1], column[..., 1:]) for column in map(self.column, numbers)]
        powers = np.stack(_polynomial(h, *ends), axis=-2)
        return np.asarray(powers / h[..., None, :] ** np.arange(powers.shape[-2])[:, None])

    def locate(self, x: npt.ArrayLike) -> tuple[IntArray, FloatArray]:
        """The piece of any x, or the nearest one, and the distance from its end."""
        inside = clipped(x, self.knots[0], self.knots[-1])
        piece = pieces_of(self.knots, inside)
        return piece, np.asarray(inside - self.knots[piece + 1])

    def quintic(self, x: npt.ArrayLike) -> FloatArray:
        """The first column at any x, constant beyond the ends."""
        piece, t = self.locate(x)
        c = self.quintics[:, piece]
        return np.asarray(c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5])))))

    def cubic(self, x: npt.ArrayLike, number: int) -> FloatArray:
        """Column followed by its slopes, at any x, constant beyond the ends."""
        piece, t = self.locate(x)
        c = self.cubics(number)[:, piece]
        return np.asarray(c[0] + t * (c[1] + t * (c[2] + t * c[3])))

    def straight(self, x: npt.ArrayLike, number: int) -> FloatArray:
        """Column at any x, linear between knots and constant beyond the ends."""
        return np.asarray(np.interp(np.asarray(x, dtype=np.float64), self.knots, self.column(number)))


def pieces_of(knots: FloatArray, x: npt.ArrayLike) -> IntArray:
    """Piece that holds each x, its end included; for a stack of knots, x has a first axis too."""
    if knots.ndim == 1:
        return np.asarray(np.searchsorted(knots[1:-1], x))
    return np.stack([np.searchsorted(*each) for each in zip(knots[:, 1:-1], np.asarray(x), strict=True)])


def _polynomial(h: Any, value: tuple[Any, Any], *derivatives: tuple[Any, Any]) -> list[Any]:
    """Powers of (x - end)/h of a piece of length h, from values, slopes and curvatures at both ends."""
    if not derivatives:
        return [value[1], value[1] - value[0]]
    rise, (first, last) = value[0] - value[1], (h * each for each in derivatives[0])
    if len(derivatives) == 1:
        return [value[1], last, 3 * rise + first + 2 * last, 2 * rise + first + last]
    before, behind = (h * h * each / 2 for each in derivatives[1])
    rise, turn, bend = rise + last - behind, last - first - 2 * behind, before - behind
    third, fourth = 10 * rise - 4 * turn + bend, 7 * turn - 15 * rise - 2 * bend
    return [value[1], last, behind, -third, fourth, -(6 * rise - 3 * turn + bend)]


def spline(x: npt.ArrayLike, y: npt.ArrayLike) -> BSpline:
    """Interpolating spline of degree five, for fewer than six samples one polynomial.

    Source: not-a-knot, O(step^6).
    """
    return make_interp_spline(x, y, k=min(5, np.size(x) - 1))


def smooth_table(x: FloatArray, y: npt.ArrayLike) -> Table:
    """Table of values, slopes and curvatures of `spline`, with every sample a knot."""
    return smooth_tables(x, np.asarray(y, dtype=np.float64)[:, None])[0]


def smooth_tables(x: FloatArray, y: FloatArray) -> list[Table]:
    """Make the `smooth_table` of many quantities. Args: `y`: shape (samples, quantities)."""
    # A large common value would cost digits.
    curve = spline(x, y - y[0])
    columns = np.concatenate([y, curve(x, nu=1), curve(x, nu=2)])
    return [Table(knots=x, columns=each) for each in columns.T]


@dataclass(frozen=True, kw_only=True)
class TableColumn:
    """Quantity at samples, with the derivatives by x that its pieces need."""

    value: FloatArray
    """Shape (samples,)."""
    allowed: FloatArray
    """Largest error, shape (samples,)."""
    derivatives: tuple[FloatArray, ...] = ()
    """Slope, or slope and curvature; none: linear between the knots."""

    @property
    def stored(self) -> tuple[FloatArray, ...]:
        """Values and derivatives as a table stores them."""
        return self.value, *self.derivatives

    def misses(self, x: FloatArray, inside: IntArray) -> BoolArray:
        """True where a piece errs by more than is allowed. Args: `inside`: samples of each, (pieces, n)."""
        first, last = inside[:, :1], inside[:, -1:]
        h = x[last] - x[first]
        powers = _polynomial(h, *((each[first], each[last]) for each in self.stored))
        t, value = (x[inside] - x[last]) / h, powers.pop()
        while powers:
            value = powers.pop() + t * value
        return np.asarray(np.any(np.abs(value - self.value[inside]) > self.allowed[inside], axis=1))


_LONGEST_PIECE: Final = 128
"""Length of the longest piece over that of the shortest."""


def knots_of(x: FloatArray, columns: Sequence[TableColumn], *, shortest: int = 1) -> IntArray:
    """Samples at which pieces meet; each is halved until its errors are allowed or it has the least length.

    Args: `x`: 2^n + 1 samples. `shortest`: least length of a piece, in steps from sample to sample.
    """
    length = min(_LONGEST_PIECE * shortest, x.size - 1)
    starts, knots = np.arange(0, x.size - 1, length), [np.array([x.size - 1])]
    while starts.size:
        halved = np.zeros(starts.size, dtype=np.bool_)
        for column in columns if length > shortest else ():
            rest = np.flatnonzero(~halved)
            halved[rest] = column.misses(x, starts[rest, None] + np.arange(length + 1))
        knots.append(starts[~halved])
        length //= 2
        starts = np.concatenate([starts[halved], starts[halved] + length])
    return np.sort(np.concatenate(knots))


def table_at(x: FloatArray, knots: IntArray, columns: Sequence[TableColumn]) -> Table:
    """The columns at the knots."""
    stored = [values[knots] for column in columns for values in column.stored]
    return Table(knots=x[knots], columns=np.concatenate(stored))
