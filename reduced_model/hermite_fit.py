"""Making a smooth table from samples of a function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator, make_interp_spline

from ringbalance.reduced_model.hermite import HermiteTable

FloatArray = npt.NDArray[np.float64]

_STEEPEST = 2.5
"""Slope at a sample over the smaller of its two chords up to which quintic pieces without curvature rise."""


def table_from_samples(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples by a spline of degree five (less for fewer than six samples).

    Args:
        start: x of the first sample.
        stop: x of the last sample.
        value: samples, shape (n,), n at least 2.

    Returns:
        HermiteTable, the same function as the spline.

    Source: not-a-knot spline; error O(step^6).
    """
    y = np.asarray(value, dtype=np.float64)
    # In units of the step, so that the spline's linear system does not depend on the scale of x.
    spline = make_interp_spline(np.arange(y.size, dtype=np.float64), y, k=min(5, (y.size - 1) // 2 * 2 + 1))
    places, step = np.arange(y.size, dtype=np.float64), (stop - start) / (y.size - 1)
    return HermiteTable(
        start=start, step=step, value=y, slope=spline(places, 1) / step, curvature=spline(places, 2) / step**2
    )


def level_table(*, start: float, stop: float, value: npt.ArrayLike) -> HermiteTable:
    """Interpolate equally spaced samples that may step, without ever leaving the span of two neighbours.

    Args:
        start: x of the first sample.
        stop: x of the last sample.
        value: samples, shape (n,), n at least 2.

    Returns:
        HermiteTable with slopes limited as by Fritsch and Butland and no curvature at the samples.

    Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; error O(step^2).
    """
    y = np.asarray(value, dtype=np.float64)
    places, step = np.arange(y.size, dtype=np.float64), (stop - start) / (y.size - 1)
    rises = np.abs(np.diff(y))
    steepest = _STEEPEST * np.minimum(np.append(rises[:1], rises), np.append(rises, rises[-1:]))
    slope = np.clip(PchipInterpolator(places, y).derivative()(places), -steepest, steepest)
    return HermiteTable(start=start, step=step, value=y, slope=slope / step, curvature=np.zeros_like(y))


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

    Args:
        function: y(x), vectorised.
        start: first x.
        stop: last x.
        tolerance: error aimed at, in units of y.
        first: samples to begin with.
        last: samples at which to stop.

    Returns:
        The table, and its largest error found halfway between the nodes.
    """
    count = first
    while True:
        table = table_from_samples(start=start, stop=stop, value=function(np.linspace(start, stop, count)))
        middle = table.nodes[:-1] + table.step / 2
        error = float(np.max(np.abs(table(middle) - function(middle))))
        if error <= tolerance or 2 * count - 1 > last:
            return table, error
        count = 2 * count - 1
