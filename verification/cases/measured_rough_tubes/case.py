"""Friction in tubes roughened with sand, as measured and as predicted."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Series, as_found
from ringbalance.verification.validation.model_bias import MUTATIONS
from ringbalance.verification.validation.tube_friction import FrictionPoints, friction_points

_FULLY_ROUGH: Final = 70.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    points = friction_points("nikuradse_1933")
    predicted = _predicted(points, defect)
    statistics = points.statistics(predicted)
    grain = points.reynolds * np.sqrt(points.friction / 8) * points.relative_roughness
    deviation = predicted / points.friction - 1
    rough = points.where(grain > _FULLY_ROUGH).statistics(predicted[grain > _FULLY_ROUGH])
    return Evidence(
        found=as_found(share_within=statistics.share_within, fully_rough=abs(rough.bias)),
        numbers={
            **statistics.numbers(),
            "worst": float(np.max(deviation)),
            "rough_points": float(rough.points),
            "rough_bias": rough.bias,
            "rough_standard_deviation": rough.standard_deviation,
        },
        series=tuple(
            _figure(points, predicted, wall) for wall in np.unique(points.relative_roughness)[[0, -1]]
        ),
    )


def _predicted(points: FrictionPoints, defect: str | None) -> FloatArray:
    if defect == "roughness_ignored":
        smooth = np.zeros_like(points.relative_roughness)
        return dataclasses.replace(points, relative_roughness=smooth).predicted()
    return MUTATIONS[defect] * points.predicted()


def _figure(points: FrictionPoints, predicted: FloatArray, wall: float) -> Series:
    here = points.relative_roughness == wall
    return points.where(here).figure(f"a tube with ks/d = {wall:.2g}", predicted[here])
