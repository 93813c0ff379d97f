"""The liquid in an imported chamber: its cells cut along the free surface, with nodes on that surface.

Corners near the surface are first moved onto it where no wall is in the way, which avoids flat cells; every
tetrahedron that the surface still crosses is divided where it crosses the edges.  New mid-nodes come from
the map of the cell that was divided, so curved walls stay as they were; those of the free surface are moved
onto it along the walls that they lie on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.quadratic_tetrahedra import (
    EDGES,
    FACES,
    Tetrahedra,
    compacted,
    derivatives,
    face_nodes,
    lonely,
    lowest_first,
    shapes,
    with_middles,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray

_SNAP: Final = 0.2
"""Share of the shortest edge at a corner up to which the corner is moved onto the surface."""
_ON: Final = 1e-7
"""Distance over the length of an edge at which a corner counts as on the surface."""
_FLAT: Final = 1e-9
"""Squared sine of an angle between normals below which walls at a node count as one plane."""
_FOLDED_RATIO: Final = 0.05
"""Least Jacobian of a cell after moves, over that before."""
_HALVINGS: Final = 6
"""Halvings of a move that folds a cell, before it is given up."""


def _level(places: FloatArray, radius: float) -> FloatArray:
    """Centrifugal potential over omega^2 above that of the surface, m^2: liquid is where it is positive.

    Args: `places`: coordinates, m, shape (..., 3). `radius`: a of the concentric surface, m.
    """
    return np.asarray((places[..., 0] ** 2 + places[..., 1] ** 2 - radius**2) / 2)


def _outward(places: FloatArray) -> FloatArray:
    """Gradient of the level, m, the shape of `places`."""
    return np.asarray(places * np.array([1.0, 1.0, 0.0]))


def liquid_body(body: Tetrahedra, radius: float) -> Tetrahedra:
    """Cut a chamber along a concentric surface: the part outside, with the new boundary `free_surface`.

    Args: `radius`: a, m.
    Raises: ValueError: the surface leaves no liquid, or does not meet the body at all.
    """
    snapped, on = _snapped(body, radius)
    value = np.where(on, 0.0, _level(snapped.nodes, radius))
    sign = np.sign(value)[snapped.cells[:, :4]]
    if not (sign > 0).any():
        raise ValueError("no liquid is left outside the free surface: choose a smaller surface radius")
    if not (sign <= 0).any():
        raise ValueError("the free surface does not meet the chamber: choose a larger surface radius")
    cut = _divided(snapped, radius, value)
    return compacted(_on_surface(cut, radius))


def _tangents(body: Tetrahedra) -> FloatArray:
    """Projectors onto the directions in which each node stays on the planes of its walls, (nodes, 3, 3)."""
    spread = np.zeros((len(body.nodes), 3, 3))
    at = np.concatenate([np.eye(3), (np.eye(3) + np.roll(np.eye(3), 1, axis=1)) / 2])
    for face in range(4):
        cells = body.faces[:, face] >= 0
        nodes = face_nodes(body.cells[cells], face)
        tangent = derivatives(body.nodes[nodes], at)
        normal = np.cross(tangent[..., 0], tangent[..., 1])
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        np.add.at(spread, nodes, normal[..., :, None] * normal[..., None, :])
    squares, axes = np.linalg.eigh(spread)
    free = squares < _FLAT * np.maximum(squares[:, -1:], 1.0)
    return np.asarray(np.einsum("nia,na,nja->nij", axes, free, axes))


def _move(radius: float, places: FloatArray, tangents: FloatArray) -> FloatArray:
    """Step along the walls to the surface, m; zero where no direction along them leads there."""
    direction = np.einsum("nij,nj->ni", tangents, _outward(places))
    square = np.einsum("ni,ni->n", direction, direction)
    full = np.einsum("ni,ni->n", _outward(places), _outward(places))
    usable = square > 0.1 * full
    size = np.where(usable, -_level(places, radius) / np.where(usable, square, 1.0), 0.0)
    return np.asarray(direction * size[:, None])


def _snapped(body: Tetrahedra, radius: float) -> tuple[Tetrahedra, BoolArray]:
    """Body with the corners near the surface moved onto it, and a mask of the nodes on it."""
    tangents, room = _tangents(body), np.full(len(body.nodes), np.inf)
    ends = body.nodes[body.cells[:, EDGES]]
    lengths = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    for end in range(2):
        # The shortest edge at each node; mid-nodes have none.
        np.minimum.at(room, body.cells[:, EDGES[:, end]], lengths)
    corner = np.isfinite(room)
    moved = body.nodes.copy()
    for _ in range(3):
        moved[corner] += _move(radius, moved[corner], tangents[corner])
    shift = moved - body.nodes
    near = np.abs(_level(moved, radius)) < _ON * np.linalg.norm(_outward(moved), axis=1) * room
    taken = corner & near & (np.linalg.norm(shift, axis=1) < _SNAP * np.where(corner, room, 0.0))
    for _ in range(10):
        step = np.where(taken[:, None], shift, 0.0)
        nodes, middle = body.nodes + step, body.cells[:, 4:].ravel()
        # Each mid-node moves by the mean of its edge's ends.
        nodes[middle] = body.nodes[middle] + step[body.cells[:, EDGES]].mean(axis=2).reshape(-1, 3)
        result = replace(body, nodes=nodes)
        folded = _folded(body, result)
        if not taken[body.cells[folded, :4]].any():
            break
        taken[body.cells[folded, :4]] = False
    reach = np.linalg.norm(_outward(result.nodes), axis=1) * np.where(corner, room, 0.0)
    return result, taken | (np.abs(_level(result.nodes, radius)) < _ON * reach)


def _folded(body: Tetrahedra, after: Tetrahedra) -> IntArray:
    """Cells turned inside out, or nearly so, by moves of their nodes."""
    moved = (after.nodes != body.nodes).any(axis=1)
    near = np.flatnonzero(moved[body.cells].any(axis=1))
    was, least = (_jacobians(replace(b, cells=b.cells[near])).min(axis=1) for b in (body, after))
    return np.asarray(near[least < _FOLDED_RATIO * was])


def _jacobians(body: Tetrahedra) -> FloatArray:
    """Determinants of dx/dX at the four corners and in the middle of each cell, shape (cells, 5)."""
    matrix = derivatives(body.nodes[body.cells], np.vstack([np.eye(4), np.full(4, 0.25)]))
    return np.asarray(np.einsum("epi,epi->ep", matrix[..., 0], np.cross(matrix[..., 1], matrix[..., 2])))


@dataclass(frozen=True, kw_only=True)
class _Cuts:
    """Points at which edges cross the surface, for every cell and edge."""

    number: IntArray
    """Number of the new node, shape (cells, 6); -1 where the edge does not cross."""
    share: FloatArray
    """Position along the edge from its first corner, 0 to 1."""
    places: FloatArray
    """Points of the new nodes, m, shape (new, 3)."""


def _cuts(body: Tetrahedra, radius: float, value: FloatArray) -> _Cuts:
    ends = body.cells[:, EDGES]
    crossing = np.sign(value[ends]).prod(axis=2) < 0
    middles = body.cells[:, 4:][crossing]
    crossed, first, inverse = np.unique(middles, return_index=True, return_inverse=True)
    first_end, second_end = ends[crossing][first].T
    curve = body.nodes[np.stack([first_end, second_end, crossed])]
    # Share of each edge at which it crosses, by bisection.
    low, high = np.zeros(curve.shape[1]), np.ones(curve.shape[1])
    start = np.sign(_level(curve[0], radius))
    for _ in range(50):
        share = (low + high) / 2
        before = np.sign(_level(_on_curve(curve, share), radius)) == start
        low, high = np.where(before, share, low), np.where(before, high, share)
    share = (low + high) / 2
    number = np.full(crossing.shape, -1)
    number[crossing] = len(body.nodes) + inverse
    shares = np.zeros(crossing.shape)
    # Neighbours may list an edge's ends the other way round.
    same = ends[crossing][:, 0] == first_end[inverse]
    shares[crossing] = np.where(same, share[inverse], 1 - share[inverse])
    return _Cuts(number=number, share=shares, places=_on_curve(curve, share))


def _on_curve(curve: FloatArray, share: FloatArray) -> FloatArray:
    values = shapes(np.stack([1 - share, share, np.zeros_like(share)], axis=-1))[:, [0, 1, 3]]
    return np.asarray(np.einsum("nk,knx->nx", values, curve))


def _faces_of_part(signs: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Local corners of the part of a tetrahedron that is liquid, and its faces as quadrilaterals.

    A triangle repeats its last corner.
    """
    faces, surface = [], []
    for corners in FACES:
        ring: list[int] = []
        for k in range(3):
            corner, after = int(corners[k]), int(corners[(k + 1) % 3])
            if signs[corner] >= 0:
                ring.append(corner)
            if signs[corner] * signs[after] < 0:
                ring.append(4 + _EDGE_NUMBER[frozenset((corner, after))])
        if len(ring) < 3:
            continue
        faces.append(ring)
        sides = {(ring[k], ring[(k + 1) % len(ring)]) for k in range(len(ring))}
        surface += [(b, a) for a, b in sides if _is_on(signs, a) and _is_on(signs, b)]
    # The sides that the surface has in common with the faces, in a ring.
    chain = dict(surface)
    if len(chain) > 2:
        ring = [next(iter(chain))]
        while chain[ring[-1]] != ring[0]:
            ring.append(chain[ring[-1]])
        faces.append(ring)
    corners = sorted({corner for face in faces for corner in face})
    return np.array(corners), np.array([face + face[-1:] * (4 - len(face)) for face in faces])


def _is_on(signs: tuple[int, ...], corner: int) -> bool:
    return corner > 3 or signs[corner] == 0


_EDGE_NUMBER: Final = {frozenset((int(a), int(b))): k for k, (a, b) in enumerate(EDGES)}


def _divided(body: Tetrahedra, radius: float, value: FloatArray) -> Tetrahedra:
    """Body of the parts of cells outside the surface, with mid-nodes by the map of their cells."""
    cuts = _cuts(body, radius, value)
    signs = np.sign(value)[body.cells[:, :4]].astype(np.int64)
    # Corners 0 to 3 of a cell, then the new nodes on its edges 0 to 5 as 4 to 9.
    numbers = np.concatenate([body.cells[:, :4], cuts.number], axis=1)
    parent_of, barycentric, corner_of = [], [], []
    for pattern in np.unique(signs, axis=0):
        if pattern.max() <= 0:
            continue
        rows = np.flatnonzero((signs == pattern).all(axis=1))
        if pattern.min() >= 0:
            local, cell = np.tile(np.arange(4), (len(rows), 1)), rows
        else:
            used, faces = _faces_of_part(tuple(pattern.tolist()))
            parts = lowest_first(numbers[rows][:, used], np.searchsorted(used, faces))
            parts = parts.reshape(len(rows), -1, 4)
            which, part = np.nonzero(parts[..., 0] >= 0)
            local, cell = used[parts[which, part]], rows[which]
        parent_of.append(cell)
        corner_of.append(np.take_along_axis(numbers[cell], local, axis=1))
        edge = np.maximum(local - 4, 0)
        share = np.take_along_axis(cuts.share[cell], edge, axis=1)[..., None]
        on_edge = (1 - share) * np.eye(4)[EDGES[edge, 0]] + share * np.eye(4)[EDGES[edge, 1]]
        barycentric.append(np.where((local > 3)[..., None], on_edge, np.eye(4)[np.minimum(local, 3)]))
    parent, coordinates = np.concatenate(parent_of), np.concatenate(barycentric)
    values = shapes(coordinates[:, EDGES].mean(axis=2))
    middles = np.einsum("pek,pkx->pex", values, body.nodes[body.cells[parent]], optimize=True)
    points = np.concatenate([body.nodes, cuts.places])
    nodes, cells = with_middles(points, np.concatenate(corner_of), middles)
    # A face of a part lies on that face of the cell on which one coordinate is zero at its three corners.
    lies = (coordinates[:, FACES] == 0).all(axis=2)
    named = np.where(lies, body.faces[parent][:, None, :], -1).max(axis=2)
    free = lonely(cells, len(nodes)) & (named < 0)
    return Tetrahedra(
        nodes=nodes,
        cells=cells,
        faces=np.where(free, len(body.names), named),
        names=(*body.names, FREE_SURFACE),
    )


def _on_surface(body: Tetrahedra, radius: float) -> Tetrahedra:
    """Mid-nodes of the free surface moved onto it along the walls, as far as no cell folds."""
    free = body.names.index(FREE_SURFACE)
    walls = replace(body, faces=np.where(body.faces == free, -1, body.faces))
    surface = np.concatenate(
        [face_nodes(body.cells[body.faces[:, face] == free], face)[:, 3:].ravel() for face in range(4)]
    )
    surface = np.unique(surface)
    tangents, moved = _tangents(walls)[surface], body.nodes.copy()
    for _ in range(3):
        moved[surface] += _move(radius, moved[surface], tangents)
    for attempt in range(10):
        result = replace(body, nodes=moved)
        folded = _folded(body, result)
        if folded.size == 0:
            break
        back = np.unique(body.cells[folded])
        moved[back] = body.nodes[back] + (0.5 if attempt < _HALVINGS else 0.0) * (
            moved[back] - body.nodes[back]
        )
    return result
