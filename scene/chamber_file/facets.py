"""The facets that bound a mesh."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.arrays import BoolArray, IntArray
from ringbalance.scene.chamber_file.elements import faces
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry


def corners_of(kind: CellKind) -> int:
    """Of one facet."""
    return 3 if kind.startswith("tetra") else 4


def boundary_facets(geometry: ChamberGeometry) -> IntArray:
    """Facets that belong to one cell only, shape (facets, nodes of a facet); their normals point outward."""
    local = np.array(faces(geometry.kind))
    facets = geometry.cells[:, local].reshape(-1, local.shape[1])
    alone = facets[_alone(np.sort(facets[:, : corners_of(geometry.kind)], axis=1))]
    return np.asarray(alone, dtype=np.int64)


def _alone(keys: IntArray) -> BoolArray:
    """Which rows have no equal."""
    order = np.lexsort(keys.T)
    same = np.all(keys[order][1:] == keys[order][:-1], axis=1)
    paired = np.zeros(len(keys), dtype=np.bool_)
    paired[order[1:]] |= same
    paired[order[:-1]] |= same
    return ~paired
