"""Times in which gas vessels fill and vent, as measured and as predicted."""

from __future__ import annotations

import dataclasses

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.validation.comparison import compare, data_evidence
from ringbalance.verification.validation.measurements import measurements


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    sets = [measurements(name) for name in ("thorncroft_2007", "hydrogen_vessels")]
    found = data_evidence(*sets, unit="s", mutation=defect)
    dense = compare(measurements("haque_1992")).statistics
    more = {"dense_points": float(dense.points), "dense_within": dense.share_within}
    return dataclasses.replace(found, numbers={**found.numbers, **more})
