"""Quadratic tetrahedra: their shape functions, and the cells of any imported chamber as such tetrahedra.

A hexahedron becomes the six tetrahedra from its corner of lowest number to the three faces that do not have
that corner, each face divided by the diagonal from its own lowest corner: neighbours divide a common face
alike.  Mid-nodes of diagonals lie where the cell's own map puts them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from skfem import MeshTet1, MeshTet2

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import (
    CORNERS,
    between,
    faces,
    key_of,
    reference_nodes,
    repeats,
    shape_values,
)
from ringbalance.scene.chamber_file.record import ChamberGeometry

NAMELESS: Final = "other_walls"
"""Boundary of all faces to which the file gives no name."""
EDGES: Final = np.array(between("tetra10")[4:])
"""Corners of the edges on which nodes 4 to 9 lie: meshio's order."""
_SIDES: Final = np.array(sorted(faces("tetra10"), key=lambda side: -sum(side[:3])))
FACES: Final = _SIDES[:, :3]
"""Corners of the face opposite each corner, seen from outside in the order of a positive cell."""
_HEXAHEDRON_FACES: Final = np.array(faces("hexahedron"))


@dataclass(frozen=True, kw_only=True)
class Tetrahedra:
    """A body of quadratic tetrahedra with named boundaries."""

    nodes: FloatArray
    """Places, m, shape (n, 3)."""
    cells: IntArray
    """Shape (cells, 10), meshio's order."""
    faces: IntArray
    """Number of the boundary that each face of each cell lies on, shape (cells, 4); -1 inside the body."""
    names: tuple[str, ...]
    """Names of the boundaries, by number."""


def face_nodes(cells: IntArray, face: int) -> IntArray:
    """The six nodes of one face of every cell, corners first, then the middles of its sides in turn."""
    return np.asarray(cells[:, _SIDES[face]])


def shapes(barycentric: FloatArray) -> FloatArray:
    """Shape functions of the quadratic simplex, (..., 10) from (..., 4), or (..., 6) from (..., 3)."""
    b = barycentric
    edges = EDGES if b.shape[-1] == 4 else EDGES[:3]
    return np.concatenate([b * (2 * b - 1), 4 * b[..., edges[:, 0]] * b[..., edges[:, 1]]], axis=-1)


def slopes(barycentric: FloatArray) -> FloatArray:
    """Derivatives of the shape functions by all coordinates but the first, (points, functions, dimension).

    Args: `barycentric`: shape (points, dimension + 1).
    """
    points, corners = barycentric.shape
    edges = EDGES if corners == 4 else EDGES[:3]
    full = np.zeros((points, corners + len(edges), corners))
    full[:, np.arange(corners), np.arange(corners)] = 4 * barycentric - 1
    for row, (i, j) in enumerate(edges, start=corners):
        full[:, row, i], full[:, row, j] = 4 * barycentric[:, j], 4 * barycentric[:, i]
    return np.asarray(full[:, :, 1:] - full[:, :, :1])


def derivatives(places: FloatArray, barycentric: FloatArray) -> FloatArray:
    """dx/dX of cells or of facets at points, shape (n, points, 3, dimension).

    Args: `places`: coordinates of their nodes, shape (n, functions, 3). `barycentric`: shape (points,
        dimension + 1).
    """
    local = places - places[:, :1]
    return np.asarray(np.einsum("enx,pna->epxa", local, slopes(barycentric), optimize=True))


def lowest_first(cells: IntArray, faces: IntArray) -> IntArray:
    """Tetrahedra of convex cells: from the corner of lowest number to all faces without it.

    Args:
        cells: global numbers of the corners, shape (cells, corners).
        faces: local numbers of corners, shape (faces, 4), seen from outside in order; a triangle repeats its
            last.
    Returns: Local numbers of corners, shape (cells, faces, 2, 4), with -1 in those that do not exist.
    """
    count = len(cells)
    rows = np.arange(count)[:, None]
    apex = np.argmin(cells, axis=1)
    # Each face begins at its lowest corner; the repeated corner of a triangle leaves one half empty.
    start = np.argmin(cells[:, faces], axis=2)
    turned = np.stack([faces[np.arange(len(faces))[None], (start + k) % 4] for k in range(4)], axis=2)
    halves = np.stack([turned[..., [0, 1, 2]], turned[..., [0, 2, 3]]], axis=2)
    result = np.concatenate([np.broadcast_to(apex[:, None, None, None], (*halves.shape[:3], 1)), halves], 3)
    corners = cells[rows[..., None, None], result]
    same = np.sort(corners, axis=3)
    return np.where((np.diff(same, axis=3) == 0).any(axis=3, keepdims=True), -1, result)


def tetrahedra(geometry: ChamberGeometry) -> Tetrahedra:
    """The cells of a chamber as quadratic tetrahedra; straight edges get a node in their middle."""
    corners = CORNERS[geometry.kind]
    if corners == 4:
        cells = geometry.cells[:, :4]
        if geometry.cells.shape[1] == 10:
            middles = np.asarray(geometry.points[geometry.cells[:, 4:]])
        else:
            middles = np.asarray(geometry.points[geometry.cells[:, EDGES]].mean(axis=2))
    else:
        local = lowest_first(geometry.cells[:, :8], _HEXAHEDRON_FACES).reshape(len(geometry.cells), -1, 4)
        parents, which = np.nonzero(local[..., 0] >= 0)
        local = local[parents, which]
        cells = np.take_along_axis(geometry.cells[parents, :8], local, axis=1)
        middle = reference_nodes("hexahedron")[local][:, EDGES].mean(axis=2)
        middles = np.empty(middle.shape)
        # 27 points at most: corners' means on edges, faces and in the middle of the reference cell.
        codes = (2 * middle @ np.array([9, 3, 1])).astype(np.int64)
        for code, first in zip(*np.unique(codes, return_index=True), strict=True):
            rows = codes == code
            values = shape_values(geometry.kind, middle.reshape(-1, 3)[first])
            parent_nodes = geometry.cells[parents[np.nonzero(rows)[0]]]
            middles[rows] = np.einsum("k,ekx->ex", values, geometry.points[parent_nodes])
    nodes, numbers = with_middles(geometry.points, cells, middles)
    faces = _named_faces(geometry, cells, corners)
    without_name = lonely(numbers, len(nodes)) & (faces < 0)
    faces = np.where(without_name, len(geometry.boundaries), faces)
    names = (*geometry.boundaries, *([NAMELESS] if without_name.any() else []))
    return compacted(Tetrahedra(nodes=nodes, cells=numbers, faces=faces, names=names))


def lonely(cells: IntArray, size: int) -> BoolArray:
    """True for each face that belongs to one cell alone, shape (cells, 4)."""
    return np.asarray(repeats(key_of(cells[:, FACES], size)) == 1)


def with_middles(points: FloatArray, cells: IntArray, middles: FloatArray) -> tuple[FloatArray, IntArray]:
    """Nodes and cells with one mid-node for each edge, at the first position given for the edge."""
    ends = np.sort(cells[:, EDGES], axis=2).astype(np.int64)
    keys = ends[..., 0] * len(points) + ends[..., 1]
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    nodes = np.concatenate([points, middles.reshape(-1, 3)[first]])
    return nodes, np.concatenate([cells, len(points) + inverse.reshape(keys.shape)], axis=1)


def _named_faces(geometry: ChamberGeometry, cells: IntArray, corners: int) -> IntArray:
    """Number of the boundary of each face of each tetrahedron, from sets of corners."""
    triangles, numbers = [], []
    for number, facets in enumerate(geometry.boundaries.values()):
        if corners == 4:
            parts = [facets[:, :3]]
        else:
            # As `lowest_first` divides a face.
            start = np.argmin(facets[:, :4], axis=1)[:, None]
            turned = np.take_along_axis(facets[:, :4], (start + np.arange(4)) % 4, axis=1)
            parts = [turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]]
        triangles += parts
        numbers += [np.full(len(part), number) for part in parts]
    size = len(geometry.points)
    keys = key_of(np.concatenate(triangles), size)
    order = np.argsort(keys)
    cell_keys = key_of(cells[:, FACES], size)
    at = np.minimum(np.searchsorted(keys[order], cell_keys), len(keys) - 1)
    return np.where(keys[order][at] == cell_keys, np.concatenate(numbers)[order][at], -1)


def compacted(body: Tetrahedra) -> Tetrahedra:
    """Body without nodes that no cell has."""
    used, numbers = np.unique(body.cells, return_inverse=True)
    cells = numbers.reshape(body.cells.shape)
    return Tetrahedra(nodes=body.nodes[used], cells=cells, faces=body.faces, names=body.names)


def scikit_fem_mesh(body: Tetrahedra) -> Any:
    """`skfem.MeshTet2` of a body, m, with its boundaries by name."""
    corners, cells = np.unique(body.cells[:, :4], return_inverse=True)
    straight = MeshTet1(
        *(np.ascontiguousarray(each.T) for each in (body.nodes[corners], cells.reshape(-1, 4)))
    )
    places = MeshTet2.from_mesh(straight).doflocs
    # Its nodes are corners, then edges; it numbers a cell's edges as here, its faces in reverse order.
    places[:, corners.size + straight.t2e] = body.nodes[body.cells[:, 4:]].T
    named = {
        name: np.concatenate([straight.t2f[3 - k][body.faces[:, k] == number] for k in range(4)])
        for number, name in enumerate(body.names)
        if (body.faces == number).any()
    }
    return MeshTet2(places, straight.t, named)
