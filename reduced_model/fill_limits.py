"""Fill ratios at which gas enters the port of a driven chamber, and at which its liquid stops moving."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import liquid_area
from ringbalance.physics.tube.draw_down import port_depth
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.models import Disc, Scene

NEARLY_EMPTY: Final = 1e-6
"""Fraction of a pair's liquid at which a chamber counts as empty."""
_ZERO_FILL: Final = 1e-9
"""Fill ratio that counts as zero."""
_MAX_STEPS: Final = 60
_STEEPEST_SLOPE: Final = 0.9
_FIRST_SLOPE: Final = 0.1
"""Estimate of dg/dx before the first two values."""
_SAME_FILL: Final = 1e-8
"""Largest |g(x) - x| at the end of the iteration, whose last step leaves a hundredth of it."""
_ROUNDING: Final = 1e-12
_SCAN_POINTS: Final = 17
"""Fills of the scan for the first one at which nothing moves."""
_QUARTERINGS: Final = 12
"""Quarterings of the scan's step in which liquid stops moving, down to 4e-9 of the range."""
Drawn = Callable[[IntArray, FloatArray], FloatArray]
"""Function g of row numbers and fill ratios x: fill ratio below which the flow at x draws gas."""


def _fill_at(disc: Disc, radius: npt.ArrayLike) -> FloatArray:
    """Fill ratio whose surface lies at a radius, or nearest to it."""
    level = np.clip(radius, disc.inner_radius, disc.outer_radius)
    full = liquid_area(disc=disc, surface_radius=disc.inner_radius)
    return np.clip(liquid_area(disc=disc, surface_radius=level) / full, 0.0, 1.0)


def drawn_fill(scene: Scene, *, flow_rate: FloatArray) -> FloatArray:
    """Fill at which the layer over the port is as deep as `port_depth` for a flow."""
    depth = port_depth(scene, flow_rate=flow_rate)
    return np.minimum(_fill_at(scene.disc, scene.tube.port_radius - depth), scene.disc.max_fill_ratio)


def first_gas(
    scene: Scene, draws_down_to: Drawn, *, top: FloatArray, about: Drawn | None = None
) -> FloatArray:
    """Largest fill ratio at which gas enters the port of a chamber that a running tube empties.

    Largest root of x = g(x), g the fill ratio below which the flow at x draws gas: it is reached first.
    Args: `top`: fill ratio at the start, by row. `about`: cheaper approximation of g for the first estimate.
    Returns: x from 0 (no gas before the chamber is empty, or no flow) to `top` (gas at any fill).
    """
    # Above this fill the opposite port is uncovered, and its gas over the crest reduces the flow.
    covered = top - _fill_at(scene.disc, scene.tube.port_radius)
    covered = np.where(covered < top, covered * (1 - _ROUNDING), top)
    start = top if about is None else _fixed_point(about, top, covered, start=top)
    x = _fixed_point(draws_down_to, top, covered, start=start)
    return np.where(x > _ZERO_FILL, x, 0.0)


def _fixed_point(
    draws_down_to: Drawn, top: FloatArray, covered: FloatArray, *, start: FloatArray
) -> FloatArray:
    x, high, low = start.copy(), top.copy(), np.zeros_like(top)
    before, previous, rows = top.copy(), np.full(top.shape, np.nan), np.arange(top.size)
    done = np.zeros(top.shape, dtype=np.bool_)
    for _ in range(_MAX_STEPS):
        if rows.size == 0:
            break
        at = x[rows]
        value = draws_down_to(rows, at)
        least = np.where(at > covered[rows], covered[rows], 0.0)
        high[rows] = np.where(value < at, np.clip(value, least, high[rows]), high[rows])
        low[rows] = np.where(value > at, np.maximum(value, low[rows]), low[rows])
        step = at - before[rows]
        slope = (value - previous[rows]) / np.where(step == 0, np.nan, step)
        slope = np.where(np.isfinite(slope), np.clip(slope, 0.0, _STEEPEST_SLOPE), _FIRST_SLOPE)
        following = np.clip(at + (value - at) / (1 - slope), np.maximum(low[rows], least), high[rows])
        # Gas at any fill above: the top itself, or where the other port is covered.
        stays = (value >= at) & ((at == top[rows]) | (at == covered[rows]))
        left = (np.abs(value - at) > _SAME_FILL) & ~stays
        before[rows], previous[rows] = at, np.where(following > least, value, np.nan)
        x[rows] = np.where(stays | done[rows], at, following)
        done[rows] |= ~left
        left = ~done[rows]
        if np.count_nonzero(left) <= rows.size / 2:
            rows = rows[left]
    return x


def first_stalled(
    moves: Callable[[IntArray, FloatArray], BoolArray],
    *,
    start: FloatArray,
    end: FloatArray,
    points: int = _SCAN_POINTS,
) -> FloatArray:
    """Fill ratio between `start` and `end` at which liquid first stops moving; NaN where it never stops.

    A scan of `points` fills, then repeated quartering of the step in which liquid stops.
    Args: `moves`: true where liquid moves, for row numbers and fill ratios of shape (k, rows).
    """
    step = (end - start) / (points - 1)
    moved = moves(np.arange(start.size), start + np.arange(points)[:, None] * step)
    stops, first = ~moved.all(axis=0), np.argmin(moved, axis=0)
    stalled = np.where(stops, start, np.nan)
    rows = np.flatnonzero(stops & (first > 0))
    if rows.size == 0:
        return stalled
    start, step = (start + (first - 1) * step)[rows], step[rows]
    for _ in range(_QUARTERINGS):
        step = step / 4
        moved = moves(rows, start + np.arange(1, 4)[:, None] * step)
        start = start + np.count_nonzero(np.logical_and.accumulate(moved), axis=0) * step
    stalled[rows] = start + step
    return stalled
