"""Moment of one half-full chamber by finite elements, and the arithmetic of Eq. 7."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

from ringbalance.reduced_model.paper import max_liquid_volume_paper, moment_paper, surface_radius_paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Reference, Series, figure
from ringbalance.verification.paper_numbers import (
    CHAMBER_MOMENT,
    DENSITY,
    RING_RADIUS,
    at_paper_density,
    rounded_radius,
    with_plate,
)
from ringbalance.verification.rings import chamber_moment, found_of, mesh_table, ring_of

_FILLS: Final = (0.1, 0.2, 0.3, 0.4, 0.5)
_WHOLE_ANGLE: Final = float(np.sqrt(2))
"""Sine of the central angle over that of its half, which Eq. 7 takes."""


reference = dict.fromkeys(("moment", "arithmetic"), CHAMBER_MOMENT.reference) | {
    "without_plates": Reference(value=1.0)
}


def values(scene: Scene) -> dict[str, float]:
    return {"moment": chamber_moment(at_paper_density(scene), density=DENSITY).value}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = at_paper_density(scene)
    ring = ring_of(given, _FILLS)
    moment = chamber_moment(given, density=DENSITY)
    if defect == "plates_left_out":
        moment = moment.with_correction()
    unrounded, rounded = (_eq_7(given.disc, radius) for radius in (_radius(given.disc), RING_RADIUS.value))
    return Evidence(
        found={
            "moment": moment,
            "arithmetic": Found(value=unrounded, input=rounded_radius(lambda r: _eq_7(given.disc, r))),
            "without_plates": _shape(given).scaled(_WHOLE_ANGLE if defect == "whole_angle" else 1.0),
        },
        numbers={
            "rounded": rounded,
            "rounding_step": abs(unrounded - rounded),
            "shortfall": 1 - moment.value / CHAMBER_MOMENT.value,
        },
        series=(_figure(given, ring.moment.value, ring.moment.uncertainty),),
        convergence=(mesh_table(ring, "moment", "kg m", len(_FILLS) - 1),),
        status=ring.status,
    )


def _shape(scene: Scene) -> Found:
    """Finite elements over Eq. 7 where there are no plates to leave out."""
    bare = with_plate(scene.disc, 0.0)
    disc = ring_of(dataclasses.replace(scene, disc=bare), (scene.disc.max_fill_ratio,))
    return found_of(disc, "moment", 0).scaled(1 / _eq_7(bare, _radius(bare)))


def _radius(disc: Disc) -> float:
    return float(surface_radius_paper(disc=disc, liquid_volume=max_liquid_volume_paper(disc=disc)))


def _eq_7(disc: Disc, radius: float) -> float:
    return float(moment_paper(disc=disc, density=DENSITY, surface_radius=radius))


def _figure(scene: Scene, moment: FloatArray, uncertainty: FloatArray) -> Series:
    x = np.array(_FILLS)
    liquid = 2 * x * max_liquid_volume_paper(disc=scene.disc)
    radius = surface_radius_paper(disc=scene.disc, liquid_volume=liquid)
    by_eq_7 = moment_paper(disc=scene.disc, density=DENSITY, surface_radius=radius)
    return figure(
        "moment of one chamber",
        ("fill ratio", "1", x),
        Curve("finite elements", "kg m", moment, uncertainty=uncertainty),
        Curve("Eq. 7", "kg m", by_eq_7, style="paper"),
    )
