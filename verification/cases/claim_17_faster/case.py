"""Both algorithms side by side at four phases and several periods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table
from ringbalance.verification.loops import (
    PERIODS,
    PHASES,
    amplitude_series,
    loop_scene,
    mistaken_lag,
    over_period,
    run_loop,
    settled_after,
    slowest_within,
)

_TRIAL: Final = {"first_trial": 0.02, "long_step": 0.1, "short_step": 0.005}
"""Steps with which the trial algorithm settles at every phase, s."""


def values(scene: Scene) -> dict[str, float]:
    return _judged(scene, *_runs(scene, scene, PERIODS[1]))


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    aimed = mistaken_lag(scene) if defect == "lag_angle_wrong" else scene
    runs = {period: _runs(aimed, scene, period) for period in PERIODS}
    judged = [_judged(scene, *pair) for pair in runs.values()]
    middle_target, middle_trial = runs[PERIODS[1]]
    return Evidence(
        found={name: over_period([one[name] for one in judged]) for name in judged[0]},
        numbers={
            "periods": float(len(PERIODS)),
            "trial_misadjustments": float(
                min(run.misadjustments for _, trial in runs.values() for run in trial)
            ),
        },
        series=(
            amplitude_series(
                "amplitude, 90 degrees, a period of 0.5 s",
                {"target vector": middle_target[0], "trial": middle_trial[0]},
            ),
        ),
        tables=(_table(runs),),
    )


def _runs(aimed: Scene, scene: Scene, period: float) -> tuple[list[Simulation], list[Simulation]]:
    """Runs at every phase under the target-vector and under the trial algorithm."""
    target = [_run(aimed, "target_vector", period, phase) for phase in PHASES]
    return target, [_run(scene, "trial", period, phase, **_TRIAL) for phase in PHASES]


def _judged(scene: Scene, target: list[Simulation], trial: list[Simulation]) -> dict[str, float]:
    return {
        "speed_ratio": min(
            slowest_within(scene, [slow]) / slowest_within(scene, [fast])
            for slow, fast in zip(trial, target, strict=True)
        ),
        "largest_rise": max(map(_largest_rise, target)),
        "misadjustments": float(sum(run.misadjustments for run in target)),
    }


def _run(scene: Scene, kind: Any, period: float, phase: float, **settings: float) -> Simulation:
    return run_loop(loop_scene(scene, kind=kind, phase=phase, period=period, **settings))


def _largest_rise(run: Simulation) -> float:
    """From one amplitude that the controller saw to the next, m."""
    seen = [sample.measurement.amplitude for sample in run.samples if sample.measurement is not None]
    return float(np.max(np.diff(seen), initial=-np.inf)) if len(seen) > 1 else 0.0


def _table(runs: Mapping[float, tuple[list[Simulation], list[Simulation]]]) -> Table:
    rows = [
        (period, phase, target, trial)
        for period, both in runs.items()
        for phase, target, trial in zip(PHASES, *both, strict=True)
    ]

    return Table(
        name="settling times of both algorithms",
        columns={
            "period": [period for period, _, _, _ in rows],
            "phase": [phase for _, phase, _, _ in rows],
            "target vector": [settled_after([target]) for _, _, target, _ in rows],
            "trial": [settled_after([trial]) for _, _, _, trial in rows],
            "misadjustments, target vector": [float(target.misadjustments) for _, _, target, _ in rows],
            "misadjustments, trial": [float(trial.misadjustments) for _, _, _, trial in rows],
        },
        units={"period": "s", "phase": "rad", "target vector": "s", "trial": "s"},
    )
