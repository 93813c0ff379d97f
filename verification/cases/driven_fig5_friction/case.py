"""Two friction arms found while both masses go round."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.eccentric_scenes import at_constant_speed, changed, convergence_time, thinned
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure

_BEFORE, _AFTER = 0.1, 0.6
"""Shown around the beginning of the friction stage, s."""
_PAPER_ARMS = (0.01, 0.005)
"""Of Fig. 5, m."""
_CONVERGED = 0.05
"""Relative error of the friction arm within which its estimate has converged."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Errors of the friction arms and the time they take."""
    runs = friction_runs(scene)
    wrong = 1.1 if defect == "another_friction" else 1.0
    errors = [np.max(np.abs(run.estimates.friction_arm[-1] / (wrong * arm) - 1)) for arm, run in runs.items()]
    slowest = max(friction_time(run, arm) for arm, run in runs.items())
    return Evidence(found=as_found(error=max(errors), slowest=slowest), series=(_figure(runs),))


def friction_runs(scene: EccentricScene, *, time_limit: float = 12.0) -> Mapping[float, EccentricRun]:
    """Runs by their true friction arm, m. Source: Fig. 5 of the paper on eccentric masses."""
    level = at_constant_speed(scene, time_limit=time_limit)
    return {a: simulate_eccentric(changed(level, "masses", friction_arm=(a, a))) for a in _PAPER_ARMS}


def friction_time(run: EccentricRun, arm: float) -> float:
    """From the beginning of the friction stage until both estimates keep within 5 %, s."""
    begun = [stage.start for stage in run.stages if stage.name == "friction estimation"]
    if not begun:
        return math.inf
    error = np.max(np.abs(run.estimates.friction_arm - arm), axis=1) / arm
    return convergence_time(run.time, error, limit=_CONVERGED) - begun[0]


def _figure(runs: Mapping[float, EccentricRun]) -> Series:
    first = runs[_PAPER_ARMS[0]]
    begun = next(s.start for s in first.stages if s.name == "friction estimation")
    time = first.time - begun
    shown = (time > -_BEFORE) & (time < _AFTER)
    curves = [
        Curve(f"{1e3 * arm:g} mm, first mass", "m", thinned(run.estimates.friction_arm[shown, 0]))
        for arm, run in runs.items()
    ]
    count = curves[0].values.size
    true = [Curve(f"{1e3 * arm:g} mm, printed", "m", np.full(count, arm), style="reference") for arm in runs]
    when = ("time since the masses started", "s", thinned(time[shown]))
    return figure("friction arm, estimated", when, *curves, *true)
