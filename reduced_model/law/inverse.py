"""What a column that is accelerated asks of the law beyond a query: pressure from velocity, and slopes.

Plain numbers, interpreted and compiled from one source, of the numbers `c` and pieces `p` of `point`.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from ringbalance.reduced_model.law.point import (
    C0,
    C1,
    C2,
    C3,
    C4,
    C5,
    CELLS,
    CREEP,
    END,
    LARGEST_FILL,
    LAST,
    LEVEL_CELLS,
    LEVEL_SCALE,
    SCALE,
    SLOWEST,
    Law,
    Pieces,
    piece,
    quintic,
)
from ringbalance.scene.platform.both_ways import both_ways

_NEWTON_STEPS: Final = 60
"""At the most; each that leaves the interval known to hold the root is replaced by half of that."""
_CONVERGED: Final = 1e-9
"""Of a piece: Newton's next change would be below round-off."""


@both_ways
def growth(p: Pieces, row: int, t: float) -> float:
    """Slope of `point.quintic`."""
    return p[row][C1] + t * (
        2.0 * p[row][C2] + t * (3.0 * p[row][C3] + t * (4.0 * p[row][C4] + t * (5.0 * p[row][C5])))
    )


@both_ways
def level_with_slope(c: Law, p: Pieces, fill: float) -> tuple[float, float]:
    """Hydrostatic pressure of a chamber's liquid, Pa, and its slope; it goes on straight beyond the fills."""
    x = max(0.0, min(fill, c[LARGEST_FILL]))
    row = piece(p, c[int(x * c[LEVEL_SCALE] + c[LEVEL_CELLS])], x)
    t = x - p[row][END]
    slope = growth(p, row, t)
    return quintic(p, row, t) + (fill - x) * slope, slope


@both_ways
def first_piece(c: Law, p: Pieces, way: int, s: float) -> int:
    """Row at which to begin looking for the eighth root of a pressure."""
    return int(c[int(s * p[way][SCALE] + p[way][CELLS])])


@both_ways
def velocity_under(c: Law, p: Pieces, way: int, pressure: float) -> float:
    """As `point.velocity`, m/s; a pressure above zero, Pa."""
    if pressure < p[way][SLOWEST]:
        return pressure * p[way][CREEP]
    root = sqrt(sqrt(pressure))
    s = min(sqrt(root), p[way][LAST])
    row = piece(p, c[int(s * p[way][SCALE] + p[way][CELLS])], s)
    return root * root * quintic(p, row, s - p[row][END])


@both_ways
def root_of_velocity(c: Law, p: Pieces, way: int, velocity: float) -> tuple[float, float]:
    """Eighth root of the pressure that a velocity above zero, m/s, takes, and d(velocity)/d(root).

    Below a table the pressure is proportional to the velocity, above it to its square.
    """
    slowest = p[way][SLOWEST] * p[way][CREEP]
    if velocity <= slowest:
        s = sqrt(sqrt(sqrt(velocity / p[way][CREEP])))
        return s, 8.0 * velocity / s
    start, last = sqrt(sqrt(sqrt(p[way][SLOWEST]))), p[way][LAST]
    low, high = (
        int(c[int(start * p[way][SCALE] + p[way][CELLS])]),
        int(c[int(last * p[way][SCALE] + p[way][CELLS])]),
    )
    first = low
    fastest = last * last * last * last * p[high][C0]
    if velocity >= fastest:
        s = last * sqrt(sqrt(velocity / fastest))
        return s, 4.0 * velocity / s
    while low < high:
        middle = (low + high) // 2
        end = p[middle][END]
        if velocity <= end * end * end * end * p[middle][C0]:
            high = middle
        else:
            low = middle + 1
    if low > first:
        start = p[low - 1][END]
        slowest = start * start * start * start * p[low - 1][C0]
    return _within(p, low, velocity, start, slowest)


@both_ways
def _within(p: Pieces, row: int, velocity: float, start: float, slowest: float) -> tuple[float, float]:
    """The same on one piece, from its start and the velocity there."""
    end = p[row][END]
    fastest = end * end * end * end * p[row][C0]
    low, high = start - end, 0.0
    t = low * (fastest - velocity) / (fastest - slowest)
    tiny, s, slope = _CONVERGED * (end - start), end, 1.0
    for _ in range(_NEWTON_STEPS):
        s = end + t
        ratio = quintic(p, row, t)
        cube = s * s * s
        missing = velocity - cube * s * ratio
        slope = cube * (4.0 * ratio + s * growth(p, row, t))
        if missing > 0.0:
            low = t
        else:
            high = t
        change = missing / slope if slope > 0.0 else end
        if abs(change) < tiny:
            return s + change, slope
        t = t + change
        if not low <= t <= high:
            t = (low + high) / 2.0
    return s, slope
