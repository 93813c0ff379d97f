"""One piece of a flow's path: x(t) as a cubic between two nodes, in both directions."""

from __future__ import annotations

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
