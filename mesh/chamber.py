"""Structured scikit-fem meshes of the liquid in one chamber, in two and three dimensions.

A node stands at (s, eta, zeta): s from 0 on the free surface to 1 on the outer wall, eta from -1 on the right
plate to 1 on the left one, zeta from 0 at the back to 1 at the front.  Along s the distance measured on a
plate's face, sqrt(r^2 - t^2), grows linearly, so that cells on the straight faces are of equal length and
their geometry is exact there; the angle is eta alpha(r).  Axes: x outward through the middle of the
chamber, y with the rotation, z along the shaft, the chamber between -B/2 and B/2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2

from ringbalance.mesh.geometry import half_angle
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.models import Disc

FREE_SURFACE = "free_surface"
SIDES: Mapping[str, tuple[int, int]] = MappingProxyType(
    {
        FREE_SURFACE: (0, 0),
        OUTER_WALL: (0, -1),
        "plate_right": (1, 0),
        "plate_left": (1, -1),
        "end_back": (2, 0),
        "end_front": (2, -1),
    }
)
"""Boundaries: axis of the grid (radial, angular, axial), and which of its ends; the last two in 3-D only."""
_ORDER = MappingProxyType({2: (1, 0), 3: (0, 1, 2)})
"""Order of the axes for scikit-fem, by dimension: its cells come out right-handed in a VTK file."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ChamberMesh:
    """Structured mesh of the liquid in one chamber, quadratic in pressure and geometry."""

    mesh: Any
    """`skfem.MeshQuad2` or `MeshHex2` in units of `length_scale`, its boundaries named as in `SIDES`."""
    length_scale: float
    """Length of one unit, m: the outer radius."""
    cells: tuple[int, ...]
    """Cells along the radius, the angle and, in three dimensions, the axis."""
    grid: IntArray
    """Node numbers by position in the grid, shape 2 cells + 1 along each axis."""
    surface_radius: FloatArray
    """Radius of the free surface at its nodes, m, the shape of grid[0]."""

    @property
    def dimension(self) -> int:
        """Two for a cross-section (per unit depth), three for the whole chamber."""
        return len(self.cells)

    @property
    def places(self) -> FloatArray:
        """Coordinates of the nodes, m, shape (dimension, nodes)."""
        return np.asarray(self.length_scale * self.mesh.doflocs)

    def quality(self) -> tuple[float, float]:
        """Smallest scaled Jacobian and largest aspect ratio over the nodes of all cells.

        det(J) / prod_b |J_b| with J_b = dx/dX_b: 1 is square, 0 or less is folded; max_b |J_b| / min_b |J_b|.
        Source: the scaled Jacobian of the Verdict library (Knupp et al., SAND2007-1751), at all nodes of a
        cell instead of its corners alone.
        """
        jacobian = np.moveaxis(self.mesh.mapping().DF(self.mesh.elem.doflocs.T), (0, 1), (-2, -1))
        lengths = np.linalg.norm(jacobian, axis=-2)
        scaled = np.linalg.det(jacobian / lengths[..., None, :])
        scaled *= np.sign(scaled.sum())  # scikit-fem's hexahedra are left-handed
        return float(scaled.min()), float((lengths.max(axis=-1) / lengths.min(axis=-1)).max())


def default_cells(*, disc: Disc, dimension: int = 2) -> tuple[int, ...]:
    """Numbers of cells that keep pressure and moment within 1e-6: 8 x 24 (x 4) for a chamber of 90 degrees.

    Args: `disc`: the disc; only its central angle counts. `dimension`: 2 or 3.
    Returns: Cells along the radius, the angle and, in three dimensions, the axis; all divisible by four.
    Source: one quadratic cell over an arc of angle h deviates from its circle by R (h/2)^4 / 32.
    """
    angular = 4 * max(2, int(np.ceil(disc.central_angle / (np.pi / 12) - 1e-9)))
    return (8, angular, 4)[:dimension]


def chamber_mesh(
    *, disc: Disc, surface_radius: npt.ArrayLike, cells: tuple[int, ...] | None = None
) -> ChamberMesh:
    """Mesh of the liquid between a free surface, concentric or not, and the walls of one chamber.

    Args:
        surface_radius: a, m: one number, or its values at the surface nodes, shape (2 angular cells + 1, and
            2 axial cells + 1 in three dimensions).
        cells: along the radius, the angle and, for a three-dimensional mesh, the axis; default
            `default_cells` in two dimensions.
    Returns: The mesh; plate_left is the one at the larger angle, end_front the one at B/2.
    Raises: ValueError: cells that are not two or three positive numbers, or a surface that does not lie
        between the plate's edge and the outer radius everywhere.
    """
    counts = tuple(int(n) for n in (cells or default_cells(disc=disc)))
    if len(counts) not in (2, 3) or min(counts) < 1:
        raise ValueError(f"cells must be two or three positive numbers, not {cells}")
    surface = np.array(np.broadcast_to(surface_radius, [2 * n + 1 for n in counts[1:]]), dtype=np.float64)
    if not np.all((surface > max(disc.plate_thickness, 0.0)) & (surface < disc.outer_radius)):
        raise ValueError("surface_radius must lie inside the outer radius and outside the plate's edge")
    unit, steps, grid = _topology(counts)
    # Coordinates of the grid, m: axis, radial, angular and, in three dimensions, axial.
    t, outer = disc.plate_thickness, disc.outer_radius
    lines = np.ix_(*(np.linspace(0.0, 1.0, 2 * n + 1) for n in counts))
    face_inner, face_outer = np.sqrt(surface**2 - t**2), np.sqrt(outer**2 - t**2)
    radius = np.hypot(face_inner + lines[0] * (face_outer - face_inner), t)
    angle = (2 * lines[1] - 1) * half_angle(disc=disc, radius=radius)
    axial = [np.broadcast_to(disc.axial_width * (z - 0.5), radius.shape) for z in lines[2:]]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), *axial])
    nodes = np.stack([each[steps] for each in points]) / outer
    return ChamberMesh(
        mesh=type(unit)(nodes, unit.t, unit.boundaries),
        length_scale=disc.outer_radius,
        cells=counts,
        grid=grid,
        surface_radius=surface,
    )


@lru_cache(maxsize=16)
def _topology(cells: tuple[int, ...]) -> tuple[Any, tuple[IntArray, ...], IntArray]:
    """Mesh of unit cells with named boundaries, grid position of each node, and node numbers on the grid."""
    first, second = (MeshQuad1, MeshQuad2) if len(cells) == 2 else (MeshHex1, MeshHex2)
    order = list(_ORDER[len(cells)])
    flat = first.init_tensor(*(np.arange(cells[axis] + 1.0) for axis in order))
    mesh = second.from_mesh(flat)
    steps = tuple(np.rint(2 * mesh.doflocs[np.argsort(order)]).astype(np.int64))
    grid = np.empty([2 * n + 1 for n in cells], dtype=np.int64)
    grid[steps] = np.arange(grid.size)
    middle = flat.p[:, flat.facets].mean(axis=1)[np.argsort(order)]
    named = {
        name: np.flatnonzero(np.abs(middle[axis] - (0 if end == 0 else cells[axis])) < 0.25).astype(np.int32)
        for name, (axis, end) in SIDES.items()
        if axis < len(cells)
    }
    grid.flags.writeable = False
    return second(mesh.doflocs, mesh.t, named), steps, grid
