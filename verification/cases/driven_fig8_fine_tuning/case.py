"""Masses ten degrees beside their targets, then tuned by trial."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.cases.driven_fig7_positioning.case import BalancingFigure
from ringbalance.verification.evidence import Evidence, Level, as_found

_TIME = {None: 200.0, "tuning_given_up": 25.0}
"""s."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Amplitudes after positioning and after fine tuning."""
    found = BalancingFigure.eight(scene, time_limit=_TIME[defect])
    left = np.divide(found.positioned, found.before)
    ended = np.divide(found.after, found.before)
    settled = [run.settling_time or run.time[-1] for run in found.runs]
    return Evidence(
        found=as_found(left=left.min(), ended=ended.max()),
        numbers={"left_m": min(found.positioned), "end": max(found.after), "time": float(max(settled))},
        series=(found.amplitudes(),),
    )
