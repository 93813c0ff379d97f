"""The chamber's volume from printed numbers that do not contain it: R1'min and Fig. 4's departure."""

from __future__ import annotations

import math
from functools import partial

from scipy.optimize import brentq

from ringbalance.mesh.geometry import chamber_volume, liquid_area, surface_radius
from ringbalance.reduced_model.paper import chamber_volume_paper
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    COVERAGE_FACTOR,
    Evidence,
    Found,
    Level,
    Table,
    from_rounding,
    input_uncertainty,
)
from ringbalance.verification.paper_numbers import (
    CHAMBER_VOLUME,
    DENSITY,
    DEPARTURE_LOW,
    LOW_PRESSURE,
    RING_RADIUS,
    rounded_radius,
    with_plate,
)

reference = dict.fromkeys(("volume", "volume_from_departure"), CHAMBER_VOLUME.reference)
"""The printed volume, for both routes to it."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    disc = scene.disc
    volume = _volume_without_plates if defect == "no_plates" else _volume_from_radius
    departure = Found(
        value=_volume_from_departure(scene, DEPARTURE_LOW.value),
        input=math.hypot(_departure_uncertainty(scene), rounded_radius(partial(_twice_the_liquid, disc))),
    )
    radius_half_width = COVERAGE_FACTOR * rounded_radius(lambda r: _plate_from_radius(disc, r))
    found = {
        "volume": Found(
            value=volume(disc, RING_RADIUS.value),
            input=rounded_radius(lambda radius: volume(disc, radius)),
        ),
        "volume_from_departure": departure,
        "flat_strip": Found(value=abs(chamber_volume_paper(disc=disc) / chamber_volume(disc=disc) - 1)),
    }
    return Evidence(
        found=found,
        numbers={
            "plate_thickness": disc.plate_thickness,
            "plate_from_radius": _plate_from_radius(disc, RING_RADIUS.value),
            "plate_from_radius_half_width": radius_half_width,
            "volume_bare": _volume_without_plates(disc, 0.0),
        },
        tables=(_table(disc, found["volume"], departure),),
    )


def _plate_from_radius(disc: Disc, radius: float) -> float:
    """Plate thickness with which a half-full chamber's ring has a given inner radius."""

    def excess(thickness: float) -> float:
        return float(surface_radius(disc=with_plate(disc, thickness), fill_ratio=0.5)) - radius

    return float(brentq(excess, 0.0, 0.3 * disc.inner_radius, xtol=1e-12))


def _volume_from_radius(disc: Disc, radius: float) -> float:
    return chamber_volume(disc=with_plate(disc, _plate_from_radius(disc, radius)))


def _volume_without_plates(disc: Disc, radius: float) -> float:
    return chamber_volume(disc=with_plate(disc, 0.0))


def _volume_from_departure(scene: Scene, departure: float) -> float:
    """Eqs. 18 and 19 turned round: (1 - D)^2 = (p0 - s)/(p0 + s) with s = rho omega^2 V/(2 B theta)."""
    ratio = (1 - departure) ** 2
    stall = LOW_PRESSURE * (1 - ratio) / (1 + ratio)
    disc = scene.disc
    per_volume = DENSITY * scene.rotor.speed**2 / (disc.axial_width * disc.central_angle)
    return stall / per_volume / 0.5


def _departure_uncertainty(scene: Scene) -> float:
    rounding = from_rounding(DEPARTURE_LOW.last_digit)
    return input_uncertainty([(lambda d: _volume_from_departure(scene, d), DEPARTURE_LOW.value, rounding)])


def _twice_the_liquid(disc: Disc, radius: float) -> float:
    """The paper reads V'_AC off a radius that it has rounded."""
    return 2 * disc.axial_width * float(liquid_area(disc=disc, surface_radius=radius))


def _table(disc: Disc, from_radius: Found, from_departure: Found) -> Table:
    return Table(
        name="the chamber's volume by each printed number that contains the plates",
        columns={
            "from": ["Eq. 4, with the plates inferred from it", "R1'min = 34.9 mm", "departure 45.6 %"],
            "volume": [chamber_volume(disc=disc), from_radius.value, from_departure.value],
            "half-width": [0.0, COVERAGE_FACTOR * from_radius.input, COVERAGE_FACTOR * from_departure.input],
        },
        units={"volume": "m^3", "half-width": "m^3"},
    )
