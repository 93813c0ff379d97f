"""One operation of one pair in plain numbers: the closed form, or a walk along a kept path.

`SHARED`'s table holds the flows of `pair_path.FlowPaths` as `flat_paths` lays them out: the number n of
intervals, n - 1 edges, then for each interval its sense, whether the tube holds a column there, and first and
last node of its path (-1: none), then the nodes, each with time, fill, leaving and arriving slope.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.compiled import compiled
from ringbalance.controller.compiled_records import Record

FloatArray = npt.NDArray[np.float64]

MOST_NEWTON: Final = 60
CLOSE: Final = 1e-15
"""Step of Newton's method, as a part of a piece, that ends it."""


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
    """Fill of a driven chamber after a time of gas, by the closed form of `closed_form`.

    Args:
        fill: x at the start.
        time: s.
        squared_per_pressure: a, m^3/kg, of u^2 = a (p + b (x_A - x_C)).
        pressure_per_fill: b, Pa.
        gas_pressure: p, gauge, Pa.
        exchange_rate: S/V, 1/m.
        total: x_A + x_C.
        lowest: smallest x.

    Returns:
        x; the initial one where nothing flows.

    Source: as `closed_form`.
    """
    squared = squared_per_pressure * (gas_pressure + pressure_per_fill * (2.0 * fill - total))
    if squared <= 0.0 or gas_pressure <= 0.0:
        return fill
    u0 = math.sqrt(squared)
    slowing = squared_per_pressure * pressure_per_fill * exchange_rate
    distance = (fill - lowest) / exchange_rate
    left = squared - 2.0 * slowing * distance
    end = u0 / slowing if left <= 0.0 else 2.0 * distance / (u0 + math.sqrt(left))
    if time >= end and left > 0.0:
        return lowest
    flowing = min(time, end)
    return max(fill - exchange_rate * flowing * (u0 - slowing * flowing / 2.0), lowest)


@compiled
def _interval(shared: Record, at: int, fill: float) -> int:
    """Where in the table the interval that holds a fill is described."""
    count = int(shared.table[at])
    low, high = 0, count - 1
    while low < high:
        middle = (low + high) // 2
        if shared.table[at + 1 + middle] <= fill:
            low = middle + 1
        else:
            high = middle
    return at + count + 4 * low


@compiled
def _follow(shared: Record, interval: int, fill: float, time: float) -> float:
    """Fill after a time on the path of an interval."""
    table = shared.table
    first, last, sign = int(table[interval + 2]), int(table[interval + 3]), -table[interval]
    piece = _piece(shared, first + 1, last + 1, sign, sign * fill) - 1
    span = table[piece + 4] - table[piece]
    clock = table[piece] + _part_at(shared, piece, span, fill) * span + time
    if clock >= table[last]:
        return float(table[last + 1])
    piece = _piece(shared, piece, last, 1.0, clock)
    span, x0 = table[piece + 4] - table[piece], table[piece + 1]
    d0, d1, rise = table[piece + 2] * span, table[piece + 7] * span, table[piece + 5] - x0
    s = (clock - table[piece]) / span
    found = float(x0 + s * (d0 + s * (3.0 * rise - 2.0 * d0 - d1 + s * (d0 + d1 - 2.0 * rise))))
    return max(found, fill) if sign > 0.0 else min(found, fill)


@compiled
def _piece(shared: Record, first: int, last: int, sign: float, wanted: float) -> int:
    """The entry, four apart, from which on sign * value is not above what is wanted; never the last."""
    low, high = 0, (last - first) // 4
    while high - low > 1:
        middle = (low + high) // 2
        if sign * shared.table[first + 4 * middle] <= wanted:
            low = middle
        else:
            high = middle
    return first + 4 * low


@compiled
def _part_at(shared: Record, piece: int, span: float, fill: float) -> float:
    """The part of a piece at which x is reached, by Newton's method within a shrinking bracket."""
    table = shared.table
    rise, wanted = float(table[piece + 5] - table[piece + 1]), fill - float(table[piece + 1])
    if rise == 0.0:
        return 0.0
    d0, d1 = float(table[piece + 2] * span), float(table[piece + 7] * span)
    a2, a3 = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
    low, high, s = 0.0, 1.0, min(max(wanted / rise, 0.0), 1.0)
    for _ in range(MOST_NEWTON):
        excess = s * (d0 + s * (a2 + s * a3)) - wanted
        if excess * rise < 0.0:
            low = s
        else:
            high = s
        slope = d0 + s * (2.0 * a2 + 3.0 * s * a3)
        step = s - excess / slope if slope != 0.0 else -1.0
        before = s
        s = step if low <= step <= high else (low + high) / 2.0
        if abs(s - before) <= CLOSE:
            break
    return s


@compiled
def gas_on(shared: Record, fill: float, wet: bool, time: float) -> tuple[float, bool]:
    """Let gas into one chamber.

    Args:
        shared: of type `SHARED`.
        fill: x of the driven chamber.
        wet: whether the tube holds a continuous column beforehand.
        time: s.

    Returns:
        x afterwards, and whether the tube then holds a column.
    """
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
    start = _interval(shared, shared.on if wet else shared.dry, fill)
    if shared.table[start] == 0.0:
        return fill, shared.table[start + 1] > 0.0
    return _flow(shared, shared.on, fill, time)


@compiled
def gas_off(shared: Record, fill: float, time: float) -> tuple[float, bool]:
    """Let a full tube be, with no gas on either side.

    Args:
        shared: of type `SHARED`.
        fill: x of the chamber that was driven last.
        time: s.

    Returns:
        x afterwards, and whether the tube then holds a column.
    """
    if shared.linear:
        return fill, False
    return _flow(shared, shared.off, fill, time)


@compiled
def _flow(shared: Record, at: int, fill: float, time: float) -> tuple[float, bool]:
    interval = _interval(shared, at, fill)
    sense = shared.table[interval]
    if sense == 0.0:
        return fill, shared.table[interval + 1] > 0.0
    after = _follow(shared, interval, fill, time)
    if sense > 0.0 and shared.lowest_empties and after <= shared.lowest:
        return after, False
    if sense < 0.0 and shared.highest_empties and after >= shared.highest:
        return after, False
    return after, shared.table[_interval(shared, at, after) + 1] > 0.0


@compiled
def fills_after(shared: Record, fill: FloatArray, time: FloatArray) -> FloatArray:
    """Fills of driven chambers after times of gas on a full tube.

    Args:
        shared: of type `SHARED`.
        fill: x at the start, shape (n,).
        time: s, shape (n,).

    Returns:
        x, shape (n,).
    """
    found = np.empty(fill.size)
    for i in range(fill.size):
        found[i] = gas_on(shared, fill[i], True, time[i])[0]
    return found
