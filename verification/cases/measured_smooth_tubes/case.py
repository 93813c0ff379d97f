"""Friction in smooth tubes, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.validation.model_bias import statistics_numbers
from ringbalance.verification.validation.tube_friction import FrictionPoints, friction_points

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = _points()
    factor = 1.1 if defect == "ten_per_cent_high" else 1.0
    flow = {
        "laminar": points.reynolds < _LAMINAR,
        "transitional": (points.reynolds >= _LAMINAR) & (points.reynolds < _TURBULENT),
        "turbulent": points.reynolds >= _TURBULENT,
    }
    parts = {name: points.where(chosen) for name, chosen in flow.items()}
    statistics = {name: part.statistics(factor * part.predicted()) for name, part in parts.items()}
    whole = points.statistics(factor * points.predicted())
    numbers = statistics_numbers(whole)
    for name, one in statistics.items():
        numbers |= {f"{name}_{key}": float(value) for key, value in vars(one).items()}
    return Evidence(
        found={
            "share_within": Found(value=whole.share_within),
            "bias": Found(value=abs(statistics["turbulent"].bias)),
        },
        numbers=numbers,
        series=(_figure(parts["turbulent"], factor),),
    )


def _points() -> FrictionPoints:
    """All but McKeon's laminar ones, which their own authors found up to 14 % high."""
    others = friction_points(
        "stanton_pannell_1914", "stanton_pannell_1914_oil", "huebscher_1947_round", "senecal_1951"
    )
    mckeon = friction_points("mckeon_2004")
    turbulent = mckeon.where(mckeon.reynolds >= _TURBULENT)
    joined = FrictionPoints(
        **{name: np.concatenate([column, getattr(turbulent, name)]) for name, column in vars(others).items()}
    )
    return joined.where(np.argsort(joined.reynolds, kind="stable"))


def _figure(points: FrictionPoints, factor: float) -> Series:
    return figure(
        "friction factor of smooth tubes, measured and predicted",
        ("Reynolds number", "1", points.reynolds),
        Curve("predicted", "1", factor * points.predicted(), uncertainty=points.stated()),
        Curve("measured", "1", points.friction, style="points"),
        log=True,
    )
