"""lambda at the centre and over the range by finite elements."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.ring import RingQuantities
from ringbalance.reduced_model.paper import PAPER_LAMBDA
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
    figure,
    from_half_width,
    from_rounding,
)
from ringbalance.verification.paper_numbers import LAMBDA_TOLERANCE, with_plate
from ringbalance.verification.reference.exact_chamber import central_lambda
from ringbalance.verification.rings import found_of, mesh_table, ring_of

_SHARES: Final = tuple(np.linspace(0.0, 1.0, 11).tolist())
"""Of the largest fill; the middle one is the centre."""
_CENTRE: Final = 5
_LAST_DIGIT: Final = 1e-3


_STATED: Final = math.hypot(from_half_width(LAMBDA_TOLERANCE * PAPER_LAMBDA), from_rounding(_LAST_DIGIT))
"""Standard uncertainty from the stated error range and the rounding, m."""

reference = {"central": Reference(value=PAPER_LAMBDA, uncertainty=_STATED)}


def values(scene: Scene) -> dict[str, float]:
    return {"central": central_lambda(disc=scene.disc)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    fills = tuple(share * scene.disc.max_fill_ratio for share in _SHARES)
    ring = ring_of(scene, fills)
    per_density = 2 / scene.liquid.density
    bare = central_lambda(disc=with_plate(scene.disc, 0.0))
    by_elements = found_of(ring, "moment_per_volume", _CENTRE).scaled(per_density)
    central = dataclasses.replace(by_elements, corrected=bare)
    curve = _over_range(scene, ring, central.value, alone=defect == "opposite_chamber_left_out")
    return Evidence(
        found={
            "central": central,
            "variation": Found(value=float(np.ptp(curve)) / central.value),
        },
        numbers={"bare": bare},
        series=(_figure(np.array(fills), curve),),
        convergence=(mesh_table(ring, "moment_per_volume", "kg/m^2", _CENTRE),),
        status=ring.status,
    )


def _over_range(scene: Scene, ring: RingQuantities, central: float, *, alone: bool) -> np.ndarray:
    moment = ring.moment.value
    opposite = np.full_like(moment, moment[_CENTRE]) if alone else moment[::-1]
    away = ring.fill_ratio - scene.disc.max_fill_ratio / 2
    away[_CENTRE] = 1.0
    transferred = scene.liquid.density * chamber_volume(disc=scene.disc) * away
    curve = (moment - opposite) / transferred
    curve[_CENTRE] = central
    return np.asarray(curve)


def _figure(fills: np.ndarray, curve: np.ndarray) -> Series:
    claimed = np.full(fills.shape, PAPER_LAMBDA)
    return figure(
        "moment of a pair per transferred mass",
        ("fill ratio of one chamber", "1", fills),
        Curve("finite elements", "m", curve),
        Curve("72 mm within 0.7 %", "m", claimed, style="paper", uncertainty=LAMBDA_TOLERANCE * claimed),
    )
