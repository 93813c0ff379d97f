"""The liquid of an imported chamber under gravity, at rest in the rotating frame, from its walls alone.

Its free surface is the circle |r + g/omega^2| = b (horizontal shaft) or the paraboloid r^2 = c^2 + 2 G z
(vertical), G = g/omega^2, with b or c from the liquid's volume; walls may run dry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.cut.integrals import COLUMNS, integrals, walls_about
from ringbalance.mesh.cut.table import ChamberTable
from ringbalance.scene.arrays import BoolArray, FloatArray

_CLOSE: Final = 1e-8
"""Of the volume; what is left is put right to first order, but for the slopes by L."""
_STEPS: Final = 12
_WET: Final = 1e-7
"""Of the outer wall, that may look dry by rounding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TiltedLiquid:
    """At each fill and each angle of gravity, shape (n, turn)."""

    wall_square: FloatArray
    """Mean over the outer wall of |r + g/omega^2|^2 - b^2 where it is wet, m^2."""
    surface_square: FloatArray
    """b^2 - G^2 or, half-way along the chamber, c^2: minus 2/omega^2 times the potential of the free surface,
    m^2."""
    moment: FloatArray
    """First moment along x, m^4."""
    centroid: FloatArray
    """dU/dV', mean of x over the surface, each part by how much of the liquid enters there, m."""
    closed: BoolArray
    """Whether the whole outer wall is wet; where it is partly dry without gravity as well, whether the liquid
    is deeper at its deepest than G."""


@lru_cache(maxsize=16)
def tilted_liquid(
    table: ChamberTable, *, length: float, vertical: bool, turn: int, fills: tuple[float, ...]
) -> TiltedLiquid:
    """Integrals over the liquid of given fill ratios, above zero.

    Args: `length`: G, m. `turn`: angles of gravity, equally spaced from along x; one on a vertical shaft.
    """
    fill = np.array(fills)
    if vertical or length == 0:
        at_angles, shift = [_at_angle(table, fill, np.zeros(2), 2 * length)], 0.0
    else:
        angles = 2 * np.pi * np.arange(turn) / turn
        at_angles = [_at_angle(table, fill, -length * np.array([np.cos(p), np.sin(p)]), 0.0) for p in angles]
        shift = length**2
    *columns, level = np.stack(at_angles, axis=-1)
    return TiltedLiquid(
        wall_square=columns[3] / table.wall_area,
        surface_square=level - shift,
        moment=columns[1],
        centroid=columns[COLUMNS + 1] / columns[COLUMNS],
        closed=(columns[COLUMNS + 3] <= -(1 - _WET) * table.wall_area) | _deep(table, fill, length)[:, None],
    )


def _deep(table: ChamberTable, fills: FloatArray, length: float) -> BoolArray:
    """Whether liquid that leaves a part of the outer wall dry without gravity is deeper than G."""
    level = table.level_of(fills * table.volume)
    return np.asarray((level > table.wall_start) & (np.sqrt(table.nodes[-1]) - np.sqrt(level) > length))


def _at_angle(table: ChamberTable, fills: FloatArray, centre: FloatArray, slope: float) -> FloatArray:
    """The eight columns of `integrals` and L, shape (9, n), for one direction of gravity."""
    walls = walls_about(*table.patches, centre=centre, slope=slope)
    wanted = fills * table.volume
    start = table.level_of(wanted)
    _, slopes = table.at(start)
    # To first order the surface turns about its own centroid.
    level = start - 2 * (slopes[1:3] / slopes[0]).T @ centre + centre @ centre
    reach = float(np.ptp(walls.highest)) if walls.highest.size else 0.0
    for _ in range(_STEPS):
        columns = integrals(walls, level)
        excess = columns[0] - wanted
        step = -excess / np.minimum(columns[COLUMNS], -1e-300)
        if np.all(np.abs(excess) <= _CLOSE * table.volume):
            break
        level = level + np.clip(step, -reach, reach)
    columns[:COLUMNS] += step * columns[COLUMNS:]
    return np.append(columns, [level + step], axis=0)
