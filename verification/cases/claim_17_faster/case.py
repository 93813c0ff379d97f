"""Both algorithms side by side at four phases and several periods."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Table
from ringbalance.verification.loops import (
    PHASES,
    amplitude_series,
    loop_scene,
    mistaken_lag,
    run_loop,
    sampled_amplitudes,
    settling,
)

_PERIODS: Final = (0.25, 0.5, 1.0)
_TRIAL: Final = {"first_trial": 0.02, "long_step": 0.1, "short_step": 0.005}
"""Steps with which the trial algorithm settles at every phase, s."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    pairs = [(period, phase) for period in _PERIODS for phase in PHASES]
    aimed = mistaken_lag(scene) if defect == "lag_angle_wrong" else scene
    target = [_run(aimed, "target_vector", *pair) for pair in pairs]
    trial = [_run(scene, "trial", *pair, **_TRIAL) for pair in pairs]
    longest = scene.run.time_limit
    ratio = [
        min(settling(slow), longest) / min(settling(fast), longest)
        for slow, fast in zip(trial, target, strict=True)
    ]
    middle = len(PHASES)
    return Evidence(
        found={
            "speed_ratio": Found(value=min(ratio)),
            "largest_rise": Found(value=max(_largest_rise(run) for run in target)),
            "misadjustments": Found(value=float(sum(run.misadjustments for run in target))),
        },
        numbers={
            "periods": float(len(_PERIODS)),
            "trial_misadjustments": float(min(run.misadjustments for run in trial)),
        },
        series=(
            amplitude_series(
                "amplitude, 90 degrees, a period of 0.5 s",
                {"target vector": target[middle], "trial": trial[middle]},
            ),
        ),
        tables=(_table(pairs, target, trial),),
    )


def _run(scene: Scene, kind: Any, period: float, phase: float, **settings: float) -> Simulation:
    return run_loop(loop_scene(scene, kind=kind, phase=phase, period=period, **settings))


def _largest_rise(run: Simulation) -> float:
    amplitude = sampled_amplitudes(run)
    return float(np.max(np.diff(amplitude), initial=-np.inf)) if amplitude.size > 1 else 0.0


def _table(pairs: list[tuple[float, float]], target: list[Simulation], trial: list[Simulation]) -> Table:
    def times(runs: list[Simulation]) -> list[float | str]:
        return [run.settling_time if run.settling_time is not None else "not settled" for run in runs]

    return Table(
        name="settling times of both algorithms",
        columns={
            "period": [period for period, _ in pairs],
            "phase": [phase for _, phase in pairs],
            "target vector": times(target),
            "trial": times(trial),
            "misadjustments, target vector": [float(run.misadjustments) for run in target],
            "misadjustments, trial": [float(run.misadjustments) for run in trial],
        },
        units={"period": "s", "phase": "rad", "target vector": "s", "trial": "s"},
    )
