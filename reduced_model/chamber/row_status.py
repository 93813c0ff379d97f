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
    GAS_DRAWN = "gas_drawn"


REMEDIES: Final[Mapping[RowStatus, str]] = MappingProxyType(
    {
        RowStatus.NO_RING: "gravity leaves no closed ring at this speed: raise rotor.speed",
        RowStatus.PORT_UNCOVERED: "the liquid does not reach the port, so gas passes through and the chamber "
        "cannot be emptied further: move tube.port_radius towards disc.outer_radius",
        RowStatus.OVER_CREST: "the level lies inside the siphon crest, so liquid runs back while the gas is "
        "off: lower disc.max_fill_ratio or tube.hump_radius",
        RowStatus.GAS_DRAWN: "less than the residual liquid, so gas is drawn into the port and the velocity "
        "is not that of liquid alone: empty a chamber down to its residual fill ratio only",
    }
)


def row_status(
    scene: Scene, *, fill_ratio: FloatArray, closed: BoolArray, residual: float = 0.0
) -> tuple[RowStatus, ...]:
    """Status of each fill ratio x; an empty chamber is limited by its residual liquid alone.

    NO_RING: not `closed` under gravity. PORT_UNCOVERED: a >= r_p. OVER_CREST: a <= r_m. GAS_DRAWN: x below
    `residual`, for what flows out of the chamber. With the radii a of the concentric surface, r_p of the port
    and r_m of the crest.
    """
    level, crest = surface_radius(disc=scene.disc, fill_ratio=fill_ratio), scene.tube.hump_radius
    inside = np.zeros(level.shape, dtype=np.bool_) if crest is None else level <= crest
    limits = (
        (~closed & (fill_ratio > 0), RowStatus.NO_RING),
        ((level >= scene.tube.port_radius) & (fill_ratio > 0), RowStatus.PORT_UNCOVERED),
        (inside & (fill_ratio > 0), RowStatus.OVER_CREST),
        (fill_ratio < residual, RowStatus.GAS_DRAWN),
    )
    return tuple(
        next((status for where, status in limits if where[row]), RowStatus.OK)
        for row in range(fill_ratio.size)
    )
