"""What an imported chamber adds to the uncertainties: how well its mesh draws it, and its moment across."""

from __future__ import annotations

import numpy as np

from ringbalance.mesh.cut.faceting import drawing_error
from ringbalance.mesh.geometry import (
    liquid_first_moment,
    moment_across,
    surface_centroid,
    surface_radius,
    wall_square,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc


def drawn_volume(disc: Disc) -> float:
    """Expanded uncertainty (95 %) of a chamber's volume by the facets of its mesh, m^3; 0 for a sector."""
    if disc.geometry is None:
        return 0.0
    return drawing_error(disc.geometry, fill_ratio=np.array([disc.max_fill_ratio])).volume


def drawn_shares(disc: Disc, fills: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same of wall pressure and of moment with lambda, relative. Args: `fills`: x, above zero."""
    if disc.geometry is None:
        return np.zeros(fills.shape), np.zeros(fills.shape)
    found, a = drawing_error(disc.geometry, fill_ratio=fills), surface_radius(disc=disc, fill_ratio=fills)
    moment = disc.axial_width * liquid_first_moment(disc=disc, surface_radius=a)
    centroid = surface_centroid(disc=disc, radius=a)
    return (
        np.asarray(found.wall_square / wall_square(disc=disc, surface_radius=a)),
        np.maximum(found.moment / moment, found.centroid / centroid),
    )


def share_across(disc: Disc, fills: FloatArray) -> FloatArray:
    """Moment across the chamber's middle over that along it: tangent of the angle between both.

    Args: `fills`: x, above zero.
    """
    a = surface_radius(disc=disc, fill_ratio=fills)
    along = liquid_first_moment(disc=disc, surface_radius=a)
    return np.asarray(moment_across(disc=disc, surface_radius=a) / along, dtype=np.float64)
