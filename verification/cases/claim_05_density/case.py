"""The moment at one and at two grams per millilitre by finite elements."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.scene import liquid_at
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference
from ringbalance.verification.paper_numbers import DENSE_DISC_MOMENT, DENSITY
from ringbalance.verification.rings import chamber_moment, found_of, ring_of

_DENSE: Final = 2 * DENSITY


reference = {"ratio": Reference(value=2.0), "dense_capacity": DENSE_DISC_MOMENT.reference}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    full = (scene.disc.max_fill_ratio,)
    light, dense = (ring_of(scene, full, density=density) for density in (DENSITY, _DENSE))
    capacity = chamber_moment(scene, density=_DENSE, factor=math.sqrt(2))
    if defect == "plates_left_out":
        capacity = capacity.with_correction()
    below, above = (found_of(ring, "moment", 0) for ring in (light, dense))
    ratio = 1.0 if defect == "density_without_effect" else above.value / below.value
    oil = liquid_at(name="perfluorinated oil GPL 101", temperature=293.15).density
    return Evidence(
        found={
            "ratio": Found(value=ratio, numerical=ratio * below.numerical / below.value),
            "dense_capacity": capacity,
        },
        numbers={"oil_density": oil, "oil_capacity": capacity.value * oil / _DENSE},
        status=dense.status,
    )
