"""Volumes and the ring's inner radius from the exact area."""

from __future__ import annotations

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.reduced_model.paper import surface_radius_paper
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure
from ringbalance.verification.paper_numbers import (
    INITIAL_LIQUID_VOLUME,
    MAX_LIQUID_VOLUME,
    RING_RADIUS,
    with_plate,
)

_HALF = 0.5
_QUARTER = 0.25


reference = {
    "ring_radius": RING_RADIUS.reference,
    "max_liquid": MAX_LIQUID_VOLUME.reference,
    "initial_liquid": INITIAL_LIQUID_VOLUME.reference,
}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    volume = chamber_volume(disc=scene.disc)
    bare = with_plate(scene.disc, 0.0)
    return Evidence(
        found=as_found(
            ring_radius=_half_full_radius(scene.disc),
            max_liquid=_HALF * volume,
            initial_liquid=_QUARTER * volume,
        ),
        numbers={"radius_bare": _half_full_radius(bare)},
        series=(_radius_over_fill(scene.disc, bare),),
    )


def _half_full_radius(disc: Disc) -> float:
    return float(surface_radius(disc=disc, fill_ratio=_HALF))


def _radius_over_fill(disc: Disc, bare: Disc) -> Series:
    x = np.linspace(0, _HALF, 51)
    by_eq_3 = surface_radius_paper(disc=disc, liquid_volume=x * chamber_volume(disc=disc) * (1 - 1e-9))
    curves = (
        Curve("exact area", "m", surface_radius(disc=disc, fill_ratio=x)),
        Curve("Eq. 3", "m", by_eq_3, style="paper"),
        Curve("no plates", "m", surface_radius(disc=bare, fill_ratio=x), style="reference"),
    )
    return figure("inner radius of the ring", ("fill ratio", "1", x), *curves)
