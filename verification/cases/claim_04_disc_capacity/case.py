"""Moment of two adjacent full chambers, from one chamber's by finite elements."""

from __future__ import annotations

import math

import numpy as np

from ringbalance.reduced_model.paper import capacity
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.paper_numbers import CHAMBER_MOMENT, DENSITY, DISC_MOMENT, at_paper_density
from ringbalance.verification.rings import chamber_moment, ring_of

reference = dict.fromkeys(("capacity", "arithmetic"), DISC_MOMENT.reference)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = at_paper_density(scene)
    ring = ring_of(given, (given.disc.max_fill_ratio,))
    both = chamber_moment(given, density=DENSITY, factor=math.sqrt(2))
    if defect == "plates_left_out":
        both = both.with_correction()
    printed = float(capacity(chamber_moment=CHAMBER_MOMENT.value))
    if defect == "added_as_numbers":
        printed = 2 * CHAMBER_MOMENT.value
    rounding = CHAMBER_MOMENT.reference.uncertainty * math.sqrt(2)
    chamber = both.value / math.sqrt(2)
    return Evidence(
        found={
            "capacity": both,
            "arithmetic": Found(value=printed, input=rounding),
        },
        numbers={"guaranteed": chamber},
        series=(_over_phase(chamber),),
        status=ring.status,
    )


def _over_phase(chamber: float) -> Series:
    """Largest moment along each direction that two pairs, each within +-U, can make exactly."""
    angle = np.linspace(0, np.pi / 2, 91)
    largest = chamber / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    return figure(
        "balancing ability against its direction",
        ("angle from a chamber's centre line", "rad", angle),
        Curve("found", "kg m", largest),
        Curve("Eq. 8", "kg m", np.full(angle.shape, DISC_MOMENT.value), style="paper"),
    )
