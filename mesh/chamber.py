"""Structured meshes of the liquid in one chamber, of any order, in two and three dimensions.

A node stands at (s, eta, zeta): s from 0 on the free surface to 1 on the outer wall, eta from -1 on the right
plate to 1 on the left one, zeta from 0 at the back to 1 at the front.  Along s the distance measured on a
plate's face, sqrt(r^2 - t^2), grows linearly, so that cells on the straight faces are of equal length and
their geometry is exact there; the angle is eta alpha(r).  Axes: x outward through the middle of the
chamber, y with the rotation, z along the shaft, the chamber between -B/2 and B/2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Literal

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from ringbalance.mesh.geometry import half_angle
from ringbalance.mesh.tensor_cells import contracted, line_shapes, line_stations, stations
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.models import Disc

Geometry = Literal["curved", "straight"]
SurfaceFunction = Callable[[FloatArray, FloatArray], FloatArray]

HIGHEST_ORDER = 16
"""Of the polynomials in a cell; products of distances lose digits beyond."""

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


@dataclass(frozen=True, kw_only=True)
class ChamberMesh:
    """A structured mesh of the liquid in one chamber."""

    nodes: FloatArray
    """Places in units of `length_scale`, shape (dimension, nodes), in the order of `grid`."""
    length_scale: float
    """Length of one unit of `nodes`, m: the outer radius."""
    cells: tuple[int, ...]
    """Cells along the radius, the angle and, in three dimensions, the axis."""
    order: int
    """Of the polynomials along each axis of a cell, in pressure and in geometry."""
    geometry: Geometry
    """Whether nodes within cells lie on the arcs or on straight lines between the corners."""
    grid: IntArray
    """Node numbers by structured place, shape order x cells + 1 along each axis; the last runs fastest."""
    cell_nodes: IntArray
    """Node numbers of each cell, shape (order + 1 along each axis, cells); the last axis runs fastest."""
    surface_radius: FloatArray
    """Radius of the free surface at its nodes, m, the shape of grid[0]."""

    @property
    def dimension(self) -> int:
        """Two for a cross-section (per unit depth), three for the whole chamber."""
        return len(self.cells)

    @property
    def boundaries(self) -> tuple[str, ...]:
        """Names of the sides."""
        return tuple(name for name, (axis, _) in SIDES.items() if axis < self.dimension)

    def quality(self) -> _Quality:
        """Quality of a mesh, judged at the nodes of every cell.

        scaled Jacobian = det(J) / prod_b |J_b| with J_b = dx/dX_b, aspect = max_b |J_b| / min_b |J_b|.
        Source: the scaled Jacobian of the Verdict library (Knupp et al., SAND2007-1751), at all nodes of a
        cell instead of its corners alone.
        """
        _, slopes = line_shapes(stations(self.order), self.order)
        nodes = self.nodes[:, self.cell_nodes]
        columns = [contracted(slopes.T, nodes, 1 + axis) for axis in range(self.dimension)]
        jacobian = np.moveaxis(np.stack(columns), (0, 1), (-1, -2))
        lengths = np.linalg.norm(jacobian, axis=-2)
        return _Quality(
            minimum_scaled_jacobian=float(np.linalg.det(jacobian / lengths[..., None, :]).min()),
            maximum_aspect=float((lengths.max(axis=-1) / lengths.min(axis=-1)).max()),
            cells=self.cell_nodes.shape[-1],
            nodes=self.nodes.shape[1],
        )

    @property
    def places(self) -> FloatArray:
        """Places of the nodes, m, shape (dimension, nodes)."""
        return np.asarray(self.length_scale * self.nodes)


def default_cells(*, disc: Disc, dimension: int = 2) -> tuple[int, ...]:
    """Numbers of cells that keep pressure and moment within 1e-6: 8 x 24 (x 4) for a chamber of 90 degrees.

    Args: `disc`: the disc; only its central angle counts. `dimension`: 2 or 3.
    Returns: Cells along the radius, the angle and, in three dimensions, the axis; all divisible by four.
    Source: an arc of angle h drawn by one quadratic cell leaves its circle by R (h/2)^4 / 32.
    """
    angular = 4 * max(2, int(np.ceil(disc.central_angle / (np.pi / 12) - 1e-9)))
    return (8, angular, 4)[:dimension]


def chamber_mesh(
    *,
    disc: Disc,
    surface_radius: npt.ArrayLike | SurfaceFunction,
    cells: tuple[int, ...] | None = None,
    order: int = 2,
    geometry: Geometry = "curved",
) -> ChamberMesh:
    """Mesh of the liquid between a free surface, concentric or not, and the walls of one chamber.

    Args:
        surface_radius: a, m: one number; or its values at the surface nodes, shape (order x angular cells
            + 1, and order x axial cells + 1 in three dimensions); or a function of the angle (rad) and the
            axial coordinate (m), zero in two dimensions.
        cells: along the radius, the angle and, for a three-dimensional mesh, the axis; default
            `default_cells` in two dimensions.
        order: of the polynomials, from 1 to `HIGHEST_ORDER`.
        geometry: "curved" puts all nodes on the arcs, "straight" the inner ones of a cell on straight lines.
    Returns: The mesh; plate_left is the one at the larger angle, end_front the one at B/2.
    Raises: ValueError: cells that are not two or three positive numbers, or a surface that does not lie
        between the plate's edge and the outer radius everywhere.
    """
    counts = tuple(int(n) for n in (cells or default_cells(disc=disc)))
    if len(counts) not in (2, 3) or min(counts) < 1:
        raise ValueError(f"cells must be two or three positive numbers, not {cells}")
    if not 1 <= order <= HIGHEST_ORDER:
        raise ValueError(f"order must lie between 1 and {HIGHEST_ORDER}, not {order}")
    lines = [line_stations(n, order) for n in counts]
    surface = _surface_nodes(disc, surface_radius, lines[1:])
    inner = max(disc.plate_thickness, 0.0)
    if not np.all((surface > inner) & (surface < disc.outer_radius)):
        raise ValueError("surface_radius must lie inside the outer radius and outside the plate's edge")
    places = _positions(disc, surface, lines) / disc.outer_radius
    if geometry == "straight":
        places = _straightened(places, order)
    grid, cell_nodes = _topology(counts, order)
    return ChamberMesh(
        nodes=places.reshape(len(counts), -1),
        length_scale=disc.outer_radius,
        cells=counts,
        order=order,
        geometry=geometry,
        grid=grid,
        cell_nodes=cell_nodes,
        surface_radius=surface,
    )


def _surface_nodes(
    disc: Disc, surface: npt.ArrayLike | SurfaceFunction, lines: Sequence[FloatArray]
) -> FloatArray:
    shape = tuple(line.size for line in lines)
    if not callable(surface):
        return np.array(np.broadcast_to(np.asarray(surface, dtype=np.float64), shape))
    eta = (2 * lines[0] - 1).reshape(-1, *[1] * (len(shape) - 1))
    axial = np.broadcast_to(disc.axial_width * (lines[1] - 0.5) if len(shape) == 2 else 0.0, shape)
    radius = np.full(shape, disc.outer_radius)
    # The angle of a node depends on its radius through the plate alone, so this contracts quickly.
    for _ in range(100):
        angle = np.asarray(eta * half_angle(disc=disc, radius=radius), dtype=np.float64)
        update = np.broadcast_to(surface(angle, axial), shape)
        if not np.all(update > disc.plate_thickness):
            break
        change, radius = np.max(np.abs(update - radius)), np.array(update)
        if change <= 4 * np.finfo(np.float64).eps * disc.outer_radius:
            break
    return np.array(update)


def _positions(disc: Disc, surface: FloatArray, lines: Sequence[FloatArray]) -> FloatArray:
    """Coordinates (axis, radial, angular[, axial]) in metres."""
    t, outer = disc.plate_thickness, disc.outer_radius
    trailing = (1,) * surface.ndim
    share = lines[0].reshape(-1, *trailing)
    face_inner, face_outer = np.sqrt(surface**2 - t**2), np.sqrt(outer**2 - t**2)
    radius = np.hypot(face_inner + share * (face_outer - face_inner), t)
    eta = (2 * lines[1] - 1).reshape(-1, *trailing[1:])
    angle = eta * half_angle(disc=disc, radius=radius)
    plane = [radius * np.cos(angle), radius * np.sin(angle)]
    if len(lines) == 2:
        return np.stack(plane)
    axial = disc.axial_width * (lines[2] - 0.5)
    return np.stack([*plane, np.broadcast_to(axial, radius.shape)])


def _straightened(places: FloatArray, order: int) -> FloatArray:
    result = places.copy()
    for axis in range(1, places.ndim):
        along = np.moveaxis(result, axis, -1)
        first, last = along[..., :-1:order], along[..., order::order]
        for k, share in enumerate((1 + stations(order)[1:-1]) / 2):
            along[..., 1 + k :: order] = (1 - share) * first + share * last
    return result


@lru_cache(maxsize=16)
def _topology(cells: tuple[int, ...], order: int) -> tuple[IntArray, IntArray]:
    """Node numbers by structured place, and those of each cell."""
    shape = tuple(order * n + 1 for n in cells)
    grid = np.arange(np.prod(shape), dtype=np.int64).reshape(shape)
    windows = sliding_window_view(grid, (order + 1,) * len(cells))[(slice(None, None, order),) * len(cells)]
    cell_nodes = np.moveaxis(windows.reshape(-1, *(order + 1,) * len(cells)), 0, -1)
    cell_nodes = np.ascontiguousarray(cell_nodes)
    for shared in (grid, cell_nodes):
        shared.flags.writeable = False
    return grid, cell_nodes


@dataclass(frozen=True, kw_only=True)
class _Quality:
    """Quality figures over all cells of a mesh; none depends on the unit of length."""

    minimum_scaled_jacobian: float
    """Smallest sine (in three dimensions: triple product) of the local axes; 1 is square, 0 or less is
    folded."""
    maximum_aspect: float
    """Longest over shortest local axis in one cell, at least 1."""
    cells: int
    nodes: int
