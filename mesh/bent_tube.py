"""A tube's mesh: a plane section of quadratic quadrilaterals, swept along a plane path of lines and arcs.

The section lies in (y, z) with y to the left of the path and z normal to the path's plane; the path starts at
the origin in the direction of x.  Nodes lie on the true surface, mid-nodes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2

from ringbalance.scene.arrays import FloatArray, IntArray

# Corner of the section (0 to 3) and end of the slab for each vertex, in scikit-fem's order.
_HEXAHEDRON = ((2, 1), (2, 0), (1, 1), (3, 1), (1, 0), (3, 0), (0, 1), (0, 0))


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A straight line or an arc of the path, with the cells along it."""

    length: float
    """Along the path, in the section's unit of length."""
    turn: float = 0.0
    """Angle by which the path turns to the left, rad."""
    cells: int = 4
    ratio: float = 1.0
    """Last cell over first cell."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SweptTube:
    """A swept mesh with what its structure is good for."""

    mesh: Any
    """`skfem.MeshHex2` with boundaries inlet, outlet and those of the section."""
    section_node: IntArray
    """Node of the section that each node stands on."""
    half_station: IntArray
    """Twice the number of the station that each node stands at; odd half-way between two."""
    arc_length: FloatArray
    """Along the path at every half-station, shape (2 slabs + 1,)."""
    place: FloatArray
    """Point of the path at every half-station, shape (2, 2 slabs + 1)."""
    direction: FloatArray
    """Unit tangent there, the same shape."""


def _stations(*, segments: Sequence[Segment]) -> FloatArray:
    """Arc lengths of all nodes along a path, mid-nodes included. Returns: Shape (2 cells + 1,)."""
    at = [0.0]
    for segment in segments:
        steps = segment.ratio ** (np.linspace(0, 1, segment.cells) if segment.cells > 1 else np.zeros(1))
        ends = at[-1] + segment.length * np.cumsum(steps) / steps.sum()
        middles = (np.concatenate([[at[-1]], ends[:-1]]) + ends) / 2
        at += np.stack([middles, ends], axis=1).ravel().tolist()
    return np.array(at)


def _path_points(*, segments: Sequence[Segment], arc_length: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Points of a path at arc lengths, and its unit tangents there, each of shape (2, n)."""
    s = np.asarray(arc_length, dtype=np.float64)
    place, tangent = np.zeros((2, s.size)), np.zeros((2, s.size))
    start, origin, heading = 0.0, np.zeros(2), 0.0
    for i, segment in enumerate(segments):
        last = i == len(segments) - 1
        inside = (s >= start) if last else (s >= start) & (s < start + segment.length)
        offset, angle = _along(segment, heading, s[inside] - start)
        place[:, inside] = origin[:, None] + offset
        tangent[:, inside] = np.stack([np.cos(angle), np.sin(angle)])
        origin = origin + _along(segment, heading, np.array([segment.length]))[0][:, 0]
        start, heading = start + segment.length, heading + segment.turn
    return place, tangent


def _along(segment: Segment, heading: float, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement from the segment's start, and heading."""
    angle = heading + segment.turn * s / segment.length
    # Chord of an arc: s sinc(half the turned angle), in the mean of both headings.
    half = (angle - heading) / 2
    chord = s * np.sinc(half / np.pi)
    return np.stack([chord * np.cos(heading + half), chord * np.sin(heading + half)]), angle


def _straight_section(section: Any) -> FloatArray:
    """Nodes of the section's mesh with straight sides, in the same order."""
    vertices = np.ascontiguousarray(section.doflocs[:, : section.nvertices])
    return np.asarray(MeshQuad2.from_mesh(MeshQuad1(vertices, section.t)).doflocs, dtype=np.float64)


def _prism(section: Any, slabs: int) -> Any:
    """Straight mesh of the section's vertices at z = 0 to the number of slabs."""
    plane = np.asarray(section.doflocs[:, : section.nvertices])
    count = plane.shape[1]
    points = np.concatenate([np.vstack([plane, np.full(count, float(k))]) for k in range(slabs + 1)], axis=1)
    rows = [np.asarray(section.t[corner]) + end * count for corner, end in _HEXAHEDRON]
    cells = np.concatenate([np.stack(rows) + k * count for k in range(slabs)], axis=1)
    return MeshHex2.from_mesh(MeshHex1(points, cells))


def _boundaries(section: Any, prism: Any, slabs: int) -> dict[str, IntArray]:
    """Facets by name: the ends, and what stands on a named side of the section."""
    z = np.asarray(prism.p[2][prism.facets]).mean(axis=0)
    named = {"inlet": np.flatnonzero(z < 0.25), "outlet": np.flatnonzero(z > slabs - 0.25)}
    number = np.asarray(prism.facets) % section.nvertices
    pairs = np.sort(number, axis=0)[[0, -1]]
    upright = np.flatnonzero(np.abs(z % 1 - 0.5) < 0.25)
    keys = pairs[0, upright] * section.nvertices + pairs[1, upright]
    for name, facets in section.boundaries.items():
        low, high = np.sort(section.facets[:, facets], axis=0)
        named[name] = upright[np.isin(keys, low * section.nvertices + high)]
    return {name: np.asarray(found, dtype=np.int64) for name, found in named.items()}


def swept_tube(*, section: Any, segments: Sequence[Segment]) -> SweptTube:
    """Mesh of a tube along a path.

    Args: `section`: `skfem.MeshQuad2` in (y, z) with named boundaries.
    Returns: The mesh and its structure.
    Raises: ValueError: no segments, a length or a number of cells that is not positive, or an arc so tight
        that the section would reach its centre.
    """
    reach = float(np.abs(section.doflocs[0]).max())
    if not segments or any(s.length <= 0.0 or s.cells < 1 or s.ratio <= 0.0 for s in segments):
        raise ValueError("a path needs segments of positive length, cells and ratio")
    if any(abs(s.turn) * reach >= s.length for s in segments):
        raise ValueError("a bend is too tight: its radius must exceed half the bore")
    at = _stations(segments=segments)
    slabs = (at.size - 1) // 2
    prism = _prism(section, slabs)
    half = np.rint(2 * prism.doflocs[2]).astype(np.int64)
    # Upright facets between two layers stand at odd half-stations on nodes of the plane section.
    gap, node = cKDTree(_straight_section(section).T).query(np.asarray(prism.doflocs[:2]).T)
    if gap.max() > 1e-9:
        raise ValueError("the section's nodes were not found again: it must be a mesh of quadrilaterals")
    place, direction = _path_points(segments=segments, arc_length=at)
    y, z = np.asarray(section.doflocs)[:, node]
    left = np.stack([-direction[1], direction[0]])
    points = np.vstack([place[:, half] + y * left[:, half], z])
    mesh = MeshHex2(np.ascontiguousarray(points), prism.t)
    return SweptTube(
        mesh=mesh.with_boundaries(_boundaries(section, prism, slabs)),
        section_node=np.asarray(node, dtype=np.int64),
        half_station=half,
        arc_length=at,
        place=place,
        direction=direction,
    )
