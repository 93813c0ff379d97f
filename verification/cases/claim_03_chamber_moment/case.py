"""Moment of one half-full chamber by finite elements, and the arithmetic of Eq. 7."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.reduced_model.paper.formulas import (
    max_liquid_volume_paper,
    moment_paper,
    surface_radius_paper,
)
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.paper_numbers import CHAMBER_MOMENT, DENSITY, RING_RADIUS, at_paper_density
from ringbalance.verification.rings import chamber_moment, mesh_table, ring_of

_FILLS: Final = (0.1, 0.2, 0.3, 0.4, 0.5)


reference = dict.fromkeys(("moment", "arithmetic"), CHAMBER_MOMENT.reference)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = at_paper_density(scene)
    ring = ring_of(given, _FILLS)
    by_elements = chamber_moment(given, ring, -1, density=DENSITY)
    unrounded, rounded = (_eq_7(given.disc, radius) for radius in (_radius(given.disc), RING_RADIUS.value))
    arithmetic = Found(value=unrounded, corrected=rounded)
    moment = arithmetic if defect == "plates_left_out" else by_elements
    return Evidence(
        found={"moment": moment, "arithmetic": arithmetic},
        numbers={
            "rounding_step": abs(unrounded - rounded),
            "shortfall": 1 - moment.value / CHAMBER_MOMENT.value,
        },
        series=(_figure(given, ring.moment.value, ring.moment.uncertainty),),
        convergence=(mesh_table(ring, "moment", "kg m", len(_FILLS) - 1),),
        status=ring.status,
    )


def _radius(disc: Disc) -> float:
    return float(surface_radius_paper(disc=disc, liquid_volume=max_liquid_volume_paper(disc=disc)))


def _eq_7(disc: Disc, radius: float) -> float:
    return float(moment_paper(disc=disc, density=DENSITY, surface_radius=radius))


def _figure(scene: Scene, moment: np.ndarray, uncertainty: np.ndarray) -> Series:
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
