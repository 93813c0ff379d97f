"""What an imported chamber adds to the uncertainties: how well its mesh draws it, and its moment across."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ringbalance.mesh.geometry import (
    chamber_volume,
    liquid_first_moment,
    moment_across,
    surface_radius,
    wall_square,
)
from ringbalance.physics import deferred
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Disc

_OUTER_WALL = "outer_wall"


@dataclass(frozen=True, kw_only=True)
class Facets:
    """How far facets are from the smooth walls that they may stand for."""

    volume: float
    """Between all walls and theirs, m^3, as if all were on one side."""
    outer_depth: float
    """Mean over the outer wall, m."""


@lru_cache(maxsize=8)
def facets_of(geometry: ChamberGeometry) -> Facets:
    """Estimate from the angles at which facets meet; edges sharper than a mesh's count as real."""
    space = deferred.TetrahedronSpace(body=deferred.tetrahedra(geometry))
    walls = {name: space.facets(name) for name in space.boundaries}
    return Facets(
        volume=sum(float(wall.weights.sum()) * wall.depth_to_smooth() for wall in walls.values()),
        outer_depth=walls[_OUTER_WALL].depth_to_smooth(),
    )


def drawing_error(disc: Disc, fills: FloatArray) -> tuple[float, FloatArray]:
    """What the mesh's facets leave of smooth walls, relative: of volume, moment and lambda; of wall pressure.

    Returns: A number, and one for each of the fills, which are above zero; zeros for the sector of the keys.
    """
    if disc.geometry is None:
        return 0.0, np.zeros(fills.shape)
    facets = facets_of(disc.geometry)
    drawn = facets.volume / chamber_volume(disc=disc) + facets.outer_depth / disc.inner_radius
    square = wall_square(disc=disc, surface_radius=surface_radius(disc=disc, fill_ratio=fills))
    return drawn, drawn + 2 * disc.outer_radius * facets.outer_depth / square


def share_across(disc: Disc, fills: FloatArray) -> FloatArray:
    """Moment across the chamber's middle over that along it: tangent of the angle between both.

    Args: `fills`: x, above zero.
    """
    a = surface_radius(disc=disc, fill_ratio=fills)
    along = liquid_first_moment(disc=disc, surface_radius=a)
    return np.asarray(moment_across(disc=disc, surface_radius=a) / along, dtype=np.float64)
