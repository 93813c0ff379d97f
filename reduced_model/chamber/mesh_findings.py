"""What a user may not have meant in the mesh of a chamber; its numbers are those of the mesh all the same."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.cut.faceting import SMOOTH, faceting
from ringbalance.mesh.cut.outer_wall import axis_beside_shaft, inward_share
from ringbalance.reduced_model.chamber.values import drawing_shares
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Scene

_NEXT_TO_NOTHING: Final = 1e-3
"""Of the outer wall's area."""


@dataclass(frozen=True, kw_only=True)
class MeshFinding:
    """One of them."""

    code: str
    """ "off_axis", "outer_wall_faces_inward" or "coarse_curves"."""
    severity: str
    """ "warning"."""
    values: Mapping[str, float]
    """SI, by name with the unit."""
    change: str
    """What it is, and what to do."""


def mesh_findings(scene: Scene) -> tuple[MeshFinding, ...]:
    """Findings of an imported chamber; none of the built-in sector."""
    geometry = scene.disc.geometry
    if geometry is None:
        return ()
    found = [*_axis(geometry), *_inward(geometry), *_coarse(scene, geometry)]
    return tuple(MeshFinding(code=c, severity="warning", values=v, change=t) for c, v, t in found)


_Found = Iterator[tuple[str, Mapping[str, float], str]]


def _axis(geometry: ChamberGeometry) -> _Found:
    axis = axis_beside_shaft(geometry)
    if axis is None:
        return
    distance = float(np.hypot(*axis))
    text = (
        f"the outer wall is round about an axis {1e3 * distance:.3g} mm beside the shaft: if that is not "
        "meant, put the origin of the mesh on the shaft"
    )
    yield "off_axis", {"distance_m": distance}, text


def _inward(geometry: ChamberGeometry) -> _Found:
    share = inward_share(geometry)
    if share <= _NEXT_TO_NOTHING:
        return
    text = (
        f"{100 * share:.2g} % of the boundary outer_wall face the shaft, and count in the mean wall "
        "pressure: give that name to walls that hold the liquid outward"
    )
    yield "outer_wall_faces_inward", {"area_share": share}, text


def _coarse(scene: Scene, geometry: ChamberGeometry) -> _Found:
    bend = faceting(geometry).steepest
    share = drawing_shares(scene.disc, np.empty(0)).volume
    if bend <= SMOOTH and share <= scene.tolerance:
        return
    text = (
        f"facets that meet at up to {np.degrees(bend):.2g} deg may draw curves, and then the volume is off "
        f"by up to {100 * share:.2g} %: take smaller cells there, or cells of second order, which show what "
        "is an edge"
    )
    yield "coarse_curves", {"angle_rad": bend, "volume_share": share}, text
