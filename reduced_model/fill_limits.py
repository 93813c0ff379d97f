"""Fills at which gas enters the port of the chamber that is emptied, and at which its liquid stops moving."""

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
"""Share of a pair's liquid with which a chamber's last liquid is looked at."""
_NOTHING: Final = 1e-9
"""Below this a fill ratio is not told from zero."""
_ROUNDS: Final = 60
_STEEPEST: Final = 0.9
_GENTLE: Final = 0.1
"""dg/dx before it is known, about."""
_SAME_FILL: Final = 1e-8
"""Error of a fill, of which the last step leaves a hundredth."""
_ROUNDING: Final = 1e-12
_PLACES: Final = 17
"""Of the scan for the first fill at which nothing moves."""
_QUARTERINGS: Final = 12
"""Of the step in which that lies: 4e-9 of the way is left."""
Drawn = Callable[[IntArray, FloatArray], FloatArray]
"""Fill down to which the flow at a fill draws gas, of some rows."""


def _fill_at(disc: Disc, radius: npt.ArrayLike) -> FloatArray:
    """Fill ratio whose surface lies at a radius, or nearest to it."""
    level = np.clip(radius, disc.inner_radius, disc.outer_radius)
    whole = liquid_area(disc=disc, surface_radius=disc.inner_radius)
    return np.clip(liquid_area(disc=disc, surface_radius=level) / whole, 0.0, 1.0)


def drawn_fill(scene: Scene, *, flow_rate: FloatArray) -> FloatArray:
    """Fill at which the layer over the port is as deep as `port_depth` for a flow."""
    depth = port_depth(scene, flow_rate=flow_rate)
    return np.minimum(_fill_at(scene.disc, scene.tube.port_radius - depth), scene.disc.max_fill_ratio)


def first_gas(scene: Scene, drawn: Drawn, *, top: FloatArray, about: Drawn | None = None) -> FloatArray:
    """Fill at which gas enters the port of a chamber that a running tube empties: the largest such fill.

    x = g(x), g the fill that the flow at x draws gas down to: from the top down g falls with the flow, so the
    largest of such fills is the first to be met.
    Args: `top`: of every row. `about`: a cheaper g to start with.
    Returns: x from 0 (no gas before the chamber is empty, or no flow) to `top` (gas at any fill).
    """
    # Above, the opposite chamber leaves its port open, and its gas over the crest lets less liquid flow.
    covered = top - _fill_at(scene.disc, scene.tube.port_radius)
    covered = np.where(covered < top, covered * (1 - _ROUNDING), top)
    start = top if about is None else _fixed_point(about, top, covered, start=top)
    x = _fixed_point(drawn, top, covered, start=start)
    return np.where(x > _NOTHING, x, 0.0)


def _fixed_point(drawn_by: Drawn, top: FloatArray, covered: FloatArray, *, start: FloatArray) -> FloatArray:
    x, high, low = start.copy(), top.copy(), np.zeros_like(top)
    before, drawn, rows = top.copy(), np.full(top.shape, np.nan), np.arange(top.size)
    done = np.zeros(top.shape, dtype=np.bool_)
    for _ in range(_ROUNDS):
        if rows.size == 0:
            break
        here = x[rows]
        now = drawn_by(rows, here)
        least = np.where(here > covered[rows], covered[rows], 0.0)
        high[rows] = np.where(now < here, np.clip(now, least, high[rows]), high[rows])
        low[rows] = np.where(now > here, np.maximum(now, low[rows]), low[rows])
        step = here - before[rows]
        slope = (now - drawn[rows]) / np.where(step == 0, np.nan, step)
        slope = np.where(np.isfinite(slope), np.clip(slope, 0.0, _STEEPEST), _GENTLE)
        then = np.clip(here + (now - here) / (1 - slope), np.maximum(low[rows], least), high[rows])
        # Gas at any fill above: the top itself, or where the other port is covered.
        stays = (now >= here) & ((here == top[rows]) | (here == covered[rows]))
        left = (np.abs(now - here) > _SAME_FILL) & ~stays
        before[rows], drawn[rows] = here, np.where(then > least, now, np.nan)
        x[rows] = np.where(stays | done[rows], here, then)
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
    places: int = _PLACES,
) -> FloatArray:
    """Fill from `start` down to `end` at which liquid first stops moving; NaN where it moves at all.

    By a scan of so many places, and by quarters of the step in which it stops.
    Args: `moves`: of some rows, whether liquid moves at fills of shape (k, rows).
    """
    step = (end - start) / (places - 1)
    moved = moves(np.arange(start.size), start + np.arange(places)[:, None] * step)
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
