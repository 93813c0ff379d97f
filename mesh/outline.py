"""Where a plane cuts the walls of an imported chamber: closed outlines for drawings."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import boundary_facets, corners_of, edges_of
from ringbalance.scene.chamber_file.record import ChamberGeometry

_OFF_NODES: Final = 1e-7
"""Of the chamber's size: so far beside its place a plane is laid, where it meets no node."""


def _wall_pieces(geometry: ChamberGeometry) -> tuple[IntArray, ...]:
    """Straight-edged pieces of the facets that bound the chamber, on all of their nodes.

    Returns: Nodes one after the other around each piece, pieces of as many corners together.
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


def outlines(geometry: ChamberGeometry, *, axis: int, place: float = 0.0) -> tuple[FloatArray, ...]:
    """Closed outlines of the chamber in a plane.

    Args: `axis`: to which the plane is normal, 0 to 2. `place`: of the plane on it, m.
    Returns: For each outline its corners in order, m, on the two other axes, shape (n, 2); straight from one
        edge of a facet's piece to the next.
    """
    points = geometry.points
    height = points[:, axis] - place - _OFF_NODES * float(np.ptp(points[:, axis]))
    crossed = np.concatenate([_crossed(piece, height) for piece in _wall_pieces(geometry)])
    edges, number = np.unique(crossed, axis=0, return_inverse=True)
    low, high = height[edges].T
    share = (low / (low - high))[:, None]
    places = (1 - share) * points[edges[:, 0]] + share * points[edges[:, 1]]
    # Two by two: a plane leaves a piece by one edge for each that it enters by.
    loops = _loops(number.reshape(-1, 2))
    return tuple(np.asarray(np.delete(places[loop], axis, axis=1)) for loop in loops)


def _crossed(pieces: IntArray, height: FloatArray) -> IntArray:
    """Edges from one side of the plane to the other, piece by piece, their nodes in rising order."""
    ends = edges_of(pieces)
    piece, edge = np.nonzero(height[ends[..., 0]] * height[ends[..., 1]] < 0)
    return np.sort(ends[piece, edge], axis=1)


def _loops(pairs: IntArray) -> list[list[int]]:
    """Closed chains of numbers, each of which stands in two pairs."""
    neighbours: dict[int, list[int]] = {}
    for one, other in pairs.tolist():
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    loops = []
    while neighbours:
        start, (following, _) = next(iter(neighbours.items()))
        loop = [start]
        while following != start:
            before = loop[-1]
            loop.append(following)
            one, other = neighbours.pop(following)
            following = other if one == before else one
        del neighbours[start]
        loops.append(loop)
    return loops
