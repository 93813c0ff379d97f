"""Friction in smooth tubes, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.comparison import Comparison, friction
from ringbalance.verification.validation.kinds import measurements

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0
_SETS: Final = ("stanton_pannell_1914", "stanton_pannell_1914_oil", "huebscher_1947_round", "senecal_1951")


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = _points(defect)
    reynolds, whole = points.columns["reynolds"], points.statistics
    parts = {
        "laminar": points.where(reynolds < _LAMINAR),
        "transitional": points.where((reynolds >= _LAMINAR) & (reynolds < _TURBULENT)),
        "turbulent": points.where(reynolds >= _TURBULENT),
    }
    numbers = whole.numbers()
    for name, part in parts.items():
        numbers |= {f"{name}_{key}": value for key, value in part.statistics.numbers().items()}
    return Evidence(
        found=as_found(share_within=whole.share_within, bias=abs(numbers["turbulent_bias"])),
        numbers=numbers,
        series=(parts["turbulent"].over_reynolds("smooth tubes"),),
    )


def _points(mutation: str | None) -> Comparison:
    """All but McKeon's laminar ones, which their own authors found up to 14 % high."""
    mckeon = measurements("mckeon_2004")
    turbulent = mckeon.where(mckeon.columns["reynolds"] >= _TURBULENT)
    return friction(*map(measurements, _SETS), turbulent, mutation=mutation)
