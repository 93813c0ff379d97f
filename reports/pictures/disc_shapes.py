"""Shapes of the disc for the pictures, in millimetres; the liquid itself comes from the finite elements."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import pyvista as pv

from ringbalance.scene.arrays import FloatArray

_STEPS: Final = 481
_LATTICE: Final = (
    *((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)),
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1), (0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1)),
    *((1, 1, 0), (1, 1, 2), (1, 1, 1)),
)
"""Places of VTK's 27 nodes in a triquadratic hexahedron, in half edges."""


_TETRAHEDRA: Final = (
    *((0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3)),
    *((4, 5, 6, 7), (4, 5, 7, 8), (5, 6, 7, 9), (5, 7, 8, 9)),
)
"""Linear parts of a quadratic tetrahedron, by VTK's numbers of its nodes."""


def split_cells(grid: Any) -> Any:
    """Eight linear cells for each quadratic one, on its nodes: VTK cuts only linear cells well."""
    quadratic = {
        pv.CellType.TRIQUADRATIC_HEXAHEDRON: (pv.CellType.HEXAHEDRON, _hexahedra()),
        pv.CellType.QUADRATIC_TETRA: (pv.CellType.TETRA, np.array(_TETRAHEDRA)),
    }
    kind = next((kind for kind in quadratic if int(kind) in grid.cells_dict), None)
    if kind is None:
        return grid
    linear, local = quadratic[kind]
    cells = grid.cells_dict[int(kind)][:, local].reshape(-1, local.shape[1])
    fine = pv.UnstructuredGrid({linear: cells}, np.asarray(grid.points))
    for name in grid.point_data:
        fine.point_data[name] = grid.point_data[name]
    return fine


def _hexahedra() -> Any:
    """Linear parts of a triquadratic hexahedron, by VTK's numbers of its nodes."""
    index = {place: number for number, place in enumerate(_LATTICE)}
    starts = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    return np.array(
        [[index[(i + a // 2, j + b // 2, k + c // 2)] for a, b, c in _LATTICE[:8]] for i, j, k in starts]
    )


def ring(*, inner: float, outer: float, bottom: float, top: float) -> Any:
    """A closed ring of rectangular section about the shaft.

    Args: `inner`: radius, mm. `outer`: radius, mm. `bottom`: lower axial coordinate, mm. `top`: upper axial
    coordinate, mm.
    """
    angle = np.linspace(0, 2 * np.pi, _STEPS)
    section = np.array([(inner, bottom), (outer, bottom), (outer, top), (inner, top), (inner, bottom)])
    radius, height = section[:, 0], section[:, 1]
    x, y = np.outer(np.cos(angle), radius), np.outer(np.sin(angle), radius)
    grid = pv.StructuredGrid(x[..., None], y[..., None], np.broadcast_to(height, x.shape)[..., None])
    return grid.extract_surface(algorithm="dataset_surface")


def web(
    *, start: float, end: float, half_angle: FloatArray, radius: FloatArray, bottom: float, top: float
) -> Any:
    """The solid between two chambers, its middle along the x axis; turn it into place.

    Args: `start`: radius within the hub, mm. `end`: radius within the wall, mm. `radius`: mm, shape (n,),
    rising. `bottom`: lower axial coordinate, mm. `top`: upper axial coordinate, mm.
    """
    reach = np.linspace(start, end, 41)
    across = np.linspace(-1, 1, 17)
    angle = np.interp(reach, radius, half_angle)[:, None] * across
    x, y = (
        np.repeat((reach[:, None] * part)[..., None], 2, axis=2) for part in (np.cos(angle), np.sin(angle))
    )
    z = np.array(np.broadcast_to([bottom, top], x.shape))
    return pv.StructuredGrid(x, y, z).extract_surface(algorithm="dataset_surface")


def chamber_outline(
    *, inner: float, outer: float, half_thickness: float, half_angle: float, width: float
) -> list[Any]:
    """Edges of a whole chamber, its gas space included.

    Args: `inner`: radius, mm. `outer`: radius, mm. `half_thickness`: strip that a plate takes of each
    chamber, mm. `half_angle`: half of the central angle, rad. `width`: axial, mm.
    """
    ends = (-width / 2, width / 2)
    edges, corners = [], {}
    for radius in (inner, outer):
        reach = half_angle - math.asin(half_thickness / radius)
        angle = np.linspace(-reach, reach, 61)
        circle = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
        corners[radius] = circle[[0, -1]]
        edges += [pv.lines_from_points(np.c_[circle, np.full(61, z)]) for z in ends]
        edges += [pv.Line((*corner, ends[0]), (*corner, ends[1])) for corner in corners[radius]]
    for inward, outward in zip(corners[inner], corners[outer], strict=True):
        edges += [pv.Line((*inward, z), (*outward, z)) for z in ends]
    return edges
