"""Which rows of a calibration's tables hold for the device, and what to change where they do not."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene


class RowStatus(StrEnum):
    """What limits a row at its fill ratio; the first that applies."""

    OK = "ok"
    NO_RING = "no_ring"
    PORT_UNCOVERED = "port_uncovered"
    OVER_CREST = "over_crest"


REMEDIES: Final[Mapping[RowStatus, str]] = MappingProxyType(
    {
        RowStatus.NO_RING: "gravity leaves no closed ring at this speed: raise rotor.speed",
        RowStatus.PORT_UNCOVERED: "the liquid does not reach the port, so gas passes through and the chamber "
        "cannot be emptied further: move tube.port_radius towards disc.outer_radius",
        RowStatus.OVER_CREST: "the level lies inside the siphon crest, so liquid runs back while the gas is "
        "off: lower disc.max_fill_ratio or tube.hump_radius",
    }
)


def row_status(scene: Scene, *, fill_ratio: FloatArray, closed: BoolArray) -> tuple[RowStatus, ...]:
    """Status of each fill ratio x > 0; an empty chamber is limited by nothing.

    NO_RING: not `closed` under gravity. PORT_UNCOVERED: a >= r_p. OVER_CREST: a <= r_m. With the radii a of
    the concentric surface, r_p of the port and r_m of the crest.
    """
    level, crest = surface_radius(disc=scene.disc, fill_ratio=fill_ratio), scene.tube.hump_radius
    inside = np.zeros(level.shape, dtype=np.bool_) if crest is None else level <= crest
    limits = (
        (~closed, RowStatus.NO_RING),
        (level >= scene.tube.port_radius, RowStatus.PORT_UNCOVERED),
        (inside, RowStatus.OVER_CREST),
    )
    return tuple(
        next((status for where, status in limits if where[row] and fill > 0), RowStatus.OK)
        for row, fill in enumerate(fill_ratio)
    )
