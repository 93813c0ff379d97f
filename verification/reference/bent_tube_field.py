"""The bent tube's flow over the whole tube as straight hexahedra, ready to draw in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow_fields import nodal_pressure, quarter_cells
from ringbalance.verification.reference.bent_tube import BentTubeFlow

__all__ = ["BentTubeField", "bent_tube_field"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BentTubeField:
    """Velocity and reduced pressure in the whole tube; the path lies in the plane z = 0."""

    points: FloatArray
    """(x, y, z)/d, shape (3, n)."""
    hexahedra: IntArray
    """Node numbers in VTK's order, shape (m, 8)."""
    velocity: FloatArray
    """Over U, shape (3, n)."""
    speed: FloatArray
    """Over U, shape (n,)."""
    pressure: FloatArray
    """2 (p - p_outlet)/(rho U^2), reduced by the centrifugal part, shape (n,)."""


def bent_tube_field(*, flow: BentTubeFlow) -> BentTubeField:
    """The field of a solved tube, its half completed by its mirror image.

    Returns: The field; eight hexahedra per cell of the mesh.
    """
    tube, space = flow.tube, flow.system.space
    cells = _hexahedra(flow)
    on_plane = np.zeros(space.velocity_nodes, dtype=bool)
    on_plane[space.boundary_nodes("symmetry")] = True
    off = np.flatnonzero(~on_plane)
    image = np.arange(space.velocity_nodes)
    image[off] = space.velocity_nodes + np.arange(off.size)
    # A mirrored cell keeps its orientation when its two ends change places.
    mirrored = image[cells][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    flip = np.array([[1.0], [1.0], [-1.0]])
    points = np.asarray(tube.mesh.doflocs, dtype=np.float64)
    u = flow.solution.velocity
    p = 2 / flow.reynolds * (nodal_pressure(space=space, pressure=flow.solution.pressure))
    velocity = np.concatenate([u, flip * u[:, off]], axis=1)
    return BentTubeField(
        points=np.concatenate([points, flip * points[:, off]], axis=1),
        hexahedra=np.concatenate([cells, mirrored]),
        velocity=velocity,
        speed=np.asarray(np.sqrt((velocity**2).sum(axis=0)), dtype=np.float64),
        pressure=np.concatenate([p, p[off]]),
    )


def _hexahedra(flow: BentTubeFlow) -> IntArray:
    """The section's quarter cells between every two neighbouring half-stations."""
    tube, section = flow.tube, flow.section.space
    layers = tube.arc_length.size
    node = np.empty((layers, section.velocity_nodes), dtype=np.int64)
    node[tube.half_station, tube.section_node] = np.arange(tube.half_station.size)
    quads = quarter_cells(space=section)
    # Counter-clockwise in (y, z), seen against the path: the far end comes second in VTK's order.
    return np.concatenate([np.hstack([node[h][quads], node[h + 1][quads]]) for h in range(layers - 1)])
