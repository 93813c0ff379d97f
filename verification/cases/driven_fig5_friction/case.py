"""Two friction arms found while both masses go round."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.runs import FigureFive, figure_five
from ringbalance.verification.eccentric_mass.scenes import thinned
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Series

_BEFORE, _AFTER = 0.1, 0.6
"""Shown around the beginning of the friction stage, s."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Errors of the friction arms and the time they take."""
    found = figure_five(scene)
    wrong = 1.1 if defect == "another_friction" else 1.0
    last = [run.estimates.friction_arm[-1] for run in found.runs]
    error = max(float(np.max(np.abs(a / (wrong * arm) - 1))) for a, arm in zip(last, found.arms, strict=True))
    return Evidence(
        found={"error": Found(value=error), "slowest": Found(value=max(found.time_to_converge))},
        series=(_figure(found),),
    )


def _figure(found: FigureFive) -> Series:
    begun = next(s.start for s in found.runs[0].stages if s.name == "friction estimation")
    time = found.runs[0].time - begun
    shown = (time > -_BEFORE) & (time < _AFTER)
    curves = [
        Curve(
            name=f"{1e3 * arm:g} mm, first mass",
            unit="m",
            values=thinned(run.estimates.friction_arm[shown, 0]),
        )
        for run, arm in zip(found.runs, found.arms, strict=True)
    ]
    count = curves[0].values.size
    true = [
        Curve(name=f"{1e3 * arm:g} mm, printed", unit="m", values=np.full(count, arm), style="reference")
        for arm in found.arms
    ]
    return Series(
        name="friction arm, estimated",
        x=Axis(name="time since the masses started", unit="s", values=thinned(time[shown])),
        y=(*curves, *true),
    )
