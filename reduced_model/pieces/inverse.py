"""What a column that is accelerated asks of the law beyond a query: pressure from velocity, and slopes.

Plain numbers, interpreted and compiled from one source, of the numbers `c` and pieces `p` of `point`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

import numpy as np

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
from ringbalance.reduced_model.pieces.table import polynomial
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.both_ways import both_ways

_NEWTON_STEPS: Final = 60
"""At the most; each that leaves the interval known to hold the root is replaced by half of that."""
_CONVERGED: Final = 1e-6
"""Of a piece: Newton's next change would be next to round-off."""
ROOT_CELLS: Final = 512
ROOT_HEAD: Final = 4
"""What stands before the cells."""
ROOT_PLACES: Final = ROOT_HEAD + ROOT_CELLS + 1
_EDGE: Final = 1e-12
R0, R1, R2, R3, START = 1, 2, 3, 4, 5
"""In a piece of roots, behind its end: the polynomial, and the root at the start of the piece."""
WIDTH_OF_ROOT: Final = START + 1
Row = Sequence[float] | FloatArray


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
    row = int(c[PLACES + int(x * c[LEVEL_SCALE])])
    t = x - p[row][END]
    slope = growth(p, row, t)
    return quintic(p, row, t) + (fill - x) * slope, slope


@both_ways
def velocity_under(c: Law, p: Pieces, way: int, pressure: float) -> float:
    """As `point.velocity`, m/s; a pressure above zero, Pa."""
    if pressure < p[way][SLOWEST]:
        return pressure * p[way][CREEP]
    root = sqrt(sqrt(pressure))
    s = min(sqrt(root), p[way][LAST])
    row = piece(p, int(c[PLACES + int(s * p[way][SCALE] + p[way][CELLS])]), s)
    return root * root * quintic(p, row, s - p[row][END])


def root_cells(numbers: FloatArray, rows: FloatArray, way: int) -> FloatArray:
    """Where `root_of_velocity` looks: cells of equal length in the fourth root of the velocity.

    Returns: Cells per fourth root, the place of zero, the smallest and the largest velocity, then the piece
        at the start of each cell; shape (`ROOT_PLACES`,).
    """
    first, last = _span(numbers, rows, way)
    ends, slowest = _fourth_roots(rows, first, last), rows[way, SLOWEST] * rows[way, CREEP]
    edges = np.linspace(slowest**0.25, ends[-1], ROOT_CELLS + 1)
    each = ROOT_CELLS / (edges[-1] - edges[0])
    # The last edge, and what rounding brings before the first, belong to the piece beside them.
    found = first + np.minimum(np.searchsorted(ends, edges * (1.0 - _EDGE)), last - first)
    fastest = rows[last, END] ** 4 * rows[last, C0]
    return np.concatenate([[each, ROOT_HEAD - edges[0] * each, slowest, fastest], found])


def root_pieces(numbers: FloatArray, rows: FloatArray, way: int) -> tuple[int, FloatArray]:
    """For each piece of a way the eighth root of the pressure over the fourth root of the velocity.

    Cubic, with the values and slopes at both ends of the piece: next to what `root_of_velocity` looks for.
    Returns: The row of the first piece, and rows, shape (pieces, `WIDTH_OF_ROOT`).
    """
    first, last = _span(numbers, rows, way)
    inside = rows[first : last + 1]
    start = rows[way, SLOWEST] ** 0.125
    s = np.concatenate([[start], inside[:, END]])
    t = start - inside[0, END]
    at_start = quintic(inside, 0, t), growth(inside, 0, t)
    ratio, rise = np.concatenate([[at_start], inside[:, [C0, C1]]]).T
    w = np.concatenate([[s[0] * at_start[0] ** 0.25], _fourth_roots(rows, first, last)])
    slope = s / w / (1.0 + 0.25 * s * rise / ratio)
    h = np.diff(w)
    powers = polynomial(h, (s[:-1], s[1:]), (slope[:-1], slope[1:]))
    return first, np.stack([w[1:], *(each / h**power for power, each in enumerate(powers)), s[:-1]], axis=1)


def _span(numbers: FloatArray, rows: FloatArray, way: int) -> tuple[int, int]:
    """First and last piece of a way."""
    scale, place = rows[way, SCALE], rows[way, CELLS]
    first, last = (
        int(numbers[PLACES + int(s * scale + place)]) for s in (rows[way, SLOWEST] ** 0.125, rows[way, LAST])
    )
    return first, last


def _fourth_roots(rows: FloatArray, first: int, last: int) -> FloatArray:
    """Of the velocities at the ends of pieces."""
    inside = slice(first, last + 1)
    return np.asarray(np.sqrt(np.sqrt(rows[inside, END] ** 4 * rows[inside, C0])))


@both_ways
def root_of_velocity(cells: Row, roots: Pieces, p: Pieces, way: int, velocity: float) -> tuple[float, float]:
    """Eighth root of the pressure that a velocity above zero, m/s, takes, and d(velocity)/d(root).

    Below a table the pressure is proportional to the velocity, above it to its square.
    Args: `cells`: `root_cells` of the way. `roots`: `root_pieces`, by the rows of `p`.
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
    """The same on one piece, from a first place on it; places count from its end."""
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
