"""Friction in smooth tubes, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.identification.kinds.kind import Observations
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.comparison import Comparison, beside_judged, friction, measurements

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0
_CRITICAL: Final = 2300.0
"""Up to which McKeon's readings go on as in laminar flow."""
_SETS: Final = ("stanton_pannell_1914", "stanton_pannell_1914_oil", "huebscher_1947_round", "senecal_1951")


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = _points(defect)
    reynolds, whole = points.columns["reynolds"], points.statistics
    parts = {
        "laminar": points.where(reynolds < _LAMINAR),
        "transitional": points.where((reynolds >= _LAMINAR) & (reynolds < _TURBULENT)),
        "turbulent": points.where(reynolds >= _TURBULENT),
    }
    numbers = whole.numbers() | beside_judged(points, _left_out())
    for name, part in parts.items():
        numbers |= {f"{name}_{key}": value for key, value in part.statistics.numbers().items()}
    return Evidence(
        found=as_found(share_within=whole.share_within, bias=abs(numbers["turbulent_bias"])),
        numbers=numbers,
        series=(parts["turbulent"].over_reynolds("smooth tubes"),),
    )


def _points(mutation: str | None) -> Comparison:
    """All but McKeon's below Re 4000: the laminar ones their own authors found up to 14 % high."""
    return friction(*map(measurements, _SETS), _mckeon(_TURBULENT, np.inf), mutation=mutation)


def _left_out() -> dict[str, Comparison]:
    return {
        "mckeon_laminar": friction(_mckeon(0.0, _CRITICAL)),
        "mckeon_transition": friction(_mckeon(_CRITICAL, _TURBULENT)),
    }


def _mckeon(low: float, high: float) -> Observations:
    data = measurements("mckeon_2004")
    reynolds = data.columns["reynolds"]
    return data.where((reynolds >= low) & (reynolds < high))
