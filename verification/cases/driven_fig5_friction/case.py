"""Two friction arms found while both masses go round."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.runs import FigureFive, figure_five
from ringbalance.verification.eccentric_mass.scenes import thinned
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure

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
    pairs = list(zip(found.runs, found.arms, strict=True))
    curves = [
        Curve(f"{1e3 * arm:g} mm, first mass", "m", thinned(run.estimates.friction_arm[shown, 0]))
        for run, arm in pairs
    ]
    count = curves[0].values.size
    true = [
        Curve(f"{1e3 * arm:g} mm, printed", "m", np.full(count, arm), style="reference") for _, arm in pairs
    ]
    when = ("time since the masses started", "s", thinned(time[shown]))
    return figure("friction arm, estimated", when, *curves, *true)
