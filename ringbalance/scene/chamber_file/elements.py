"""Kinds of cells and facets of a chamber: nodes and faces, in meshio's order.

Each facet and edge gets one number from its corners, so that sorting finds equal ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import product
from types import MappingProxyType
from typing import Final, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry

CELL_KINDS: Final[tuple[CellKind, ...]] = get_args(CellKind)
CORNERS: Final[Mapping[str, int]] = MappingProxyType(
    {
        **dict.fromkeys(("triangle", "triangle6"), 3),
        **dict.fromkeys(("quad", "quad8", "quad9", "tetra", "tetra10"), 4),
        **dict.fromkeys(("hexahedron", "hexahedron20", "hexahedron27"), 8),
    }
)
"""Number of corners by kind of cell or facet, for all kinds that a chamber may have."""
NODES: Final[Mapping[str, int]] = MappingProxyType(
    {kind: int("".join(filter(str.isdigit, kind)) or count) for kind, count in CORNERS.items()}
)
"""Number of nodes by kind; that of a second-order kind is part of its name."""
FACET_KINDS: Final = MappingProxyType({3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 9: "quad9"})
"""Kind of facet by its number of nodes."""
_FACES: Final[Mapping[int, tuple[tuple[int, ...], ...]]] = MappingProxyType(
    {
        4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
        8: ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    }
)
"""Corners of each face by the number of corners of the cell; normals point outward."""
_EDGES: Final = MappingProxyType(
    {
        4: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
        8: (
            *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
            *((0, 4), (1, 5), (2, 6), (3, 7)),
        ),
    }
)
_CORNER_POINTS: Final = MappingProxyType(
    {
        4: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
        8: ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    }
)
MOST_NODES: Final = 2_000_000
"""Largest number of nodes: three node numbers then fit into 64 bits."""


def dimension(kind: str) -> int:
    """Dimension of an element of a kind: 0 for a point to 3 for a cell."""
    lower = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2}
    return next((count for name, count in lower.items() if kind.startswith(name)), 3)


def between(kind: str) -> tuple[tuple[int, ...], ...]:
    """For each node the corners whose midpoint it is on a straight cell; a corner has itself."""
    count = CORNERS[kind]
    inside = (*_EDGES[count], *(_FACES[8] if count == 8 else ()), tuple(range(count)))
    return (*((corner,) for corner in range(count)), *inside)[: NODES[kind]]


@cache
def reference_nodes(kind: str) -> FloatArray:
    """Reference coordinates of a cell's nodes, shape (nodes, 3): the unit tetrahedron or cube."""
    corners = np.array(_CORNER_POINTS[CORNERS[kind]], dtype=np.float64)
    return np.array([corners[list(each)].mean(axis=0) for each in between(kind)])


@cache
def faces(kind: str) -> tuple[tuple[int, ...], ...]:
    """For each face of a cell its nodes in meshio's order: corners, middles of edges, middle of the face."""
    where = {frozenset(corners): node for node, corners in enumerate(between(kind))}
    nodes_of_faces = []
    for face in _FACES[CORNERS[kind]]:
        edges = zip(face, (*face[1:], face[0]), strict=True)
        inside = (*(frozenset(edge) for edge in edges), frozenset(face))
        nodes_of_faces.append((*face, *(where[each] for each in inside if each in where)))
    return tuple(nodes_of_faces)


@cache
def shape_gradients(kind: str) -> FloatArray:
    """Gradients of the shape functions, shape (points, nodes, 3), at points that determine a cell's sign.

    The Jacobian of a straight tetrahedron is constant; elsewhere it is a polynomial, of degree 3 on a
    tetra10 and up to 2 (5) in each coordinate of a hexahedron of first (second) order, and is sampled on a
    lattice with at least as many points in each direction as it has coefficients.
    """
    powers, coefficients = _polynomials(kind)
    steps = {"tetra": 1, "tetra10": 4, "hexahedron": 2}.get(kind, 5)
    lattice = np.array(list(product(range(steps + 1), repeat=3)), dtype=np.float64) / steps
    if kind == "tetra":
        lattice = lattice[:1]
    elif kind == "tetra10":
        lattice = lattice[lattice.sum(axis=1) <= 1 + 1e-9]
    gradients = np.empty((len(lattice), NODES[kind], 3))
    for axis in range(3):
        lower = powers.copy()
        lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
        slopes = powers[:, axis] * np.prod(lattice[:, None, :] ** lower, axis=2)
        gradients[:, :, axis] = slopes @ coefficients
    return gradients


def shape_values(kind: str, point: FloatArray) -> FloatArray:
    """Shape functions of a cell at one point in reference coordinates, shape (nodes,)."""
    powers, coefficients = _polynomials(kind)
    return np.asarray(np.prod(point**powers, axis=1) @ coefficients)


@cache
def _polynomials(kind: str) -> tuple[FloatArray, FloatArray]:
    """Exponents of the monomials, shape (n, 3), and coefficients of the shape functions, shape (n, nodes)."""
    if CORNERS[kind] == 4:
        degree = 1 if kind == "tetra" else 2
        exponents = [each for each in product(range(3), repeat=3) if sum(each) <= degree]
    else:
        highest = 1 if kind == "hexahedron" else 2
        squares = {"hexahedron": 0, "hexahedron20": 1, "hexahedron27": 3}[kind]
        exponents = [each for each in product(range(highest + 1), repeat=3) if each.count(2) <= squares]
    powers = np.array(exponents, dtype=np.float64)
    return powers, np.linalg.inv(np.prod(reference_nodes(kind)[:, None, :] ** powers, axis=2))


def corners_of(kind: str) -> int:
    """Number of corners of one facet of a kind of cells."""
    return 3 if CORNERS[kind] == 4 else 4


def boundary_facets(geometry: ChamberGeometry) -> IntArray:
    """Facets that belong to one cell only, shape (facets, nodes of a facet); their normals point outward."""
    facets = sides_of(geometry.cells, geometry.kind)
    keys = key_of(facets[:, : corners_of(geometry.kind)], len(geometry.points))
    return np.asarray(facets[repeats(keys) == 1], dtype=np.int64)


def key_of(corners: IntArray, nodes: int) -> IntArray:
    """One number for the corners of each facet, shape (...) from (..., 3 or 4).

    The number combines the three smallest node numbers, which two facets share only if they are equal.
    Raises: ValueError: more than `MOST_NODES` nodes.
    """
    if nodes > MOST_NODES:
        raise ValueError(f"a chamber of more than {MOST_NODES:,} nodes is too large: use a coarser mesh")
    ordered = np.sort(corners, axis=-1).astype(np.int64)
    return np.asarray((ordered[..., 0] * nodes + ordered[..., 1]) * nodes + ordered[..., 2])


def repeats(keys: IntArray) -> IntArray:
    """Number of occurrences of each key, in the shape of `keys`."""
    _, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(counts[inverse].reshape(keys.shape))


def edges_of(corners: IntArray) -> IntArray:
    """Ends of the edges around each facet, shape (facets, corners, 2)."""
    return np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1)


def sides_of(cells: IntArray, kind: str) -> IntArray:
    """All sides of all cells, cell by cell, shape (sides, nodes of a facet)."""
    local = np.array(faces(kind))
    return cells[:, local].reshape(-1, local.shape[1])
