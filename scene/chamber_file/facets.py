"""Facets of cells: which of them bound a mesh, their numbers and their edges."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.arrays import IntArray
from ringbalance.scene.chamber_file.elements import CORNERS, faces
from ringbalance.scene.chamber_file.record import ChamberGeometry

MOST_NODES: Final = 2_000_000
"""Three of their numbers make one of 64 bits."""


def corners_of(kind: str) -> int:
    """Of one facet of a kind of cells."""
    return 3 if CORNERS[kind] == 4 else 4


def boundary_facets(geometry: ChamberGeometry) -> IntArray:
    """Facets that belong to one cell only, shape (facets, nodes of a facet); their normals point outward."""
    facets = sides_of(geometry.cells, geometry.kind)
    keys = key_of(facets[:, : corners_of(geometry.kind)], len(geometry.points))
    return np.asarray(facets[repeats(keys) == 1], dtype=np.int64)


def sides_of(cells: IntArray, kind: str) -> IntArray:
    """All sides of all cells, cell by cell, shape (sides, nodes of a facet)."""
    local = np.array(faces(kind))
    return cells[:, local].reshape(-1, local.shape[1])


def key_of(corners: IntArray, nodes: int) -> IntArray:
    """One number for the corners of each facet, shape (...) from (..., 3 or 4).

    It is made of the three smallest, which two facets of a body share only when they are the same.
    Raises: ValueError: more than `MOST_NODES` nodes.
    """
    if nodes > MOST_NODES:
        raise ValueError(f"a chamber of more than {MOST_NODES:,} nodes is too large: use a coarser mesh")
    ordered = np.sort(corners, axis=-1).astype(np.int64)
    return np.asarray((ordered[..., 0] * nodes + ordered[..., 1]) * nodes + ordered[..., 2])


def repeats(keys: IntArray) -> IntArray:
    """How often each number stands among all, the shape of `keys`."""
    _, place, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(counts[place].reshape(keys.shape))


def edges_of(corners: IntArray) -> IntArray:
    """Ends of the edges around each facet, shape (facets, corners, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1)
