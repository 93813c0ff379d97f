"""The facets of a cell, and those of a mesh that bound it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, IntArray
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry

_Facets = tuple[tuple[int, ...], ...]
_TETRA: Final[_Facets] = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEXAHEDRON: Final[_Facets] = (
    (0, 4, 7, 3),
    (1, 2, 6, 5),
    (0, 1, 5, 4),
    (2, 3, 7, 6),
    (0, 3, 2, 1),
    (4, 5, 6, 7),
)
_TETRA_EDGES: Final = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_HEXAHEDRON_EDGES: Final = (
    *((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)


def _with_edges(facets: _Facets, edges: tuple[tuple[int, int], ...], corners: int) -> _Facets:
    """Each facet's corners, then the nodes in the middle of its edges, in the order of the corners."""
    place = {frozenset(edge): corners + n for n, edge in enumerate(edges)}
    return tuple(
        (*facet, *(place[frozenset(pair)] for pair in zip(facet, (*facet[1:], facet[0]), strict=True)))
        for facet in facets
    )


_HEXAHEDRON20: Final = _with_edges(_HEXAHEDRON, _HEXAHEDRON_EDGES, 8)
CELL_FACETS: Final[Mapping[CellKind, _Facets]] = MappingProxyType(
    {
        "tetra": _TETRA,
        "tetra10": _with_edges(_TETRA, _TETRA_EDGES, 4),
        "hexahedron": _HEXAHEDRON,
        "hexahedron20": _HEXAHEDRON20,
        "hexahedron27": tuple((*facet, 20 + n) for n, facet in enumerate(_HEXAHEDRON20)),
    }
)
"""Nodes of each facet of a cell: its corners, counter-clockwise seen from outside, the middles of its edges,
its own middle; the order of triangles and quadrilaterals in meshio (that of VTK)."""


def corners_of(kind: CellKind) -> int:
    """Of one facet."""
    return 3 if kind.startswith("tetra") else 4


def boundary_facets(geometry: ChamberGeometry) -> IntArray:
    """Facets that belong to one cell only, shape (facets, nodes of a facet); their normals point outward."""
    local = np.array(CELL_FACETS[geometry.kind])
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
