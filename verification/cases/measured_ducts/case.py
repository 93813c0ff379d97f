"""Friction in rectangular ducts, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.model_bias import MUTATIONS, ModelStatistics
from ringbalance.verification.validation.tube_friction import FrictionPoints, friction_points

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = friction_points("cornish_1928", "huebscher_1947_ducts")
    factor = MUTATIONS.get(defect, 1.0)
    wide = np.char.find(points.series, "8:1") >= 0
    narrow = points.where(~wide)
    cornish = narrow.where(np.char.find(narrow.series, "cornish") >= 0)
    whole, laminar, turbulent, wide_duct = (
        _statistics(part, factor, defect)
        for part in (
            narrow,
            narrow.where(narrow.reynolds < _LAMINAR),
            narrow.where(narrow.reynolds >= _TURBULENT),
            points.where(wide),
        )
    )
    return Evidence(
        found=as_found(share_within=whole.share_within, laminar=abs(laminar.bias)),
        numbers={
            **whole.numbers(),
            "laminar_points": float(laminar.points),
            "laminar_bias": laminar.bias,
            "turbulent_points": float(turbulent.points),
            "turbulent_bias": turbulent.bias,
            "turbulent_standard_deviation": turbulent.standard_deviation,
            "wide_points": float(wide_duct.points),
            "wide_bias": wide_duct.bias,
            "wide_share": wide_duct.share_within,
        },
        series=(cornish.figure("a rectangular duct (2.9 to 1)", factor * cornish.predicted()),),
    )


def _statistics(points: FrictionPoints, factor: float, defect: str | None) -> ModelStatistics:
    if defect == "circular_section":
        points = replace(points, laminar_ratio=np.ones_like(points.reynolds))
    return points.statistics(factor * points.predicted())
