"""Plane sections of an imported chamber: its liquid as a mesh of straight triangles, its walls as outlines.

The liquid's quadratic tetrahedra, each divided into eight straight ones, are cut by a plane across the shaft:
a plane leaves a tetrahedron in a triangle or a quadrilateral, and a named face in a named line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import MeshTri1

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import FACES, face_nodes, tetrahedra
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import boundary_facets, corners_of, edges_of
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry

_PLANE_SHIFT: Final = 1e-4
"""Distance of the plane from the middle, over the chamber's width. A plane through nodes, as in a symmetric
mesh, would lose edges of the surface."""
_EIGHT: Final = np.array(
    [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 5, 6, 8],
        [4, 6, 7, 8],
        [6, 7, 8, 9],
        [5, 6, 8, 9],
    ]
)
"""Straight parts of a quadratic tetrahedron; each of its faces is divided as in `_FOUR`."""
_FOUR: Final = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
_OUTLINE_SHIFT: Final = 1e-7
"""Shift of an outline's plane over the chamber's size, so that the plane meets no node."""


class NoPlaneWavesError(ValueError):
    """A section whose surface is not one line from wall to wall, or that has walls inside."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LiquidSection:
    """Cross-section of the liquid."""

    mesh: Any
    """`skfem.MeshTri1`, lengths over `scale`, with its boundaries by name."""
    scale: float
    """Largest distance of the liquid from the shaft, m."""


def middle_section(
    geometry: ChamberGeometry, *, surface_radius: float, coarse: bool = False
) -> LiquidSection:
    """Section of the liquid outside a concentric surface, half-way along the shaft.

    Args: `surface_radius`: a, m. `coarse`: true for the cells' corners alone, with chords twice as long.
    Raises: ValueError: as `liquid_body`.
    Raises: NoPlaneWavesError: the free surface is not one chain of edges from wall to wall, or a wall is
        closed in itself: stream functions would differ from wall to wall.
    """
    body = liquid_body(tetrahedra(geometry), surface_radius)
    low, high = geometry.points[:, 2].min(), geometry.points[:, 2].max()
    height = body.nodes[:, 2] - (low + high) / 2 - _PLANE_SHIFT * (high - low)
    cells, facets = body.cells[:, :4], body.cells[:, FACES].reshape(-1, 3)
    parts = 1
    if not coarse:
        cells = body.cells[:, _EIGHT].reshape(-1, 4)
        sides = np.stack([face_nodes(body.cells, k) for k in range(4)], axis=1)
        facets, parts = sides[:, :, _FOUR].reshape(-1, 3), len(_FOUR)
    names = np.repeat(body.faces.ravel(), parts)
    triangles, _ = _crossings(cells, height > 0)
    lines, cut = _crossings(facets[names >= 0], height > 0)
    ends = np.sort(np.concatenate([triangles.reshape(-1, 2), lines.reshape(-1, 2)]), axis=1)
    edges, numbers = np.unique(ends, axis=0, return_inverse=True)
    share = (height[edges[:, 0]] / (height[edges[:, 0]] - height[edges[:, 1]]))[:, None]
    points = ((1 - share) * body.nodes[edges[:, 0]] + share * body.nodes[edges[:, 1]])[:, :2]
    scale = float(np.hypot(*points.T).max())
    corners, pairs = np.split(numbers.ravel(), [3 * len(triangles)])
    mesh = MeshTri1(np.ascontiguousarray(points.T / scale), np.ascontiguousarray(corners.reshape(-1, 3).T))
    by_name = {
        name: pairs.reshape(-1, 2)[names[names >= 0][cut] == number] for number, name in enumerate(body.names)
    }
    return LiquidSection(mesh=_with_boundaries(mesh, by_name), scale=scale)


def _crossings(simplices: IntArray, above: BoolArray) -> tuple[IntArray, IntArray]:
    """Edges of tetrahedra or triangles that cross the plane, grouped into triangles or lines.

    Returns: Ends of the edges at the corners of each triangle or line, shape (n, corners, 2); the number of
        the simplex that each lies in.
    """
    # Corners above first: the lone corner is the first or the last one.
    order = np.argsort(~above[simplices], axis=1, kind="stable")
    corners = np.take_along_axis(simplices, order, axis=1)
    count, size = above[simplices].sum(axis=1), simplices.shape[1]
    cases = {1: [[(0, k) for k in range(1, size)]], size - 1: [[(k, size - 1) for k in range(size - 1)]]}
    if size == 4:
        cases[2] = [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]]
    parts, which = [], []
    for number, pieces in cases.items():
        cells = np.flatnonzero(count == number)
        parts += [corners[cells][:, piece] for piece in pieces]
        which += [cells] * len(pieces)
    return np.concatenate(parts), np.concatenate(which)


def _with_boundaries(mesh: Any, by_name: dict[str, IntArray]) -> Any:
    """The mesh with facets named by their ends. Raises: NoPlaneWavesError."""
    size = mesh.p.shape[1]
    keys = mesh.facets[0].astype(np.int64) * size + mesh.facets[1]
    order = np.argsort(keys)

    def facets(pairs: IntArray) -> IntArray:
        low, high = np.sort(pairs.astype(np.int64), axis=1).T
        return np.asarray(order[np.searchsorted(keys[order], low * size + high)], dtype=np.int32)

    named = {name: facets(pairs) for name, pairs in by_name.items() if len(pairs)}
    rim = mesh.boundary_facets()
    named_facets = np.sort(np.concatenate(list(named.values()))) if named else np.empty(0)
    surface = (
        mesh.facets[:, named[FREE_SURFACE]] if FREE_SURFACE in named else np.empty((2, 0), dtype=np.int64)
    )
    ends = np.bincount(surface.ravel(), minlength=1)
    if not (
        np.array_equal(named_facets, np.sort(rim))
        and _pieces(mesh.facets[:, rim]) == 1 == _pieces(surface)
        and (ends == 1).sum() == 2
        and ends.max() == 2
        and OUTER_WALL in named
    ):
        raise NoPlaneWavesError(
            "in the chamber's middle the free surface is not one line from wall to wall, or a wall stands "
            "alone in the liquid: no plane waves are solved there"
        )
    return mesh.with_boundaries(named)


def _pieces(lines: IntArray) -> int:
    """Number of connected parts."""
    nodes, ends = np.unique(lines, return_inverse=True)
    first, second = ends.reshape(lines.shape)
    graph = coo_array((np.ones(first.size), (first, second)), shape=(nodes.size, nodes.size))
    return int(connected_components(graph, directed=False, return_labels=False))


def _wall_pieces(geometry: ChamberGeometry) -> tuple[IntArray, ...]:
    """Straight-edged pieces of the facets that bound the chamber, on all of their nodes.

    Returns: Nodes in order around each piece, one array for each number of corners.
    """
    facets, corners = boundary_facets(geometry), corners_of(geometry.kind)
    ends, middles, centre = np.split(facets, [corners, 2 * corners], axis=1)
    if not middles.size:
        return (facets,)
    if centre.size:
        around = [[ends[:, n], middles[:, n], centre[:, 0], middles[:, n - 1]] for n in range(corners)]
        return (np.stack(around).transpose(0, 2, 1).reshape(-1, 4),)
    tips = [[ends[:, n], middles[:, n], middles[:, n - 1]] for n in range(corners)]
    return np.stack(tips).transpose(0, 2, 1).reshape(-1, 3), middles


def outlines(geometry: ChamberGeometry, *, axis: int, offset: float = 0.0) -> tuple[FloatArray, ...]:
    """Closed outlines of the chamber in a plane.

    Args: `axis`: normal of the plane, 0 to 2. `offset`: of the plane along it, m.
    Returns: For each outline its corners in order, m, on the two other axes, shape (n, 2); straight from one
        edge of a facet's piece to the next.
    """
    points = geometry.points
    height = points[:, axis] - offset - _OUTLINE_SHIFT * float(np.ptp(points[:, axis]))
    crossing = []
    for pieces in _wall_pieces(geometry):
        # Edges from one side of the plane to the other, piece by piece, their nodes in rising order.
        ends = edges_of(pieces)
        piece, edge = np.nonzero(height[ends[..., 0]] * height[ends[..., 1]] < 0)
        crossing.append(np.sort(ends[piece, edge], axis=1))
    crossed = np.concatenate(crossing)
    edges, number = np.unique(crossed, axis=0, return_inverse=True)
    low, high = height[edges].T
    share = (low / (low - high))[:, None]
    corners = (1 - share) * points[edges[:, 0]] + share * points[edges[:, 1]]
    # A plane leaves a piece by one edge for each that it enters by: each edge has two neighbours.
    neighbours: dict[int, list[int]] = {}
    for first, second in number.reshape(-1, 2).tolist():
        neighbours.setdefault(first, []).append(second)
        neighbours.setdefault(second, []).append(first)
    loops = []
    while neighbours:
        start, (following, _) = next(iter(neighbours.items()))
        loop = [start]
        while following != start:
            before = loop[-1]
            loop.append(following)
            first, second = neighbours.pop(following)
            following = second if first == before else first
        del neighbours[start]
        loops.append(np.asarray(np.delete(corners[loop], axis, axis=1)))
    return tuple(loops)
