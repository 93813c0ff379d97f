"""Volume, moment and wall pressure of an imported chamber, for every concentric free surface and under
gravity.

**The table** has cubic Hermite pieces over L = a^2, in which a sector is a straight line, with values and
slopes that are exact at the nodes; intervals are halved until the middle of each agrees with the integrals
there.

**Under gravity**, at rest in the rotating frame, the free surface is the circle |r + g/omega^2| = b
(horizontal shaft) or the paraboloid r^2 = c^2 + 2 G z (vertical), G = g/omega^2, with b or c from the
liquid's volume; walls may run dry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline, PPoly

from ringbalance.mesh.wall_integrals import (
    COLUMNS,
    LONGEST_SIDE_RATIO,
    gauss,
    integrals,
    split_patches,
    wall_patches,
    walls_about,
)
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.chamber_file.record import ChamberGeometry, Stretch

TOLERANCE: Final = 1e-9
"""Error of a table between its nodes, over the whole volume and over the whole moment."""
SLOPE_TOLERANCE: Final = 1e-5
"""Error of the free surface's area, of its moment, and of the wet share of the outer wall, over the
largest."""
_FIRST_NODES: Final = 9
_EMPTY: Final = 1 - 4 * float(np.finfo(np.float64).eps)
"""Share of the outermost L that counts as empty: the square of a root falls short of it by rounding."""
_SLIVER: Final = 1e-3
"""Fraction of the volume: nearer to empty or full, the free surface is that at this fraction."""
_SLIVER_FACTOR: Final = 100.0
"""Factor on the tolerance within that fraction: chords of an arc cost most there, and no result needs
them."""
_HALVINGS: Final = 16
"""Rounds of halving: a jump or kink of the area, at a step in the walls, is located to 2e-6 of the range."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ChamberTable:
    """Table of one chamber over L = a^2, a the radius of a concentric surface."""

    geometry: ChamberGeometry
    nodes: FloatArray
    """L, m^2, rising from the innermost to the outermost point of the chamber."""
    columns: FloatArray
    """V, m^3, its moments along x and y, m^4, and the mean of max(r^2 - L, 0) over the outer wall, m^2; then
    their derivatives by L."""
    wall_area: float
    """Area of the outer wall, m^2."""
    wall_start: float
    """Least r^2 on the outer wall, m^2."""
    error: FloatArray
    """Error of values and slopes between two nodes, shape (8, nodes - 1): difference in the middle of the
    interval that was halved last; smooth walls leave a sixteenth of it (slopes: an eighth)."""

    @cached_property
    def patches(self) -> tuple[FloatArray, BoolArray]:
        """The walls, as `wall_patches`, small enough for the integrals."""
        return split_patches(*wall_patches(self.geometry), longest=LONGEST_SIDE_RATIO)

    @property
    def volume(self) -> float:
        """Volume of the whole chamber, m^3."""
        return float(self.columns[0, 0])

    def at(self, levels: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Columns and their derivatives by L, each of shape (4, ...); constant beyond the ends."""
        level = np.asarray(levels, dtype=np.float64)
        held = np.clip(level, self.nodes[0], self.nodes[-1])
        values, slopes = self._pieces(held), self._slopes(held)
        return np.where(held >= self.nodes[-1] * _EMPTY, 0.0, values), np.asarray(slopes)

    @cached_property
    def _pieces(self) -> CubicHermiteSpline:
        return _hermite(self.nodes, self.columns)

    @cached_property
    def _slopes(self) -> PPoly:
        return self._pieces.derivative()

    def at_radius(self, radius: npt.ArrayLike, column: int) -> FloatArray:
        """One column for a concentric surface, the shape of `radius`."""
        return np.asarray(self.at(np.asarray(radius, dtype=np.float64) ** 2)[0][column])

    def surface(self, radius: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Area over a, m, and means of x and y, m, of the free surface of radius a.

        An empty or a full chamber has none; there and nearby, the surface of a nearby fill counts.
        """
        _, slopes = self.at(np.clip(np.asarray(radius, dtype=np.float64) ** 2, *self._ends))
        area, moment_x, moment_y = slopes[:3]
        return np.asarray(-2 * area), np.asarray(moment_x / area), np.asarray(moment_y / area)

    @cached_property
    def _ends(self) -> tuple[float, float]:
        """Least and largest L for which a surface is evaluated."""
        full, empty = self.level_of(self.volume * np.array([1 - _SLIVER, _SLIVER]))
        return float(full), float(empty)

    def level_of(self, volume: npt.ArrayLike) -> FloatArray:
        """L of the surface that leaves a volume (m^3) outside it."""
        wanted = np.clip(np.asarray(volume, dtype=np.float64), 0.0, self.volume)
        falling = -self.columns[0]
        cell = np.clip(np.searchsorted(falling, -wanted) - 1, 0, self.nodes.size - 2)
        low, high = self.nodes[cell].copy(), self.nodes[cell + 1].copy()
        level = (low + high) / 2
        for _ in range(_NEWTON_STEPS):
            values, slopes = self.at(level)
            excess = values[0] - wanted
            low, high = np.where(excess > 0, level, low), np.where(excess > 0, high, level)
            step = level - excess / np.minimum(slopes[0], -1e-300)
            better = np.where((step >= low) & (step <= high), step, (low + high) / 2)
            if np.all(np.abs(better - level) <= _SETTLED * self.nodes[-1]):
                break
            level = better
        level = np.where(wanted <= 0, self.nodes[-1], level)
        return np.where(wanted >= self.volume, self.nodes[0], level)


_NEWTON_STEPS: Final = 60
_SETTLED: Final = 1e-15
"""Newton step over the largest level, a few times the round-off, at which the iteration ends."""


def _hermite(nodes: FloatArray, columns: FloatArray) -> CubicHermiteSpline:
    """Cubic Hermite interpolant. Args: `columns`: values at the nodes, followed by slopes."""
    return CubicHermiteSpline(nodes, *np.split(columns, 2), axis=1)


@lru_cache(maxsize=32)
def chamber_table(geometry: ChamberGeometry) -> ChamberTable:
    """Table of a chamber, computed on first use; that of a stretched mesh follows from its base's table."""
    if geometry.stretch is not None:
        return _stretched(geometry, geometry.stretch)
    patches, outer = split_patches(*wall_patches(geometry), longest=LONGEST_SIDE_RATIO)
    walls = walls_about(patches, outer)
    inner, outermost = _bounds(walls.level)
    wall_area = float(walls.samples[5].sum())
    scale = np.array([1, 1, 1, 1 / wall_area] * 2)[:, None]

    def exact(levels: FloatArray) -> FloatArray:
        return np.asarray(integrals(walls, levels) * scale)

    start = np.linspace(inner, outermost, _FIRST_NODES)
    nodes, columns, error = _refined(start, exact(start), exact)
    columns[:COLUMNS, -1] = 0.0  # no liquid, but for rounding
    return ChamberTable(
        geometry=geometry,
        nodes=nodes,
        columns=columns,
        wall_area=wall_area,
        wall_start=_bounds(walls.level[walls.outer])[0],
        error=error,
    )


def _bounds(level: FloatArray) -> tuple[float, float]:
    """Least and largest r^2, at nine points along each side of a patch, all nodes of the mesh among them.

    Args: `level`: r^2 on the patches, as in `Walls`.
    """
    powers = np.linspace(0, 1, 9)[:, None] ** np.arange(5)
    squares = powers @ level @ powers.T
    return float(squares.min()), float(squares.max())


def _refined(
    nodes: FloatArray, columns: FloatArray, exact: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Refined nodes, columns at the nodes, and differences in the intervals."""
    size, volume = np.abs(columns).max(axis=1), columns[0, 0]
    moment, turning = size[1:3].max(), size[COLUMNS + 1 : COLUMNS + 3].max()
    values = TOLERANCE * np.array([size[0], moment, moment, size[3]])
    slopes = SLOPE_TOLERANCE * np.array([size[4], turning, turning, size[7]])
    allowed = np.concatenate([values, slopes])[:, None]
    error = np.full((len(columns), nodes.size - 1), np.inf)
    for _ in range(_HALVINGS):
        sliver = (columns[0, 1:] > (1 - _SLIVER) * volume) | (columns[0, :-1] < _SLIVER * volume)
        far = error > np.where(sliver, _SLIVER_FACTOR * allowed, allowed)
        far[COLUMNS:, sliver] = False
        cell = np.flatnonzero(np.any(far, axis=0))
        if cell.size == 0:
            break
        middle = (nodes[cell] + nodes[cell + 1]) / 2
        result = exact(middle)
        pieces = _hermite(nodes, columns)
        guess = np.concatenate([pieces(middle), pieces(middle, 1)])
        error[:, cell] = np.abs(result - guess)
        nodes = np.insert(nodes, cell + 1, middle)
        columns = np.insert(columns, cell + 1, result, axis=1)
        error = np.insert(error, cell + 1, error[:, cell], axis=1)
    return nodes, columns, error


def _stretched(geometry: ChamberGeometry, stretch: Stretch) -> ChamberTable:
    """Table of a stretched mesh: r' = R1' + (r - R1) s, angles times k, heights times m.

    The free surface at r goes to r' with k m times its area over r, which is integrated from node to node:
    dV/dL' = k m dV/dL, and the moment's with r'/r and the sine of the turned half-angle as in a sector.
    """
    table = chamber_table(stretch.base)
    before, after = stretch.before, stretch.after
    angle, width = (after[key] / before[key] for key in ("central_angle", "axial_width"))
    pull = (after["outer_radius"] - after["inner_radius"]) / (before["outer_radius"] - before["inner_radius"])

    def moved(level: FloatArray) -> FloatArray:
        return after["inner_radius"] + pull * (np.sqrt(level) - before["inner_radius"])

    def slopes(level: FloatArray) -> FloatArray:
        half = table.surface(np.sqrt(level))[0] / (2 * before["axial_width"])
        turned = np.sin(angle * half) / np.sin(half) * moved(level) / np.sqrt(level)
        ones = np.ones_like(level)
        factors = np.stack([angle * width * ones, width * turned, angle * width * turned, ones])
        return np.asarray(factors * table.at(level)[1])

    nodes, (points, weights) = table.nodes, gauss(4)
    steps = np.diff(nodes)
    within = nodes[:-1, None] + steps[:, None] * points
    rise = 2 * moved(within) * pull / (2 * np.sqrt(within)) * steps[:, None] * weights
    pieces = (slopes(within) * rise).sum(axis=-1)
    values = -np.append(np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1], np.zeros((COLUMNS, 1)), axis=1)
    scale = (after["outer_radius"] / before["outer_radius"]) * angle * width
    return replace(
        table,
        geometry=geometry,
        nodes=moved(nodes) ** 2,
        columns=np.concatenate([values, slopes(nodes)]),
        wall_area=table.wall_area * scale,
        wall_start=float(moved(np.array(table.wall_start)) ** 2),
    )


_VOLUME_ERROR: Final = 1e-8
"""Error of the volume, relative; the rest is corrected to first order, except in the slopes by L."""
_TILTED_STEPS: Final = 12
_DRY_SHARE: Final = 1e-7
"""Share of the outer wall that may look dry by rounding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TiltedLiquid:
    """Integrals at each fill and each angle of gravity, shape (n, turn)."""

    wall_square: FloatArray
    """Mean over the outer wall of |r + g/omega^2|^2 - b^2 where it is wet, m^2."""
    surface_square: FloatArray
    """b^2 - G^2 or, half-way along the chamber, c^2: minus 2/omega^2 times the potential of the free surface,
    m^2."""
    moment: FloatArray
    """First moment along x, m^4; of a sector its cross-section's, m^3."""
    centroid: FloatArray
    """dU/dV', mean of x over the surface, weighted by the liquid that enters at each point, m."""
    closed: BoolArray
    """True where the whole outer wall is wet; if it is partly dry without gravity as well, where the liquid
    at its deepest is deeper than G."""


@lru_cache(maxsize=16)
def tilted_liquid(
    table: ChamberTable, *, length: float, vertical: bool, turn: int, fills: tuple[float, ...]
) -> TiltedLiquid:
    """Integrals over the liquid of given fill ratios, above zero.

    Args: `length`: G, m. `turn`: number of angles of gravity, equally spaced from the x axis; one on a
        vertical shaft.
    """
    fill = np.array(fills)
    if vertical or length == 0:
        at_angles, shift = [_at_angle(table, fill, np.zeros(2), 2 * length)], 0.0
    else:
        angles = 2 * np.pi * np.arange(turn) / turn
        at_angles = [_at_angle(table, fill, -length * np.array([np.cos(p), np.sin(p)]), 0.0) for p in angles]
        shift = length**2
    *columns, level = np.stack(at_angles, axis=-1)
    # Liquid that leaves a part of the outer wall dry without gravity may be deeper than G.
    plain = table.level_of(fill * table.volume)
    deep = (plain > table.wall_start) & (np.sqrt(table.nodes[-1]) - np.sqrt(plain) > length)
    return TiltedLiquid(
        wall_square=columns[3] / table.wall_area,
        surface_square=level - shift,
        moment=columns[1],
        centroid=columns[COLUMNS + 1] / columns[COLUMNS],
        closed=(columns[COLUMNS + 3] <= -(1 - _DRY_SHARE) * table.wall_area) | deep[:, None],
    )


def _at_angle(table: ChamberTable, fills: FloatArray, centre: FloatArray, slope: float) -> FloatArray:
    """The eight columns of `integrals` and L, shape (9, n), for one direction of gravity."""
    walls = walls_about(*table.patches, centre=centre, slope=slope)
    wanted = fills * table.volume
    start = table.level_of(wanted)
    _, slopes = table.at(start)
    # To first order the surface turns about its own centroid.
    level = start - 2 * (slopes[1:3] / slopes[0]).T @ centre + centre @ centre
    reach = float(np.ptp(walls.highest)) if walls.highest.size else 0.0
    for _ in range(_TILTED_STEPS):
        columns = integrals(walls, level)
        excess = columns[0] - wanted
        step = -excess / np.minimum(columns[COLUMNS], -1e-300)
        if np.all(np.abs(excess) <= _VOLUME_ERROR * table.volume):
            break
        level = level + np.clip(step, -reach, reach)
    columns[:COLUMNS] += step * columns[COLUMNS:]
    return np.append(columns, [level + step], axis=0)
