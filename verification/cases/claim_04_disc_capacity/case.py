"""Moment of two adjacent full chambers, from one chamber's by finite elements."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ringbalance.reduced_model.paper.formulas import capacity, moment_paper
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Reference, Series
from ringbalance.verification.paper_numbers import (
    CHAMBER_MOMENT,
    DENSITY,
    DISC_MOMENT,
    RING_RADIUS,
    at_paper_density,
)
from ringbalance.verification.rings import found_of, moment_standard_uncertainty, ring_of, scaled


def reference(scene: Scene) -> Mapping[str, Reference]:
    """The printed ability of the disc."""
    return {"capacity": DISC_MOMENT.reference, "arithmetic": DISC_MOMENT.reference}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Two full chambers at right angles."""
    given = at_paper_density(scene)
    full = given.disc.max_fill_ratio
    ring = ring_of(given, (full,))
    chamber = found_of(ring, "moment", 0, input_=moment_standard_uncertainty(given, full))
    if defect == "plates_left_out":
        chamber = Found(
            value=float(moment_paper(disc=given.disc, density=DENSITY, surface_radius=RING_RADIUS.value))
        )
    printed = float(capacity(chamber_moment=CHAMBER_MOMENT.value))
    rounding = CHAMBER_MOMENT.reference.uncertainty * math.sqrt(2)
    return Evidence(
        found={
            "capacity": scaled(chamber, math.sqrt(2)),
            "arithmetic": Found(value=printed, input=rounding),
        },
        numbers={"guaranteed": chamber.value},
        series=(_over_phase(chamber.value),),
        status=ring.status,
    )


def _over_phase(chamber: float) -> Series:
    """Largest moment along each direction that two pairs, each within +-U, can make exactly."""
    angle = np.linspace(0, np.pi / 2, 91)
    largest = chamber / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    return Series(
        name="balancing ability against its direction",
        x=Axis(name="angle from a chamber's centre line", unit="rad", values=angle),
        y=(
            Curve(name="found", unit="kg m", values=largest),
            Curve(name="Eq. 8", unit="kg m", values=np.full(angle.shape, DISC_MOMENT.value), style="paper"),
        ),
    )
