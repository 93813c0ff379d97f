"""Claims on a chamber's volume, ring, moment and lambda: as printed, in closed form, by finite elements."""

from __future__ import annotations

import dataclasses
import math
from functools import partial
from typing import Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.mesh.geometry import chamber_volume, liquid_area, surface_radius
from ringbalance.reduced_model import paper
from ringbalance.scene import liquid_at
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    COVERAGE_FACTOR,
    CaseTable,
    Evidence,
    FigureCurve,
    Found,
    Level,
    Reference,
    as_found,
    figure,
    from_half_width,
    from_rounding,
    input_uncertainty,
)
from ringbalance.verification.finite_elements import chamber_moment, found_of, mesh_table, ring_of
from ringbalance.verification.papers import (
    CHAMBER_MOMENT,
    CHAMBER_VOLUME,
    DENSE_DISC_MOMENT,
    DENSITY_KG_M3,
    DEPARTURE_LOW,
    DISC_MOMENT,
    INITIAL_LIQUID_VOLUME,
    LAMBDA_TOLERANCE,
    LOW_PRESSURE_PA,
    MAX_LIQUID_VOLUME,
    RING_RADIUS,
    at_paper_density,
    rounded_radius,
    with_plate,
)
from ringbalance.verification.reference.chambers import central_lambda, exact_moment

_LAMBDA_LAST_DIGIT_M: Final = 1e-3
_PRINTED_LAMBDA: Final = Reference(
    value=paper.PAPER_LAMBDA_M,
    uncertainty=math.hypot(
        from_half_width(LAMBDA_TOLERANCE * paper.PAPER_LAMBDA_M), from_rounding(_LAMBDA_LAST_DIGIT_M)
    ),
)
"""The printed lambda with its stated error range and the rounding, m."""


def volume(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The chamber's volume from printed numbers that do not contain it: R1'min and Fig. 4's departure."""
    disc, bare = scene.disc, chamber_volume(disc=with_plate(scene.disc, 0.0))

    def plate_from_radius(radius: float) -> float:
        """Plate thickness with which a half-full chamber's ring has a given inner radius, m."""

        def excess(thickness: float) -> float:
            return _half_full_radius(with_plate(disc, thickness)) - radius

        return float(brentq(excess, 0.0, 0.3 * disc.inner_radius, xtol=1e-12))

    def from_radius(radius: float) -> float:
        if defect == "no_plates":
            return bare
        return chamber_volume(disc=with_plate(disc, plate_from_radius(radius)))

    def from_departure(departure: float) -> float:
        """Eqs. 18 and 19 solved for V: (1 - D)^2 = (p0 - s)/(p0 + s) with s = rho omega^2 V/(2 B theta)."""
        ratio = (1 - departure) ** 2
        stall = LOW_PRESSURE_PA * (1 - ratio) / (1 + ratio)
        per_volume = DENSITY_KG_M3 * scene.rotor.speed**2 / (disc.axial_width * disc.central_angle)
        return stall / per_volume / 0.5

    def liquid(radius: float) -> float:
        """Twice V'_AC, which the paper calculates from a rounded radius, m^3."""
        return 2 * disc.axial_width * float(liquid_area(disc=disc, surface_radius=radius))

    rounding = input_uncertainty([(from_departure, DEPARTURE_LOW.value, DEPARTURE_LOW.uncertainty)])
    volumes = {
        "volume": Found(
            value=from_radius(RING_RADIUS.value),
            input=rounded_radius(from_radius),
            reference=CHAMBER_VOLUME,
        ),
        "volume_from_departure": Found(
            value=from_departure(DEPARTURE_LOW.value),
            input=math.hypot(rounding, rounded_radius(liquid)),
            reference=CHAMBER_VOLUME,
        ),
    }
    by_eq_4 = chamber_volume(disc=disc)
    flat_strip = abs(paper.chamber_volume_paper(disc=disc) / by_eq_4 - 1)
    table = CaseTable(
        name="the chamber's volume by each printed number that contains the plates",
        columns={
            "from": ["Eq. 4, with the plates inferred from it", "R1'min = 34.9 mm", "departure 45.6 %"],
            "volume": [by_eq_4, *(number.value for number in volumes.values())],
            "half-width": [0.0, *(COVERAGE_FACTOR * number.input for number in volumes.values())],
        },
        units={"volume": "m^3", "half-width": "m^3"},
    )
    return Evidence(
        quantities=volumes | as_found(flat_strip=flat_strip),
        numbers={
            "plate_thickness": disc.plate_thickness,
            "plate_from_radius": plate_from_radius(RING_RADIUS.value),
            "plate_from_radius_half_width": COVERAGE_FACTOR * rounded_radius(plate_from_radius),
            "volume_bare": bare,
        },
        tables=(table,),
    )


def _half_full_radius(disc: Disc) -> float:
    return float(surface_radius(disc=disc, fill_ratio=0.5))


def ring_radius(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Volumes and the ring's inner radius from the exact area."""
    disc, bare, full = scene.disc, with_plate(scene.disc, 0.0), chamber_volume(disc=scene.disc)
    x = np.linspace(0, 0.5, 51)
    by_eq_3 = paper.surface_radius_paper(disc=disc, liquid_volume=x * full * (1 - 1e-9))
    shown = figure(
        "inner radius of the ring",
        ("fill ratio", "1", x),
        FigureCurve("exact area", "m", surface_radius(disc=disc, fill_ratio=x)),
        FigureCurve("Eq. 3", "m", by_eq_3, style="paper"),
        FigureCurve("no plates", "m", surface_radius(disc=bare, fill_ratio=x), style="reference"),
    )
    return Evidence(
        quantities={
            "ring_radius": Found(value=_half_full_radius(disc), reference=RING_RADIUS),
            "max_liquid": Found(value=0.5 * full, reference=MAX_LIQUID_VOLUME),
            "initial_liquid": Found(value=0.25 * full, reference=INITIAL_LIQUID_VOLUME),
        },
        numbers={"radius_bare": _half_full_radius(bare)},
        series=(shown,),
    )


def moment_ends(scene: Scene) -> Evidence:
    """Moment alone, since Eq. 7 leaves out the plates."""
    return Evidence(quantities={"moment": chamber_moment(at_paper_density(scene), density=DENSITY_KG_M3)})


def moment(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Moment of one half-full chamber by finite elements, and the arithmetic of Eq. 7."""
    printed_scene, fills = at_paper_density(scene), (0.1, 0.2, 0.3, 0.4, 0.5)
    disc, bare = printed_scene.disc, with_plate(printed_scene.disc, 0.0)
    ring = ring_of(printed_scene, fills)
    computed = chamber_moment(printed_scene, density=DENSITY_KG_M3)
    if defect == "plates_left_out":
        computed = computed.with_correction()
    # Eq. 7 takes the sine of half the central angle.
    angle = math.sqrt(2) if defect == "whole_angle" else 1.0
    without = ring_of(dataclasses.replace(printed_scene, disc=bare), (disc.max_fill_ratio,))
    rounded, unrounded = _eq_7(disc, RING_RADIUS.value), _eq_7(disc, _radius_by_eq_3(disc))
    shown = figure(
        "moment of one chamber",
        ("fill ratio", "1", fills),
        FigureCurve("finite elements", "kg m", ring.moment.value, uncertainty=ring.moment.uncertainty),
        FigureCurve(
            "Eq. 7", "kg m", np.array([_eq_7(disc, _radius_by_eq_3(disc, x)) for x in fills]), style="paper"
        ),
    )
    return Evidence(
        quantities={
            "moment": computed.against(CHAMBER_MOMENT),
            "arithmetic": Found(
                value=unrounded, input=rounded_radius(partial(_eq_7, disc)), reference=CHAMBER_MOMENT
            ),
            "without_plates": found_of(without, "moment", 0)
            .scaled(angle / _eq_7(bare, _radius_by_eq_3(bare)))
            .against(1.0),
        },
        numbers={
            "rounded": rounded,
            "rounding_step": abs(unrounded - rounded),
            "shortfall": 1 - computed.value / CHAMBER_MOMENT.value,
        },
        series=(shown,),
        convergence=(mesh_table(ring, "moment", "kg m", -1),),
        status=ring.status,
    )


def _radius_by_eq_3(disc: Disc, fill: float = 0.5) -> float:
    liquid = 2 * fill * paper.max_liquid_volume_paper(disc=disc)
    return float(paper.surface_radius_paper(disc=disc, liquid_volume=liquid))


def _eq_7(disc: Disc, radius: float) -> float:
    return float(paper.moment_paper(disc=disc, density=DENSITY_KG_M3, surface_radius=radius))


def disc_capacity(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Moment of two adjacent full chambers, from one chamber's by finite elements."""
    printed_scene = at_paper_density(scene)
    both = chamber_moment(printed_scene, density=DENSITY_KG_M3, factor=math.sqrt(2))
    if defect == "plates_left_out":
        both = both.with_correction()
    printed = float(paper.capacity(chamber_moment=CHAMBER_MOMENT.value))
    if defect == "added_as_numbers":
        printed = 2 * CHAMBER_MOMENT.value
    chamber = both.value / math.sqrt(2)
    angle = np.linspace(0, np.pi / 2, 91)
    # Moment that two pairs, each within +-U, can make exactly along a direction.
    largest = chamber / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    shown = figure(
        "balancing ability against its direction",
        ("angle from a chamber's centre line", "rad", angle),
        FigureCurve("found", "kg m", largest),
        FigureCurve("Eq. 8", "kg m", np.full(angle.shape, DISC_MOMENT.value), style="paper"),
    )
    rounding = CHAMBER_MOMENT.uncertainty * math.sqrt(2)
    return Evidence(
        quantities={
            "capacity": both.against(DISC_MOMENT),
            "arithmetic": Found(value=printed, input=rounding, reference=DISC_MOMENT),
        },
        numbers={"guaranteed": chamber},
        series=(shown,),
        status=ring_of(printed_scene, (printed_scene.disc.max_fill_ratio,)).status,
    )


def density(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Moment at densities of one and two grams per millilitre by finite elements."""
    full, twice = (scene.disc.max_fill_ratio,), 2 * DENSITY_KG_M3
    light, dense = (ring_of(scene, full, density=each) for each in (DENSITY_KG_M3, twice))
    capacity = chamber_moment(scene, density=twice, factor=math.sqrt(2))
    if defect == "plates_left_out":
        capacity = capacity.with_correction()
    below, above = (found_of(ring, "moment", 0) for ring in (light, dense))
    ratio = 1.0 if defect == "density_without_effect" else above.value / below.value
    oil = liquid_at(name="perfluorinated oil GPL 101", temperature=293.15).density
    return Evidence(
        quantities={
            "ratio": Found(value=ratio, numerical=ratio * below.numerical / below.value).against(2.0),
            "dense_capacity": capacity.against(DENSE_DISC_MOMENT),
        },
        numbers={"oil_density": oil, "oil_capacity": capacity.value * oil / twice},
        status=dense.status,
    )


def lever_ends(scene: Scene) -> Evidence:
    """lambda at the centre by the closed form."""
    return Evidence(quantities=as_found(central=central_lambda(disc=scene.disc)))


def lever(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """lambda at the centre and over the range by finite elements."""
    fills, middle = np.linspace(0.0, 1.0, 11) * scene.disc.max_fill_ratio, 5
    ring = ring_of(scene, tuple(fills.tolist()))
    bare = central_lambda(disc=with_plate(scene.disc, 0.0))
    central = found_of(ring, "moment_per_volume", middle).scaled(2 / scene.liquid.density)
    moments = ring.moment.value
    opposite = moments[middle] if defect == "opposite_chamber_left_out" else moments[::-1]
    transferred = scene.liquid.density * chamber_volume(disc=scene.disc) * (fills - fills[middle])
    away = transferred != 0
    curve = np.full(fills.shape, central.value)
    np.divide(moments - opposite, transferred, out=curve, where=away)
    claimed = np.full(fills.shape, paper.PAPER_LAMBDA_M)
    shown = figure(
        "moment of a pair per transferred mass",
        ("fill ratio of one chamber", "1", fills),
        FigureCurve("finite elements", "m", curve),
        FigureCurve(
            "72 mm within 0.7 %", "m", claimed, style="paper", uncertainty=LAMBDA_TOLERANCE * claimed
        ),
    )
    return Evidence(
        quantities={
            "central": dataclasses.replace(central, corrected=bare, reference=_PRINTED_LAMBDA),
            "variation": Found(value=float(np.ptp(curve)) / central.value),
        },
        numbers={"bare": bare},
        series=(shown,),
        convergence=(mesh_table(ring, "moment_per_volume", "kg/m^2", middle),),
        status=ring.status,
    )


def correction(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Eq. 22 with Eq. 21's mass, literally and per transferred mass, compared with Eqs. 7 and 8."""
    full = scene.disc.max_fill_ratio
    mass = float(paper.correction_mass(disc=scene.disc, density=DENSITY_KG_M3, fill_ratio=full))
    arm = CHAMBER_MOMENT.value / mass if defect == "lambda_from_eq_7" else paper.PAPER_LAMBDA_M
    chamber, both = (
        abs(complex(paper.correction_moment(real_mass=mass, imaginary_mass=other, moment_per_mass=arm)))
        for other in (0.0, mass)
    )
    exact = float(exact_moment(disc=scene.disc, density=DENSITY_KG_M3, fill_ratio=full))
    table = CaseTable(
        name="balancing ability by each route",
        columns={
            "route": ["Eqs. 7 and 8", "Eqs. 21 and 22, literally", "per transferred mass", "exact"],
            "one chamber": [CHAMBER_MOMENT.value, chamber, chamber / 2, exact],
            "disc": [DISC_MOMENT.value, both, both / 2, math.sqrt(2) * exact],
        },
        units={"one chamber": "kg m", "disc": "kg m"},
    )
    spread = _PRINTED_LAMBDA.uncertainty / _PRINTED_LAMBDA.value
    return Evidence(
        quantities={
            "chamber": Found(value=chamber, input=spread * chamber, reference=CHAMBER_MOMENT),
            "disc": Found(value=both, input=spread * both, reference=DISC_MOMENT),
        },
        numbers={
            "exact": exact,
            "halved": chamber / 2,
            "halved_against_eq_7": chamber / 2 / CHAMBER_MOMENT.value - 1,
            "halved_against_exact": chamber / 2 / exact - 1,
            "literal_over_exact": chamber / exact,
        },
        tables=(table,),
    )
