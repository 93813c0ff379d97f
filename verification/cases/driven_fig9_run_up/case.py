"""The run-up, balanced at low speed and locked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.runs import FigureNine, figure_nine
from ringbalance.verification.eccentric_mass.scenes import envelope, thinned
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Reference, Series

_RPM = 30 / np.pi
_PRINTED = 135.0
_ROUNDED = 0.5 / np.sqrt(3)


def reference(scene: EccentricScene) -> Mapping[str, Reference]:
    """The printed critical speed."""
    return {"critical": Reference(value=_PRINTED, uncertainty=_ROUNDED)}


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
        series=(_figure(found),),
    )


def _figure(found: FigureNine) -> Series:
    return Series(
        name="amplitude during the run-up",
        x=Axis(name="time", unit="s", values=thinned(found.locked.time)),
        y=(
            Curve(name="locked", unit="m", values=envelope(found.locked.amplitude), style="reference"),
            Curve(name="balanced at 100 rpm", unit="m", values=envelope(found.balanced.amplitude)),
        ),
    )
