"""A smooth table: quintic Hermite pieces on a uniform grid, which can be inverted.

The nodes hold value, slope and curvature, so a saved table gives the same bits wherever it is read again, and
compiled code needs nothing but the three arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator, make_interp_spline

from ringbalance.scene.arrays import FloatArray, clipped

_NEWTON_STEPS = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class HermiteTable:
    """y(x) on x = start + i step; beyond the ends it continues straight."""

    start: float
    """x of the first node."""
    step: float
    """Distance of the nodes."""
    value: FloatArray
    """y at the nodes, shape (n,), n at least 2; read-only."""
    slope: FloatArray
    """dy/dx at the nodes, shape (n,); read-only."""
    curvature: FloatArray
    """d2y/dx2 at the nodes, shape (n,); read-only."""

    def __post_init__(self) -> None:
        """Copy the arrays, so that nothing outside can change the table."""
        for name in ("value", "slope", "curvature"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.ndim != 1 or array.size < 2 or array.size != np.size(self.value):
                raise ValueError("a table needs value, slope and curvature at the same two nodes or more")
            if not np.all(np.isfinite(array)):
                raise ValueError(f"{name} must be finite")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if not (np.isfinite(self.start) and np.isfinite(self.step) and self.step > 0):
            raise ValueError("start must be finite and step positive")
        object.__setattr__(self, "_pieces", _polynomials(self))

    @property
    def nodes(self) -> FloatArray:
        """x of the nodes, shape (n,)."""
        return np.asarray(self.start + self.step * np.arange(self.value.size), dtype=np.float64)

    @property
    def coefficients(self) -> FloatArray:
        """Coefficients of the pieces in t from 0 to 1, ascending powers, shape (6, n - 1)."""
        pieces: FloatArray = self.__dict__["_pieces"]
        return pieces[:6]

    def __call__(self, x: npt.ArrayLike) -> FloatArray:
        """Value at any x."""
        return self.with_slope(x)[0]

    def with_slope(self, x: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Value and slope at any x."""
        place = (np.asarray(x, dtype=np.float64) - self.start) / self.step
        cell = clipped(np.floor(place), 0, self.value.size - 2).astype(np.intp)
        t = clipped(place - cell, 0.0, 1.0)
        y, slope = self._within(cell, t)
        beyond = place - cell - t
        return np.asarray(y + beyond * self.step * slope), slope

    def _within(self, cell: npt.NDArray[np.intp], t: FloatArray) -> tuple[FloatArray, FloatArray]:
        pieces: FloatArray = self.__dict__["_pieces"]
        a0, a1, a2, a3, a4, a5, d2, d3, d4, d5 = pieces[:, cell]
        y = a0 + t * (a1 + t * (a2 + t * (a3 + t * (a4 + t * a5))))
        slope = (a1 + t * (d2 + t * (d3 + t * (d4 + t * d5)))) / self.step
        return np.asarray(y, dtype=np.float64), np.asarray(slope, dtype=np.float64)

    def inverse(self, y: npt.ArrayLike) -> FloatArray:
        """The x of a value, for a table that grows from node to node."""
        wanted = np.asarray(y, dtype=np.float64)
        cell = np.minimum(np.maximum(np.searchsorted(self.value, wanted) - 1, 0), self.value.size - 2)
        low = self.value[cell]
        t = clipped((wanted - low) / (self.value[cell + 1] - low), 0.0, 1.0)
        for _ in range(_NEWTON_STEPS):
            found, slope = self._within(cell, t)
            better = clipped(t + (wanted - found) / (self.step * slope), 0.0, 1.0)
            if (better == t).all():
                break
            t = better
        else:
            found, slope = self._within(cell, t)
        return np.asarray(self.start + self.step * (cell + t) + (wanted - found) / slope, dtype=np.float64)


def _polynomials(table: HermiteTable) -> FloatArray:
    """Coefficients of every piece in t from 0 to 1, of the value from t^0 up and of its slope from t^1 up."""
    h = table.step
    y0, d0, c0 = table.value[:-1], h * table.slope[:-1], h * h * table.curvature[:-1] / 2
    rise = table.value[1:] - y0 - d0 - c0
    turn = h * table.slope[1:] - d0 - 2 * c0
    bend = h * h * table.curvature[1:] - 2 * c0
    a3 = 10 * rise - 4 * turn + bend / 2
    a4 = -15 * rise + 7 * turn - bend
    a5 = 6 * rise - 3 * turn + bend / 2
    return np.array([y0, d0, c0, a3, a4, a5, 2 * c0, 3 * a3, 4 * a4, 5 * a5])


_STEEPEST = 2.5
"""Slope at a sample over the smaller of its two chords up to which quintic pieces without curvature rise."""


def table_from_samples(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples by a spline of degree five, fewer than six by one polynomial.

    Source: not-a-knot spline; error O(step^6).
    """
    return tables_from_samples(start=start, stop=stop, value=np.asarray(value)[:, None])[0]


def tables_from_samples(*, start: float, stop: float, value: npt.ArrayLike) -> tuple[HermiteTable, ...]:
    """The same of many tables at once. Args: `value`: shape (samples, tables)."""
    y = np.asarray(value, dtype=np.float64)
    count = y.shape[0]
    step, places = (stop - start) / (count - 1), np.arange(count)
    # A large common value would cost digits.
    spline = make_interp_spline(places, y - y[0], k=min(5, count - 1))
    slope, curvature = (spline(places, nu=order).T for order in (1, 2))
    return tuple(
        HermiteTable(start=start, step=step, value=v, slope=d / step, curvature=c / step**2)
        for v, d, c in zip(y.T, slope, curvature, strict=True)
    )


def level_table(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples that may step, without ever leaving the span of two neighbours.

    Returns: HermiteTable with slopes limited as by Fritsch and Butland and no curvature at the samples.
    Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; error O(step^2).
    """
    y = np.asarray(value, dtype=np.float64)
    step = (stop - start) / (y.size - 1)
    rises = np.abs(np.diff(y))
    steepest = _STEEPEST * np.minimum(np.append(rises[:1], rises), np.append(rises, rises[-1:]))
    nodes = np.arange(y.size)
    slope = np.clip(PchipInterpolator(nodes, y).derivative()(nodes), -steepest, steepest)
    return HermiteTable(start=start, step=step, value=y, slope=slope / step, curvature=np.zeros_like(y))


def flat_table(*, start: float, stop: float, value: float = 0.0) -> HermiteTable:
    """One value everywhere, such as an uncertainty that is left out."""
    level, none = np.full(2, value), np.zeros(2)
    return HermiteTable(start=start, step=stop - start, value=level, slope=none, curvature=none)
