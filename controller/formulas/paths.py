"""Paths of a flow, x(t): a cubic between two nodes, in both directions, and the parabola of a linear law."""

from __future__ import annotations

import math
from typing import Final, TypeVar

from ringbalance.scene.arrays import FloatArray

Number = TypeVar("Number", float, FloatArray)

_MOST_NEWTON: Final = 60
_CLOSE: Final = 1e-15
"""Step of Newton's method, as a part of a piece, that ends it."""


def piece_rise(part: Number, rise: Number, d0: Number, d1: Number) -> Number:
    """Change of x after a part of a piece's time; `d0` and `d1` are dx/dt at its ends times its duration."""
    return part * (d0 + part * (3.0 * rise - 2.0 * d0 - d1 + part * (d0 + d1 - 2.0 * rise)))


def piece_part(wanted: float, rise: float, d0: float, d1: float) -> float:
    """The part of a piece's time after which x has changed by `wanted`; the inverse of `piece_rise`.

    Newton's method within a shrinking bracket.
    """
    if rise == 0.0:
        return 0.0
    a2, a3 = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
    low, high, s = 0.0, 1.0, min(max(wanted / rise, 0.0), 1.0)
    for _ in range(_MOST_NEWTON):
        excess = s * (d0 + s * (a2 + s * a3)) - wanted
        if excess * rise < 0.0:
            low = s
        else:
            high = s
        slope = d0 + s * (2.0 * a2 + 3.0 * s * a3)
        step = s - excess / slope if slope != 0.0 else -1.0
        before = s
        s = step if low <= step <= high else (low + high) / 2.0
        if abs(s - before) <= _CLOSE:
            break
    return s


def linear_course(
    fill: float,
    squared_per_pressure: float,
    pressure_per_fill: float,
    gas_pressure: float,
    exchange_rate: float,
    total: float,
    lowest: float,
) -> tuple[float, float, float, bool]:
    """Path of a flow whose squared velocity is linear in the fill ratio: a parabola in time.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V; it ends at a velocity of zero or at the lowest fill,
    where D = (S/V) t (u0 + u_end)/2 with u_end^2 = u0^2 - 2 a b D.
    Returns: Initial velocity (m/s, zero where nothing flows), decrease (m/s^2), end (s), whether it stalls.
    """
    squared = squared_per_pressure * (gas_pressure + pressure_per_fill * (2.0 * fill - total))
    slowing = squared_per_pressure * pressure_per_fill * exchange_rate
    if squared <= 0.0 or gas_pressure <= 0.0:
        return 0.0, slowing, 0.0, True
    u0 = math.sqrt(squared)
    distance = (fill - lowest) / exchange_rate
    left = squared - 2.0 * slowing * distance
    if left <= 0.0:
        return u0, slowing, u0 / slowing, True
    return u0, slowing, 2.0 * distance / (u0 + math.sqrt(left)), False
