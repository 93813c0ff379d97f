"""Uncertainty that an imported chamber's mesh adds, and its moment across."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.cut.faceting import drawing_error
from ringbalance.mesh.cut.table import chamber_table
from ringbalance.mesh.geometry import liquid_first_moment, moment_across, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc


@dataclass(frozen=True, kw_only=True)
class DrawingShares:
    """Relative expanded uncertainties (95 %) by facets for curved walls, and by integration."""

    volume: float
    wall_pressure: FloatArray
    moment: FloatArray
    """Of the moment or of lambda, whichever is larger."""


def drawing_shares(disc: Disc, fills: FloatArray) -> DrawingShares:
    """Shares at fill ratios above zero; zeros for the sector of the keys."""
    if disc.geometry is None:
        return DrawingShares(volume=0.0, wall_pressure=np.zeros(fills.shape), moment=np.zeros(fills.shape))
    table, error = chamber_table(disc.geometry), drawing_error(disc.geometry, fill_ratio=fills)
    a = np.sqrt(table.level_of(fills * table.volume))
    return DrawingShares(
        volume=error.volume / table.volume,
        wall_pressure=error.wall_square / table.at_radius(a, 3),
        moment=np.maximum(error.moment / table.at_radius(a, 1), error.centroid / table.surface(a)[1]),
    )


def share_across(disc: Disc, fills: FloatArray) -> FloatArray:
    """Moment across the chamber's middle over that along it: tangent of the angle between both.

    Args: `fills`: x, above zero.
    """
    a = surface_radius(disc=disc, fill_ratio=fills)
    along = liquid_first_moment(disc=disc, surface_radius=a)
    return np.asarray(moment_across(disc=disc, surface_radius=a) / along, dtype=np.float64)
