"""Friction in tubes roughened with sand, as measured and as predicted."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.comparison import Comparison, beside_judged, friction, measurements

_FULLY_ROUGH: Final = 70.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = _points(defect)
    wall, statistics = points.columns["relative_roughness"], points.statistics
    grain = points.columns["reynolds"] * np.sqrt(points.measured / 8) * wall
    rough = points.where(grain > _FULLY_ROUGH).statistics
    return Evidence(
        found=as_found(share_within=statistics.share_within, fully_rough=abs(rough.bias)),
        numbers={
            **statistics.numbers(),
            **beside_judged(points),
            "worst": float(np.max(points.predicted / points.measured - 1)),
            "rough_points": float(rough.points),
            "rough_bias": rough.bias,
            "rough_standard_deviation": rough.standard_deviation,
        },
        series=tuple(
            points.where(wall == one).over_reynolds(f"a tube with ks/d = {one:.2g}")
            for one in np.unique(wall)[[0, -1]]
        ),
    )


def _points(defect: str | None) -> Comparison:
    data = measurements("nikuradse_1933")
    if defect != "roughness_ignored":
        return friction(data, mutation=defect)
    smooth = {**data.columns, "relative_roughness": np.zeros(len(data))}
    return replace(friction(data), predicted=friction(replace(data, columns=smooth)).predicted)
