"""Eq. 22 with Eq. 21's mass, literally and per transferred mass, beside Eqs. 7 and 8."""

from __future__ import annotations

import math

from ringbalance.reduced_model.paper import PAPER_LAMBDA, correction_mass, correction_moment
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Table, from_half_width, from_rounding
from ringbalance.verification.paper_numbers import CHAMBER_MOMENT, DENSITY, DISC_MOMENT, LAMBDA_TOLERANCE
from ringbalance.verification.reference.exact_chamber import exact_moment

_LAMBDA_DIGIT = 1e-3


reference = {"chamber": CHAMBER_MOMENT.reference, "disc": DISC_MOMENT.reference}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    full = scene.disc.max_fill_ratio
    mass = float(correction_mass(disc=scene.disc, density=DENSITY, fill_ratio=full))
    lever = CHAMBER_MOMENT.value / mass if defect == "lambda_from_eq_7" else PAPER_LAMBDA
    chamber = abs(complex(correction_moment(real_mass=mass, imaginary_mass=0.0, moment_per_mass=lever)))
    both = abs(complex(correction_moment(real_mass=mass, imaginary_mass=mass, moment_per_mass=lever)))
    exact = float(exact_moment(disc=scene.disc, density=DENSITY, fill_ratio=full))
    numbers = {
        "exact": exact,
        "halved": chamber / 2,
        "halved_against_eq_7": chamber / 2 / CHAMBER_MOMENT.value - 1,
        "halved_against_exact": chamber / 2 / exact - 1,
        "literal_over_exact": chamber / exact,
    }
    return Evidence(
        found={"chamber": _found(chamber), "disc": _found(both)},
        numbers=numbers,
        tables=(_table(chamber, both, exact),),
    )


def _found(moment: float) -> Found:
    """Literal moment with the spread that lambda is claimed to have."""
    relative = math.hypot(from_half_width(LAMBDA_TOLERANCE), from_rounding(_LAMBDA_DIGIT) / PAPER_LAMBDA)
    return Found(value=moment, input=relative * moment)


def _table(chamber: float, both: float, exact: float) -> Table:
    return Table(
        name="balancing ability by each route",
        columns={
            "route": ["Eqs. 7 and 8", "Eqs. 21 and 22, literally", "per transferred mass", "exact"],
            "one chamber": [CHAMBER_MOMENT.value, chamber, chamber / 2, exact],
            "disc": [DISC_MOMENT.value, both, both / 2, math.sqrt(2) * exact],
        },
        units={"one chamber": "kg m", "disc": "kg m"},
    )
