"""What a user may not have meant in the mesh of a chamber; its numbers are those of the mesh all the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.mesh.faceting import SMOOTH, axis_beside_shaft, faceting, inward_share
from ringbalance.reduced_model.chamber.values import drawing_shares
from ringbalance.results.rows import Finding
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Scene

_NEXT_TO_NOTHING: Final = 1e-3
"""Of the outer wall's area."""


def mesh_findings(scene: Scene) -> tuple[Finding, ...]:
    """Findings of an imported chamber; none of the built-in sector."""
    geometry = scene.disc.geometry
    if geometry is None:
        return ()
    return tuple(_findings(scene, geometry))


def _findings(scene: Scene, geometry: ChamberGeometry) -> Iterator[Finding]:
    if (axis := axis_beside_shaft(geometry)) is not None:
        yield Finding(code="off_axis", values={"distance_m": float(np.hypot(*axis))})
    if (inward := inward_share(geometry)) > _NEXT_TO_NOTHING:
        yield Finding(code="outer_wall_faces_inward", values={"area_share": inward})
    bend, volume = faceting(geometry).steepest, drawing_shares(scene.disc, np.empty(0)).volume
    if bend > SMOOTH or volume > scene.tolerance:
        yield Finding(code="coarse_curves", values={"angle_rad": bend, "volume_share": volume})
