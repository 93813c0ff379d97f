"""One operation of one pair in plain numbers: the closed form, or a walk along a path in `SHARED`."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.ensemble.compiled_records import DRY, OFF, ON, Record
from ringbalance.controller.formulas.linear_path import linear_course
from ringbalance.controller.formulas.path_piece import piece_part, piece_rise
from ringbalance.scene.arrays import FloatArray

T: Final = 0
"""Column of a node: time."""
X: Final = 1
"""Fill."""
_linear_course: Final = compiled(linear_course)
_piece_part: Final = compiled(piece_part)
_piece_rise: Final = compiled(piece_rise)


@compiled
def linear_fill(
    fill: float,
    time: float,
    squared_per_pressure: float,
    pressure_per_fill: float,
    gas_pressure: float,
    exchange_rate: float,
    total: float,
    lowest: float,
) -> float:
    """Fill of a driven chamber after a time of gas, by `closed_form`, for u^2 = a (p + b (x_A - x_C)), SI."""
    u0, slowing, end, stalls = _linear_course(
        fill, squared_per_pressure, pressure_per_fill, gas_pressure, exchange_rate, total, lowest
    )
    if u0 == 0.0:
        return fill
    if time >= end and not stalls:
        return lowest
    flowing = min(time, end)
    return max(fill - exchange_rate * flowing * (u0 - slowing * flowing / 2.0), lowest)


@compiled
def _interval(shared: Record, flow: int, fill: float) -> int:
    """The interval that holds a fill."""
    low, high = shared.begin[flow], shared.begin[flow + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if shared.edge[middle] <= fill:
            low = middle
        else:
            high = middle - 1
    return int(low)


@compiled
def _follow(shared: Record, interval: int, fill: float, time: float) -> tuple[float, float]:
    """Fill after a time on the path of an interval, and the time left at its end."""
    node, sign = shared.node, -float(shared.sense[interval])
    first, last = shared.first[interval], shared.last[interval]
    piece = _piece(shared, first, last, X, sign, sign * fill)
    span, rise, d0, d1 = _cubic(shared, piece)
    clock = node[piece, T] + _piece_part(fill - node[piece, X], rise, d0, d1) * span + time
    if clock >= node[last, T]:
        return float(node[last, X]), float(clock - node[last, T])
    piece = _piece(shared, piece, last, T, 1.0, clock)
    span, rise, d0, d1 = _cubic(shared, piece)
    after = node[piece, X] + _piece_rise((clock - node[piece, T]) / span, rise, d0, d1)
    return float(max(after, fill) if sign > 0.0 else min(after, fill)), 0.0


@compiled
def _cubic(shared: Record, piece: int) -> tuple[float, float, float, float]:
    """Duration of the piece after a node, its rise, and the slopes at its ends times its duration."""
    node = shared.node
    span = node[piece + 1, T] - node[piece, T]
    return span, node[piece + 1, X] - node[piece, X], node[piece, 2] * span, node[piece + 1, 3] * span


@compiled
def _piece(shared: Record, first: int, last: int, column: int, sign: float, wanted: float) -> int:
    """The node, before the last, from which on sign * value is not above what is wanted."""
    low, high = first, last
    while high - low > 1:
        middle = (low + high) // 2
        if sign * shared.node[middle, column] <= wanted:
            low = middle
        else:
            high = middle
    return int(low)


@compiled
def gas_on(shared: Record, fill: float, wet: bool, time: float) -> tuple[float, bool]:
    """Fill of a driven chamber after a time of gas, s, and whether the tube then holds a column."""
    if shared.linear:
        after = linear_fill(
            fill,
            time,
            shared.squared_per_pressure,
            shared.pressure_per_fill,
            shared.gas_pressure,
            shared.exchange_rate,
            shared.total,
            shared.lowest,
        )
        # Whatever it holds, this law's tube is empty once the gas is off.
        return after, False
    if wet:
        return _flow(shared, ON, fill, time)
    start = _interval(shared, DRY, fill)
    if shared.sense[start] == 0:
        return fill, shared.holds[start] > 0
    if shared.holds[start] > 0:
        return _flow(shared, ON, fill, time)
    # An unprimed tube spills until it is primed.
    after, left = _follow(shared, start, fill, time)
    end = _interval(shared, DRY, after)
    if left > 0.0 and shared.sense[end] != 0 and shared.holds[end] > 0:
        return _flow(shared, ON, after, left)
    return after, False


@compiled
def gas_off(shared: Record, fill: float, time: float) -> tuple[float, bool]:
    """The same for a full tube without gas; `fill` is of the chamber that was driven last."""
    if shared.linear:
        return fill, False
    return _flow(shared, OFF, fill, time)


@compiled
def _flow(shared: Record, flow: int, fill: float, time: float) -> tuple[float, bool]:
    interval = _interval(shared, flow, fill)
    sense = shared.sense[interval]
    if sense == 0:
        return fill, shared.holds[interval] > 0
    after, _ = _follow(shared, interval, fill, time)
    if sense > 0 and shared.lowest_empties and after <= shared.lowest:
        return after, False
    if sense < 0 and shared.highest_empties and after >= shared.highest:
        return after, False
    return after, shared.holds[_interval(shared, flow, after)] > 0


@compiled
def fills_after(shared: Record, fill: FloatArray, time: FloatArray) -> FloatArray:
    """Fills of driven chambers after times of gas, s, on a full tube."""
    found = np.empty(fill.size)
    for i in range(fill.size):
        found[i] = gas_on(shared, fill[i], True, time[i])[0]
    return found
