"""The run-up, balanced at low speed and locked."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.comparison import from_rounding
from ringbalance.verification.eccentric_mass.runs import amplitude_figure, figure_nine
from ringbalance.verification.evidence import Evidence, Found, Level, Reference

_RPM = 30 / np.pi
_PRINTED = 135.0


reference = {"critical": Reference(value=_PRINTED, uncertainty=from_rounding(1.0))}


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Peaks and critical speeds."""
    found = figure_nine(scene)
    balanced = found.balanced_peak[0] if defect is None else found.locked_peak[0]
    critical, without = _RPM * found.critical_speed, _RPM * found.rotor_critical_speed
    return Evidence(
        found={
            "critical": Found(value=critical, corrected=without),
            "peak": Found(value=balanced / found.locked_peak[0]),
        },
        numbers={
            "locked": found.locked_peak[0],
            "balanced": balanced,
            "peak_speed": _RPM * found.locked_peak[1],
            "without": without,
        },
        series=(
            amplitude_figure(
                "amplitude during the run-up",
                {"locked": found.locked, "balanced at 100 rpm": found.balanced},
                beside="locked",
            ),
        ),
    )
