"""Friction in rectangular ducts, laminar to turbulent, as measured and as predicted."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.validation.comparison import MUTATIONS, beside_judged, friction, measurements

_LAMINAR: Final = 1800.0
_TURBULENT: Final = 4000.0


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    sets = [measurements(name) for name in ("cornish_1928", "huebscher_1947_ducts")]
    if defect == "circular_section":
        sets = [
            replace(each, columns={n: c for n, c in each.columns.items() if n != "aspect_ratio"})
            for each in sets
        ]
    mutation = defect if defect in MUTATIONS else None
    points = friction(*sets, mutation=mutation)
    wide = np.char.find(points.series, "8:1") >= 0
    narrow, reynolds = points.where(~wide), points.columns["reynolds"][~wide]
    whole, laminar, turbulent = (
        part.statistics
        for part in (narrow, narrow.where(reynolds < _LAMINAR), narrow.where(reynolds >= _TURBULENT))
    )
    cornish = friction(sets[0], mutation=mutation)
    return Evidence(
        found=as_found(share_within=whole.share_within, laminar=abs(laminar.bias)),
        numbers={
            **whole.numbers(),
            "laminar_points": float(laminar.points),
            "laminar_bias": laminar.bias,
            "turbulent_points": float(turbulent.points),
            "turbulent_bias": turbulent.bias,
            "turbulent_standard_deviation": turbulent.standard_deviation,
            **beside_judged(narrow, {"wide": points.where(wide)}),
        },
        series=(cornish.over_reynolds("a rectangular duct (2.9 to 1)"),),
    )
