"""Uncertainty that an imported chamber's mesh adds, and its moment across its middle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.cut.faceting import drawing_error
from ringbalance.mesh.cut.table import chamber_table
from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc


@dataclass(frozen=True, kw_only=True)
class _DrawingShares:
    """Relative expanded uncertainties (95 %) by facets for curved walls, and by integration."""

    volume: float
    wall_pressure: FloatArray
    moment: FloatArray
    """Of the moment or of lambda, whichever is larger."""


def drawing_shares(disc: Disc, fills: FloatArray) -> _DrawingShares:
    """Shares at fill ratios above zero; zeros for the sector of the keys."""
    if disc.geometry is None:
        return _DrawingShares(volume=0.0, wall_pressure=np.zeros(fills.shape), moment=np.zeros(fills.shape))
    table, error = chamber_table(disc.geometry), drawing_error(disc.geometry, fill_ratio=fills)
    a = np.sqrt(table.level_of(fills * table.volume))
    return _DrawingShares(
        volume=error.volume / table.volume,
        wall_pressure=error.wall_square / table.at_radius(a, 3),
        moment=np.maximum(error.moment / table.at_radius(a, 1), error.centroid / table.surface(a)[1]),
    )


def share_across(disc: Disc, fills: FloatArray) -> FloatArray:
    """Moment across the chamber's middle over that along it, dW/dU, of liquid that moves at a fill ratio.

    That of a pair's moment lies between those of the fills which it moves through.
    Returns: Tangent of the angle between both, the shape of `fills`.
    """
    if disc.geometry is None:
        return np.zeros(fills.shape)
    _, along, across = chamber_table(disc.geometry).surface(surface_radius(disc=disc, fill_ratio=fills))
    return np.asarray(across / along)
