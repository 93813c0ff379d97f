"""Making a smooth table from samples of a function."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.splines import monotone_slopes
from ringbalance.reduced_model.tables.hermite import HermiteTable, quintic
from ringbalance.scene.arrays import FloatArray

_REACH: Final = 50
"""Samples after which a quintic spline's response has fallen by 0.43^50."""
_STEEPEST = 2.5
"""Slope at a sample over the smaller of its two chords up to which quintic pieces without curvature rise."""


def table_from_samples(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples by a spline of degree five, fewer than six by one polynomial.

    Source: not-a-knot spline; error O(step^6).
    """
    y = np.asarray(value, dtype=np.float64)
    step = (stop - start) / (y.size - 1)
    slope, curvature = _spline_derivatives(y)
    return HermiteTable(start=start, step=step, value=y, slope=slope / step, curvature=curvature / step**2)


def _spline_derivatives(y: FloatArray) -> FloatArray:
    """First and second derivatives at samples a unit apart, shape (2, n).

    Those of a sample reach no farther than `_REACH` neighbours, beyond which the spline has forgotten it.
    """
    shift = y[0]  # a large common value would cost digits
    if y.size <= 2 * _REACH + 1:
        return np.asarray(_derivative_rows(y.size) @ (y - shift))
    rows = _derivative_rows(2 * _REACH + 1)
    near = rows[:, :_REACH] @ (y[: 2 * _REACH + 1] - shift)
    far = rows[:, _REACH + 1 :] @ (y[-2 * _REACH - 1 :] - y[-1])
    middle = np.array([np.correlate(y - shift, row[_REACH], mode="valid") for row in rows])
    return np.concatenate([near, middle, far], axis=1)


@lru_cache(maxsize=64)
def _derivative_rows(count: int) -> FloatArray:
    """Matrices that take samples a unit apart to slopes and curvatures, shape (2, n, n)."""
    if count < 6:
        powers = np.arange(count)
        places = powers[:, None].astype(np.float64)
        slope = powers * places ** np.maximum(powers - 1, 0)
        curvature = powers * (powers - 1) * places ** np.maximum(powers - 2, 0)
        return np.asarray(np.array([slope, curvature]) @ np.linalg.inv(places**powers))
    samples, derivatives = _joints(count)
    solved = -np.linalg.solve(derivatives, samples)
    return np.array([solved[:count], solved[count:]])


def _joints(count: int) -> tuple[FloatArray, FloatArray]:
    """Conditions on a quintic spline's samples, slopes and curvatures; the columns of its derivatives apart.

    Third and fourth derivative are continuous, and the fifth at the two joints next to either end.
    """
    identity = np.eye(3 * count)
    y, d, c = identity[:count], identity[count : 2 * count], identity[2 * count :] / 2
    rise, turn, bend = y[1:] - y[:-1] - d[:-1] - c[:-1], d[1:] - d[:-1] - 2 * c[:-1], 2 * (c[1:] - c[:-1])
    a3, a4, a5 = quintic(rise, turn, bend)
    third = (a3 + 4 * a4 + 10 * a5)[:-1] - a3[1:]
    fourth = (a4 + 5 * a5)[:-1] - a4[1:]
    fifth = (a5[:-1] - a5[1:])[[0, 1, -2, -1]]
    conditions = np.concatenate([third, fourth, fifth])
    return conditions[:, :count], conditions[:, count:]


def level_table(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples that may step, without ever leaving the span of two neighbours.

    Returns: HermiteTable with slopes limited as by Fritsch and Butland and no curvature at the samples.
    Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; error O(step^2).
    """
    y = np.asarray(value, dtype=np.float64)
    step = (stop - start) / (y.size - 1)
    rises = np.abs(np.diff(y))
    steepest = _STEEPEST * np.minimum(np.append(rises[:1], rises), np.append(rises, rises[-1:]))
    slope = np.clip(monotone_slopes(y), -steepest, steepest)
    return HermiteTable(start=start, step=step, value=y, slope=slope / step, curvature=np.zeros_like(y))


def flat_table(*, start: float, stop: float, value: float = 0.0) -> HermiteTable:
    """One value everywhere, such as an uncertainty that is left out."""
    level, none = np.full(2, value), np.zeros(2)
    return HermiteTable(start=start, step=stop - start, value=level, slope=none, curvature=none)


def refined_table(
    *,
    function: Callable[[FloatArray], FloatArray],
    start: float,
    stop: float,
    tolerance: float,
    first: int = 129,
    last: int = 4097,
) -> tuple[HermiteTable, float]:
    """Tabulate a function, doubling the samples until the error between the nodes is small enough.

    Args: `function`: y(x), vectorised. `start`: first x. `stop`: last x. `tolerance`: error aimed at, in
        units of y. `first`: samples to begin with. `last`: samples at which to stop.
    Returns: The table, and its largest error found halfway between the nodes.
    """
    value = function(np.linspace(start, stop, first))
    while True:
        table = table_from_samples(start=start, stop=stop, value=value)
        middle = table.nodes[:-1] + table.step / 2
        between = function(middle)
        error = float(np.max(np.abs(table(middle) - between)))
        if error <= tolerance or 2 * value.size - 1 > last:
            return table, error
        value = np.insert(value, np.arange(1, value.size), between)
