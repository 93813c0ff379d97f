"""Every flow that a pair can have under one gas pressure, as paths x(t) that all operations are parts of.

A pair's flow is autonomous: from one fill it always continues in the same way.  The range of fills falls into
intervals of one sense and regime; neighbours of one sense form a path, whose times follow from the quadrature
t = (V/S) integral dx/u(x) and which is kept as cubic pieces x(t), fine enough for 1e-11 in fill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial import legendre

from ringbalance.controller.liquid_ring.transfer import Drive
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray

FILLS: Final = 2049
"""At which changes of sense, regime and priming are looked for."""
MOST_CHANGES: Final = 2000
"""Of sense, regime and priming under one gas pressure."""
SECTION: Final = 33
PIECE_ERROR: Final = 3e-11
"""In fill, of a piece before it is halved once more, which leaves a sixteenth."""
GONE: Final = 1e-12
"""Distance to a stall that counts as there."""
MOST_PIECES: Final = 20_000
_NODE, _NODE_WEIGHT = legendre.leggauss(12)
_ABSCISSA: Final[FloatArray] = (1 + _NODE) / 2
"""Of Gauss's rule on [0, 1]."""
_WEIGHT: Final[FloatArray] = _NODE_WEIGHT / 2
_GRADED: Final = 20
"""Halvings of the first piece before an end, where the velocity may vanish."""


class UntabulatedError(ValueError):
    """A law whose velocity or regime changes too often for a table."""

    def __init__(self) -> None:
        super().__init__("this law cannot be tabled for an ensemble: run the members one by one")


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowPaths:
    """All flows under one gas pressure."""

    edges: FloatArray
    """First fill of each interval but the lowest, ascending, shape (n - 1,)."""
    sense: IntArray
    """1: out of the driven chamber, -1: back into it, 0: none; shape (n,)."""
    holds: BoolArray
    """Whether the tube holds a column there afterwards, shape (n,)."""
    path: IntArray
    """Which path an interval belongs to, -1 for none, shape (n,)."""
    begin: IntArray
    """Index of each path's first node, and the number of nodes, shape (paths + 1,)."""
    nodes: FloatArray
    """Time from the start of the path (s), x, dx/dt with which the piece after the node begins and the one
    before it ends; each path in the order of time, shape (4, nodes)."""

    def primes(self, fill: float) -> bool:
        """Whether the tube holds a column after it has begun to flow at a fill."""
        interval = int(np.searchsorted(self.edges, fill, side="right"))
        return bool(self.sense[interval] != 0 and self.holds[interval])

    @classmethod
    def of(cls, drive: Drive, *, primed: bool, most_changes: int = MOST_CHANGES) -> FlowPaths:
        """All flows of a pair under the gas pressure of a drive, whose fill and priming do not matter.

        With `primed` False those of an unprimed tube, whose paths end where it is primed.
        Raises: UntabulatedError: a law that changes sense, regime or priming more than `most_changes` times.
        """
        flowing = replace(drive, primed=primed)
        found = _mapped(flowing, most_changes=most_changes)
        intervals = _intervals(drive, found)
        own = found.sense if primed else np.where(found.holds, 0, found.sense)
        paths = _path_of_each(own)
        nodes = [_path(flowing, intervals, own, paths == p) for p in range(int(paths.max()) + 1)]
        begin = np.cumsum([0] + [rows.shape[1] for rows in nodes])
        return cls(
            edges=found.after,
            sense=found.sense,
            holds=found.holds,
            path=paths.astype(np.int64),
            begin=begin.astype(np.int64),
            nodes=np.concatenate([np.zeros((4, 0)), *nodes], axis=1),
        )


@dataclass(frozen=True, kw_only=True)
class _Map:
    """Sense, priming and regime over the fill, constant between changes."""

    before: FloatArray
    """Last fill before each change."""
    after: FloatArray
    """First fill after it, the next number."""
    sense: IntArray
    holds: BoolArray


def _state(drive: Drive, fill: FloatArray) -> IntArray:
    """Sense, priming and regime in one number."""
    flow = drive.flow(fill, primed=drive.primed)
    sense = np.sign(flow.velocity).astype(np.int64)
    return sense + 1 + 3 * flow.primed.astype(np.int64) + 6 * np.asarray(flow.regime, dtype=np.int64)


def _mapped(drive: Drive, *, most_changes: int) -> _Map:
    """Look along the range, then narrow every change down to neighbouring numbers."""
    x = np.linspace(drive.lowest, drive.highest, FILLS)
    state = _state(drive, x)
    at = np.flatnonzero(np.diff(state))
    before, after, goal = x[at], x[at + 1], x[at + 1]
    found: list[tuple[float, float]] = []
    while before.size:
        if len(found) + before.size > most_changes:
            raise UntabulatedError
        left, right = _narrowed(drive, before, after)
        found += zip(left.tolist(), right.tolist(), strict=True)
        # Another change may lie between the one found and the next point looked at.
        more = _state(drive, right) != _state(drive, goal)
        before, after, goal = right[more], goal[more], goal[more]
    found.sort()
    left, right = np.array(found).reshape(-1, 2).T
    each = _state(drive, np.concatenate([[drive.lowest], right]))
    return _Map(before=left, after=right, sense=each % 3 - 1, holds=each // 3 % 2 > 0)


def _narrowed(drive: Drive, before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    rows = np.arange(before.size)
    while np.any(np.nextafter(before, 1.0) < after):
        x = before[:, None] + (after - before)[:, None] * np.linspace(0.0, 1.0, SECTION)
        x[:, -1] = after
        state = _state(drive, x)
        first = np.argmax(state != state[:, :1], axis=1)
        before, after = np.maximum.accumulate(x, axis=1)[rows, first - 1], x[rows, first]
    return before, after


def _intervals(drive: Drive, found: _Map) -> FloatArray:
    """Lowest and highest fill of each interval, shape (n, 2)."""
    low, high = np.append(drive.lowest, found.after), np.append(found.before, drive.highest)
    return np.stack([low, high], axis=1)


def _path_of_each(senses: IntArray) -> IntArray:
    """Number the runs of neighbouring intervals that flow in one sense."""
    paths, number = np.full(senses.size, -1), -1
    for i, sense in enumerate(senses):
        if sense != 0:
            number += i == 0 or senses[i - 1] != sense
            paths[i] = number
    return paths


def _path(drive: Drive, intervals: FloatArray, senses: IntArray, mine: BoolArray) -> FloatArray:
    """Nodes of one path: time, fill, leaving and arriving dx/dt, shape (4, nodes)."""
    which = np.flatnonzero(mine)
    sense = int(senses[which[0]])
    order = which[::-1] if sense > 0 else which
    ends = [intervals[i][::-1] if sense > 0 else intervals[i] for i in order]
    parts = [_nodes(drive, float(start), float(end), sense) for start, end in ends]
    # The flow ends beyond the last fill that flows, unless that is an end of the range.
    beyond = order[-1] - sense
    if 0 <= beyond < senses.size:
        parts[-1][1, -1] = intervals[beyond][1 if sense > 0 else 0]
    joined, clock = parts[0], 0.0
    for part in parts[1:]:
        clock = joined[0, -1]
        joined[2, -1] = part[2, 0]
        part[0] += clock
        joined = np.concatenate([joined, part[:, 1:]], axis=1)
    return joined


def _nodes(drive: Drive, start: float, end: float, sense: int) -> FloatArray:
    """Pieces between two fills with one regime, x = end + (start - end) z^2, halved until they are right."""
    graded = 2.0 ** -np.arange(5, 5 + _GRADED)
    edges = np.concatenate([np.linspace(1.0, 1 / 16, 16), graded, [0.0]])
    waiting: Sequence[tuple[float, float]] = list(pairwise(edges.tolist()))
    tops, times = [], []
    while waiting:
        top, bottom = np.array(waiting).T
        middle = (top + bottom) / 2
        spent, rate = _durations(drive, (start, end), (top, middle, bottom))
        good = _right(drive, (start, end, sense), (top, middle, bottom), spent, rate)
        for cut, time in ((top, spent[1]), (middle, spent[2])):
            tops += cut[good].tolist()
            times += time[good].tolist()
        halves = ((top[~good], middle[~good]), (middle[~good], bottom[~good]))
        waiting = [pair for a, b in halves for pair in zip(a, b, strict=True)]
        if len(tops) > MOST_PIECES:
            raise UntabulatedError
    order = np.argsort(tops)[::-1]
    z = np.append(np.array(tops)[order], 0.0)
    x = end + (start - end) * z**2
    slope = _slope(drive, x, sense)
    time = np.concatenate([[0.0], np.cumsum(_ending(np.array(times)[order], x, slope))])
    return np.stack([time, x, slope, slope])


def _ending(times: FloatArray, x: FloatArray, slope: FloatArray) -> FloatArray:
    """Times of the pieces; what is left at a stall ends like a parabola at the latest.

    So near the end neighbouring numbers have the same velocity, next to none, and would never pass.
    """
    left = np.abs(x[:-1] - x[-1]) <= GONE
    flows = left & (slope[:-1] != 0)
    parabola = np.full_like(times, np.inf)
    np.divide(2 * np.abs(np.diff(x)), np.abs(slope[:-1]), out=parabola, where=flows)
    return np.minimum(times, parabola)


def _slope(drive: Drive, fill: FloatArray, sense: int) -> FloatArray:
    """dx/dt, never against the sense."""
    speed = np.maximum(sense * drive.flow(fill, primed=drive.primed).velocity, 0.0)
    return np.asarray(-sense * drive.exchange_rate * speed)


def _durations(
    drive: Drive, ends: tuple[float, float], cuts: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
    """Time over the whole of each piece and over its halves, and the largest |dx/dt| in it."""
    top, middle, bottom = cuts
    spent, rates = [], []
    for a, b in ((top, bottom), (top, middle), (middle, bottom)):
        z = b[:, None] + (a - b)[:, None] * _ABSCISSA
        fill = ends[1] + (ends[0] - ends[1]) * z**2
        speed = np.abs(drive.flow(fill, primed=drive.primed).velocity)
        rate = drive.exchange_rate * np.maximum(speed, np.finfo(np.float64).tiny ** 0.5)
        spent.append((2 * abs(ends[0] - ends[1]) * z / rate) @ _WEIGHT * (a - b))
        rates.append(rate.max(axis=1))
    return (spent[0], spent[1], spent[2]), rates[0]


def _right(
    drive: Drive,
    way: tuple[float, float, int],
    cuts: tuple[FloatArray, FloatArray, FloatArray],
    spent: tuple[FloatArray, FloatArray, FloatArray],
    rate: FloatArray,
) -> BoolArray:
    """Whether times and the cubic piece's middle are right; what is left at a stall always is."""
    start, end, sense = way
    x = [end + (start - end) * z**2 for z in cuts]
    whole, upper, lower = spent
    h = upper + lower
    s = np.divide(upper, h, out=np.zeros_like(h), where=h > 0)
    v0, v1 = (_slope(drive, fill, sense) * h for fill in (x[0], x[2]))
    rise = x[2] - x[0]
    cubic = x[0] + s * (v0 + s * (3 * rise - 2 * v0 - v1 + s * (v0 + v1 - 2 * rise)))
    wrong = np.maximum(np.abs(cubic - x[1]) / PIECE_ERROR, np.abs(whole - h) * rate / GONE)
    return np.asarray((wrong <= 1) | (np.abs(x[0] - end) <= GONE))
