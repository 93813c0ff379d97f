"""A chamber with one of its dimensions changed, as an uncertain dimension of a mesh is understood."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.scene.chamber_file.record import ChamberGeometry, Stretch

STRETCHED: Final = ("outer_radius", "inner_radius", "axial_width", "central_angle")
"""Keys of [disc] that can be changed on a mesh."""


def stretched(
    geometry: ChamberGeometry, *, dimensions: Mapping[str, float], quantity: str, value: float
) -> ChamberGeometry:
    """The mesh stretched along the radius, the angle or the shaft until one dimension has another value.

    A radius r becomes R1 + (r - R1) (R2' - R1) / (R2 - R1), so that the other radius stays; angles and
    heights are multiplied.
    Args: `dimensions`: of the mesh as it is, SI, by key of `STRETCHED`. `value`: SI.
    Range: small changes; a fillet or a gas tube is stretched with the rest.
    """
    x, y, z = geometry.points.T
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    inner, outer = dimensions["inner_radius"], dimensions["outer_radius"]
    new_inner = value if quantity == "inner_radius" else inner
    new_outer = value if quantity == "outer_radius" else outer
    radius = new_inner + (radius - inner) * (new_outer - new_inner) / (outer - inner)
    factor = value / dimensions[quantity]
    angle = angle * (factor if quantity == "central_angle" else 1.0)
    z = z * (factor if quantity == "axial_width" else 1.0)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    points.flags.writeable = False
    digest = hashlib.sha256(f"{geometry.digest} {quantity} {value!r}".encode()).hexdigest()
    first = geometry.stretch or Stretch(base=geometry, before=dimensions, after=dimensions)
    stretch = replace(first, after={**dimensions, quantity: value})
    return replace(geometry, points=points, digest=digest, stretch=stretch)
