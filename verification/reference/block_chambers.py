"""Meshes of chambers as a mesh file would give them, with nodes on the true walls."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import half_angle
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.facets import CELL_FACETS
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Disc

_CORNERS: Final = np.array(
    [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]]
)
_EDGES: Final = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
)
_SIDES: Final = np.array([[0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1], [1, 1, 0], [1, 1, 2], [1, 1, 1]])
_PLACES: Final = np.concatenate([_CORNERS, _CORNERS[_EDGES].sum(axis=1) // 2, _SIDES])
_BOUNDARIES: Final = {
    "inner_wall": (0, 0),
    "outer_wall": (0, 1),
    "plate_right": (1, 0),
    "plate_left": (1, 1),
    "end_back": (2, 0),
    "end_front": (2, 1),
}
_KINDS: Final[dict[CellKind, int]] = {"hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}


def block_chamber(
    cells: tuple[int, int, int],
    place: Callable[[FloatArray], FloatArray],
    *,
    kind: CellKind = "hexahedron27",
    closed: bool = False,
) -> ChamberGeometry:
    """A mapped block of hexahedra.

    Args:
        place: from the unit cube, shape (..., 3), to places, m; the first coordinate goes outward.
        closed: whether the second coordinate comes back to where it begins, as in a full ring.
    """
    shape = tuple(2 * n + 1 for n in cells)
    steps = [np.linspace(0, 1, n) for n in shape]
    points = place(np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(shape)
    if closed:
        numbers[:, -1] = numbers[:, 0]
    starts = np.stack(np.meshgrid(*[2 * np.arange(n) for n in cells], indexing="ij"), axis=-1)
    at = starts.reshape(-1, 1, 3) + _PLACES[:, :]
    nodes = numbers[at[..., 0], at[..., 1], at[..., 2]][:, : _KINDS[kind]]
    order = np.stack(np.unravel_index(np.arange(len(nodes)), cells), axis=-1)
    boundaries = {
        name: _side(nodes, order[:, axis] == (cells[axis] - 1) * end, kind, axis, end)
        for name, (axis, end) in _BOUNDARIES.items()
        if not (closed and axis == 1)
    }
    return ChamberGeometry(
        file="block",
        digest=sha256(points.tobytes() + nodes.tobytes()).hexdigest(),
        kind=kind,
        points=points,
        cells=nodes,
        boundaries=boundaries,
    )


def _side(nodes: IntArray, at_side: BoolArray, kind: CellKind, axis: int, end: int) -> IntArray:
    """Facets of the cells at one side of the block."""
    facet = next(f for f in CELL_FACETS[kind] if (_PLACES[list(f[:4]), axis] == 2 * end).all())
    return np.asarray(nodes[at_side][:, list(facet)])


def sector_chamber(
    cells: tuple[int, int, int],
    *,
    radii: tuple[float, float],
    angle: float,
    width: float,
    kind: CellKind = "hexahedron27",
) -> ChamberGeometry:
    """The space between two radii, m, within an angle, rad (2 pi: a full ring), and along a width, m."""

    def place(cube: FloatArray) -> FloatArray:
        radius = radii[0] + (radii[1] - radii[0]) * cube[..., 0]
        turned = angle * (cube[..., 1] - 0.5)
        across = [radius * np.cos(turned), radius * np.sin(turned), width * (cube[..., 2] - 0.5)]
        return np.stack(across, axis=-1)

    return block_chamber(cells, place, kind=kind, closed=angle > 2 * np.pi - 1e-9)


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
