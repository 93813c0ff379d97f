"""How the outer wall of an imported chamber lies about the shaft: its axis, and parts that face inward."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.mesh.cut.faceting import normals_at
from ringbalance.mesh.cut.integrals import gauss
from ringbalance.mesh.cut.patches import wall_patches
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry

_ROUND: Final = 1e-4
"""Departure of r^2, over its mean, up to which a wall counts as round about the shaft."""
_BETTER: Final = 0.01
"""Of the departure about the shaft, that is left about an axis of the wall's own."""
_INWARD: Final = -0.05
"""Radial part of a normal below which a wall faces the shaft, and not by rounding."""


def axis_beside_shaft(geometry: ChamberGeometry) -> FloatArray | None:
    """Place of the axis about which the outer wall is round, m, shape (2,), where that is not the shaft.

    Walls that turn about (c_x, c_y) have x^2 + y^2 = 2 c_x x + 2 c_y y + k_0 + k_1 z + k_2 z^2: cylinders and
    cones of any draft.
    Returns: c, by least squares over the wall's nodes; None for a wall that is round about the shaft, or not
        round, or about an axis that it leaves on one side of the shaft, such as that of a bore.
    """
    points = geometry.points[np.unique(geometry.boundaries[OUTER_WALL])]
    square = points[:, 0] ** 2 + points[:, 1] ** 2
    size = float(np.sqrt(square.max()))
    along = points[:, 2:] / size
    about_shaft = np.concatenate([np.ones_like(along), along, along**2], axis=1)
    about_own = np.concatenate([2 * points[:, :2] / size, about_shaft], axis=1)
    found, own = _fitted(about_own, square)
    _, shaft = _fitted(about_shaft, square)
    centre = found[:2] / size
    encloses = found[2] > 0  # k_0 = R^2 - c^2
    beside = shaft > _ROUND and own < _BETTER * shaft
    return np.asarray(centre) if beside and encloses else None


def _fitted(terms: FloatArray, square: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients, and the largest departure over the mean."""
    found = np.linalg.lstsq(terms, square, rcond=None)[0]
    return np.asarray(found, dtype=np.float64), float(np.abs(terms @ found - square).max() / square.mean())


def inward_share(geometry: ChamberGeometry) -> float:
    """Share of the outer wall's area whose normal, out of the chamber, points towards the shaft."""
    patches, outer = wall_patches(geometry)
    places, weights = gauss(3)
    u, v = np.repeat(places, 3), np.tile(places, 3)
    powers = np.einsum("ip,jp->ijp", *(np.stack([np.ones_like(t), t, t**2]) for t in (u, v)))
    at = np.einsum("nijx,ijp->npx", patches[outer], powers)
    normals = normals_at(patches[outer], u, v)
    area = np.linalg.norm(normals, axis=-1)
    radial = (normals[..., :2] * at[..., :2]).sum(axis=-1)
    inward = radial < _INWARD * area * np.linalg.norm(at[..., :2], axis=-1)
    share = area * np.outer(weights, weights).ravel()
    return float(share[inward].sum() / share.sum())
