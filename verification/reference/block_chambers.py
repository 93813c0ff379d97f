"""Meshes of chambers as a mesh file would give them, with nodes on the true walls."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import half_angle
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import CORNERS, NODES, between, boundary_facets, reference_nodes
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Disc

_PLACES: Final = (2 * reference_nodes("hexahedron27")).astype(np.int64)
"""Of the nodes of a cube, in halves."""
_BOUNDARIES: Final = {
    "inner_wall": (0, 0),
    "outer_wall": (0, 1),
    "plate_right": (1, 0),
    "plate_left": (1, 1),
    "end_back": (2, 0),
    "end_front": (2, 1),
}
_KUHN: Final = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
"""Corners of tetrahedra that fill a cube and fit together from cube to cube."""


def block_chamber(
    cells: tuple[int, int, int],
    place: Callable[[FloatArray], FloatArray],
    *,
    kind: CellKind = "hexahedron27",
) -> ChamberGeometry:
    """A mapped block of hexahedra, or of six tetrahedra in the place of each.

    Args:
        place: from the unit cube, shape (..., 3), to places, m; the first coordinate goes outward.
    """
    shape = tuple(2 * n + 1 for n in cells)
    steps = [np.linspace(0, 1, n) for n in shape]
    points = place(np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(shape)
    starts = np.stack(np.meshgrid(*[2 * np.arange(n) for n in cells], indexing="ij"), axis=-1)
    local = _local(kind)
    at = (starts.reshape(-1, 1, 1, 3) + local).reshape(-1, local.shape[1], 3)
    bare = ChamberGeometry(
        file="block",
        digest=hashlib.sha256(points.tobytes() + f"{cells} {kind}".encode()).hexdigest(),
        kind=kind,
        points=points,
        cells=numbers[at[..., 0], at[..., 1], at[..., 2]],
        boundaries={},
    )
    facets = boundary_facets(bare)
    lattice = np.stack(np.unravel_index(facets, shape), axis=-1)
    boundaries = {
        name: facets[np.all(lattice[..., axis] == end * (shape[axis] - 1), axis=1)]
        for name, (axis, end) in _BOUNDARIES.items()
    }
    return replace(bare, boundaries=boundaries)


def _local(kind: CellKind) -> IntArray:
    """Places of the nodes of each cell in a cube, in halves, shape (cells, nodes, 3)."""
    if CORNERS[kind] == 8:
        return _PLACES[None, : NODES[kind]]
    corners = _PLACES[np.array(_KUHN)]
    return np.stack([corners[:, list(each)].sum(axis=1) // len(each) for each in between(kind)], axis=1)


def disc_chamber(
    disc: Disc, cells: tuple[int, int, int], *, kind: CellKind = "hexahedron27"
) -> ChamberGeometry:
    """The built-in chamber of a disc, plates and all."""
    t = disc.plate_thickness
    faces = [float(np.sqrt(radius**2 - t**2)) for radius in (disc.inner_radius, disc.outer_radius)]

    def place(cube: FloatArray) -> FloatArray:
        # Along a plate's straight face distances grow evenly.
        radius = np.hypot(faces[0] + cube[..., 0] * (faces[1] - faces[0]), t)
        turned = (2 * cube[..., 1] - 1) * half_angle(disc=disc, radius=radius)
        axial = disc.axial_width * (cube[..., 2] - 0.5)
        return np.stack([radius * np.cos(turned), radius * np.sin(turned), axial], axis=-1)

    return block_chamber(cells, place, kind=kind)
