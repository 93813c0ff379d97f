"""The moment at one and at two grams per millilitre by finite elements."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from ringbalance.physics.pressure.ring import RingQuantities
from ringbalance.reduced_model.paper.formulas import moment_paper
from ringbalance.scene import liquid_at
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference
from ringbalance.verification.paper_numbers import (
    DENSE_DISC_MOMENT,
    DENSITY,
    RING_RADIUS,
    at_paper_density,
)
from ringbalance.verification.rings import found_of, moment_standard_uncertainty, ring, scaled

_DENSE: Final = 2 * DENSITY


def reference(scene: Scene) -> Mapping[str, Reference]:
    """A factor of two, and the printed ability."""
    return {"ratio": Reference(value=2.0), "dense_capacity": DENSE_DISC_MOMENT.reference}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Moments at both densities."""
    light, dense = (_ring(scene, density) for density in (DENSITY, _DENSE))
    full = scene.disc.max_fill_ratio
    chamber = found_of(
        dense,
        "moment",
        0,
        input_=_DENSE / DENSITY * moment_standard_uncertainty(at_paper_density(scene), full),
    )
    if defect == "plates_left_out":
        chamber = Found(
            value=float(moment_paper(disc=scene.disc, density=_DENSE, surface_radius=RING_RADIUS.value))
        )
    below = found_of(light, "moment", 0)
    above = found_of(dense, "moment", 0)
    ratio = above.value / below.value
    capacity = scaled(chamber, math.sqrt(2))
    oil = _oil_density()
    return Evidence(
        found={
            "ratio": Found(value=ratio, numerical=ratio * below.numerical / below.value),
            "dense_capacity": capacity,
        },
        numbers={"oil_density": oil, "oil_capacity": capacity.value * oil / _DENSE},
        status=dense.status,
    )


def _ring(scene: Scene, density: float) -> RingQuantities:
    return ring(
        disc=scene.disc,
        density=density,
        angular_velocity=scene.rotor.speed,
        fills=(scene.disc.max_fill_ratio,),
    )


def _oil_density() -> float:
    return float(liquid_at(name="perfluorinated oil GPL 101", temperature=293.15).density)
