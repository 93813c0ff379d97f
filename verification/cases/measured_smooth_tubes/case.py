"""Friction in smooth tubes, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.model_bias import MUTATIONS
from ringbalance.verification.validation.tube_friction import FrictionPoints, friction_points, joined

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = _points()
    factor = MUTATIONS[defect]
    flow = {
        "laminar": points.reynolds < _LAMINAR,
        "transitional": (points.reynolds >= _LAMINAR) & (points.reynolds < _TURBULENT),
        "turbulent": points.reynolds >= _TURBULENT,
    }
    parts = {name: points.where(chosen) for name, chosen in flow.items()}
    statistics = {name: part.statistics(factor * part.predicted()) for name, part in parts.items()}
    turbulent, whole = parts["turbulent"], points.statistics(factor * points.predicted())
    numbers = whole.numbers()
    for name, one in statistics.items():
        numbers |= {f"{name}_{key}": float(value) for key, value in vars(one).items()}
    return Evidence(
        found=as_found(share_within=whole.share_within, bias=abs(statistics["turbulent"].bias)),
        numbers=numbers,
        series=(turbulent.figure("smooth tubes", factor * turbulent.predicted()),),
    )


def _points() -> FrictionPoints:
    """All but McKeon's laminar ones, which their own authors found up to 14 % high."""
    others = friction_points(
        "stanton_pannell_1914", "stanton_pannell_1914_oil", "huebscher_1947_round", "senecal_1951"
    )
    mckeon = friction_points("mckeon_2004")
    turbulent = mckeon.where(mckeon.reynolds >= _TURBULENT)
    return joined(others, turbulent)
