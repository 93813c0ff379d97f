"""An imported chamber whose disc has another outer radius or width than its mesh: stretched to it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ringbalance.mesh.cut.table import ChamberTable, chamber_table
from ringbalance.scene.chamber_file.record import ChamberGeometry, rounded


@lru_cache(maxsize=8)
def _own_size(geometry: ChamberGeometry) -> tuple[float, float]:
    """Outer radius and axial width as the scene of the mesh has them, m."""
    x, y, z = geometry.points.T
    found = rounded({"outer": float(np.hypot(x, y).max()), "width": float(np.ptp(z))})
    return found["outer"], found["width"]


@lru_cache(maxsize=64)
def stretched_table(geometry: ChamberGeometry, *, outer_radius: float, axial_width: float) -> ChamberTable:
    """Integrals of a chamber stretched evenly across the shaft and along it, without integrating again.

    Args: `outer_radius`: m, of the stretched chamber. `axial_width`: m, likewise.
    """
    table, (outer, width) = chamber_table(geometry), _own_size(geometry)
    across, along = outer_radius / outer, axial_width / width
    if across == along == 1:
        return table
    volume, moment, square = across**2 * along, across**3 * along, across**2
    columns = (volume, moment, moment, square)
    scale = np.array([*columns, *(each / square for each in columns)])[:, None]
    return replace(
        table,
        patches=table.patches * np.array([across, across, along]),
        nodes=table.nodes * square,
        columns=table.columns * scale,
        error=table.error * scale,
        wall_area=table.wall_area * across * along,
        wall_start=table.wall_start * square,
    )
