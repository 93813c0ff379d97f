"""Pressure from velocity, and slopes: what an accelerating column needs of the law beyond a query.

Plain arithmetic, interpreted and compiled from one source, on the numbers `c` and pieces `p` of `point`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

from ringbalance.reduced_model.pieces.point import (
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
    LEVEL_SCALE,
    PLACES,
    SCALE,
    SLOWEST,
    Law,
    Pieces,
    piece,
    quintic,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.both_ways import both_ways

_NEWTON_STEPS: Final = 60
"""Largest number of steps; a step that leaves the bracket of the root is replaced by a bisection."""
_CONVERGED: Final = 1e-6
"""Newton step, over the length of a piece, after which the next one would be near round-off."""
ROOT_CELLS: Final = 512
ROOT_HEAD: Final = 4
"""Numbers that stand before the cells."""
ROOT_PLACES: Final = ROOT_HEAD + ROOT_CELLS + 1
_EDGE: Final = 1e-12
R0, R1, R2, R3, START = 1, 2, 3, 4, 5
"""In a piece of roots, behind its end: the polynomial, and the root at the start of the piece."""
WIDTH_OF_ROOT: Final = START + 1
Row = Sequence[float] | FloatArray
Filled = list[float] | FloatArray


@both_ways
def growth(p: Pieces, row: int, t: float) -> float:
    """Slope of `point.quintic`."""
    return p[row][C1] + t * (
        2.0 * p[row][C2] + t * (3.0 * p[row][C3] + t * (4.0 * p[row][C4] + t * (5.0 * p[row][C5])))
    )


@both_ways
def level_with_slope(c: Law, p: Pieces, fill: float) -> tuple[float, float]:
    """Hydrostatic pressure of a chamber's liquid, Pa, and its slope; linear beyond the range of fills."""
    x = max(0.0, min(fill, c[LARGEST_FILL]))
    row = int(c[PLACES + int(x * c[LEVEL_SCALE])])
    t = x - p[row][END]
    slope = growth(p, row, t)
    return quintic(p, row, t) + (fill - x) * slope, slope


@both_ways
def velocity_under(c: Law, p: Pieces, way: int, pressure: float) -> float:
    """Velocity, m/s, that a pressure above zero, Pa, drives; as `point.velocity`."""
    if pressure < p[way][SLOWEST]:
        return pressure * p[way][CREEP]
    root = sqrt(sqrt(pressure))
    s = min(sqrt(root), p[way][LAST])
    row = piece(p, int(c[PLACES + int(s * p[way][SCALE] + p[way][CELLS])]), s)
    return root * root * quintic(p, row, s - p[row][END])


@both_ways
def set_roots(c: Law, p: Pieces, way: int, cells: Filled, roots: Sequence[Filled] | FloatArray) -> None:
    """Write the search cells and starting values of `root_of_velocity` on a way.

    Args:
        cells: cells of equal length in the fourth root of the velocity: cells per unit of it, position of
            zero, smallest and largest velocity, then the piece at the start of each cell; shape
            (`ROOT_PLACES`,).
        roots: eighth root of the pressure as a cubic in the fourth root of the velocity, in the rows of `p`,
            from values and slopes at both ends of each piece; shape (rows, `WIDTH_OF_ROOT`).
    """
    s = sqrt(sqrt(sqrt(p[way][SLOWEST])))
    first = int(c[PLACES + int(s * p[way][SCALE] + p[way][CELLS])])
    last = int(c[PLACES + int(p[way][LAST] * p[way][SCALE] + p[way][CELLS])])
    slowest, t = p[way][SLOWEST] * p[way][CREEP], s - p[first][END]
    fourth = sqrt(sqrt(slowest))
    begin, slope = fourth, _root_slope(s, fourth, quintic(p, first, t), growth(p, first, t))
    for row in range(first, last + 1):
        before, start, steep = fourth, s, slope
        s, ratio = p[row][END], p[row][C0]
        fastest = s * s * s * s * ratio
        fourth = sqrt(sqrt(fastest))
        slope = _root_slope(s, fourth, ratio, p[row][C1])
        h, fall = fourth - before, start - s
        roots[row][END], roots[row][START] = fourth, start
        roots[row][R0], roots[row][R1] = s, slope
        roots[row][R2] = (3.0 * fall / h + steep + 2.0 * slope) / h
        roots[row][R3] = (2.0 * fall / h + steep + slope) / (h * h)
        cells[3] = fastest
    length, row = (fourth - begin) / ROOT_CELLS, first
    cells[0], cells[1], cells[2] = 1.0 / length, ROOT_HEAD - begin / length, slowest
    for k in range(ROOT_CELLS + 1):
        # The last edge, and a first edge rounded outwards, belong to the piece next to them.
        while row < last and roots[row][END] < (begin + k * length) * (1.0 - _EDGE):
            row += 1
        cells[ROOT_HEAD + k] = float(row)


@both_ways
def _root_slope(s: float, fourth: float, ratio: float, rise: float) -> float:
    """Slope of the pressure's eighth root over the velocity's fourth one, by the ratio and its slope."""
    return s / fourth / (1.0 + 0.25 * s * rise / ratio)


@both_ways
def root_of_velocity(cells: Row, roots: Pieces, p: Pieces, way: int, velocity: float) -> tuple[float, float]:
    """Eighth root of the pressure that a velocity above zero, m/s, takes, and d(velocity)/d(root).

    Below a table the pressure is proportional to the velocity, above it to its square.
    Args: `cells` of the way and `roots` by the rows of `p`, as `set_roots` writes them.
    """
    if velocity <= cells[2]:
        s = sqrt(sqrt(sqrt(velocity / p[way][CREEP])))
        return s, 8.0 * velocity / s
    if velocity >= cells[3]:
        s = p[way][LAST] * sqrt(sqrt(velocity / cells[3]))
        return s, 4.0 * velocity / s
    fourth = sqrt(sqrt(velocity))
    row = piece(roots, int(cells[int(fourth * cells[0] + cells[1])]), fourth)
    t, end = fourth - roots[row][END], p[row][END]
    near = roots[row][R0] + t * (roots[row][R1] + t * (roots[row][R2] + t * roots[row][R3]))
    return _within(p, row, velocity, near - end, roots[row][START] - end)


@both_ways
def _within(p: Pieces, row: int, velocity: float, t: float, start: float) -> tuple[float, float]:
    """`root_of_velocity` on one piece, from a first guess; distances count from the end of the piece."""
    end = p[row][END]
    low, high = start, 0.0
    tiny, s, slope = -_CONVERGED * start, end, 1.0
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
