"""Pressure over whole tubes in laminar flow, as measured and as predicted."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

from ringbalance.identification.kinds.bench import tube_numbers
from ringbalance.identification.kinds.kind import Observations
from ringbalance.scene.arrays import BoolArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.validation.comparison import beside_judged, compare, data_evidence, measurements

CALIBRATING: Final = (
    "tube 1 (bore)",
    "tube 2 (bore)",
    "tube 3 (bore)",
    "tube 4 (bore)",
    "tube 5 (bore)",
    "cut (bore)",
)
"""Points of Eisenklam that gave the bore of their tube, and are not judged."""
_DEVELOPED: Final = 0.0125
"""L/(d Re) from which an undeveloped profile was expected to cost no more than the interval of the outlet."""
_CONTRADICTED: Final = 1.5e5
"""Pressure, Pa, below which the cut tube contradicts the others."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    data = measurements("eisenklam_1958")
    taught, contradicted, developed = _kinds(data)
    usable = ~taught & ~contradicted
    judged = data.where(usable & developed)
    found = data_evidence(judged, unit="Pa", mutation=defect)
    left_out = {
        "contradicted": compare(data.where(contradicted)),
        "short": compare(data.where(usable & ~developed)),
    }
    uncut = compare(data.where(usable & np.char.startswith(data.series, "tube")))
    more = {
        **beside_judged(compare(judged, mutation=defect), left_out, taught=int(taught.sum())),
        "laminar_points": found.numbers["points"],
        "long_worst": float(np.max(np.abs(uncut.predicted / uncut.measured - 1))),
    }
    return dataclasses.replace(found, numbers={**found.numbers, **more})


def _kinds(data: Observations) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Points that taught a bore, those that contradict others, and those where flow could develop."""
    taught = np.isin(data.series, CALIBRATING)
    cut = np.char.startswith(data.series, "cut")
    contradicted = cut & (data.columns["pressure"] < _CONTRADICTED)
    reynolds, slenderness = tube_numbers(data)
    return taught, contradicted & ~taught, slenderness >= _DEVELOPED * reynolds
