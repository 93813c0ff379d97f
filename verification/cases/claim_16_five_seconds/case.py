"""The target-vector algorithm over amplitudes and periods."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table
from ringbalance.verification.loops import (
    AMPLITUDES,
    PERIODS,
    amplitude_series,
    loop_scene,
    mistaken_lag,
    over_period,
    run_loop,
    settled_after,
    settling,
    slowest_within,
)
from ringbalance.verification.paper_numbers import fig_7_readings

_BOUND: Final = 5.0


def values(scene: Scene) -> dict[str, float]:
    runs = _runs(scene, PERIODS[1])
    rises = max(run.misadjustments for run in runs)
    return {"settling_time": slowest_within(scene, runs), "misadjustments": rises}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = mistaken_lag(scene) if defect == "lag_angle_wrong" else scene
    runs = {period: _runs(given, period) for period in PERIODS}
    slowest = [slowest_within(scene, group) for group in runs.values()]
    rises = [max(run.misadjustments for run in group) for group in runs.values()]
    _, bare = fig_7_readings()
    calibrated = _short_runs(bare)
    return Evidence(
        found={
            "settling_time": over_period(slowest),
            "misadjustments": over_period(rises),
        },
        numbers={
            "fastest": slowest[0],
            "middle": slowest[1],
            "slowest": slowest[2],
            "rises_slow": float(rises[2]),
            "bore": bare.tube.bore,
            "calibrated_settled": float(sum(settling(run) <= _BOUND for run in calibrated)),
            "calibrated_overshoots": float(sum(run.overshoots for run in calibrated)),
        },
        series=(
            amplitude_series(
                "amplitude over time, a period of 0.5 s",
                {f"{a * 1e6:.0f} um": run for a, run in zip(AMPLITUDES, runs[0.5], strict=True)},
            ),
        ),
        tables=(_table(runs),),
    )


def _runs(scene: Scene, period: float) -> list[Simulation]:
    return [
        run_loop(loop_scene(scene, kind="target_vector", amplitude=amplitude, period=period))
        for amplitude in AMPLITUDES
    ]


def _short_runs(scene: Scene) -> list[Simulation]:
    """Under the calibrated law, no longer than it takes to see whether the bound is met."""
    brief = dataclasses.replace(scene, run=dataclasses.replace(scene.run, time_limit=2 * _BOUND))
    return [
        run_loop(loop_scene(brief, kind="target_vector", amplitude=amplitude, period=0.5), "calibrated")
        for amplitude in (AMPLITUDES[0], AMPLITUDES[-1])
    ]


def _table(runs: Mapping[float, list[Simulation]]) -> Table:
    rows = [
        (period, a, run) for period, group in runs.items() for a, run in zip(AMPLITUDES, group, strict=True)
    ]
    return Table(
        name="target-vector algorithm with the paper's parameters and law",
        columns={
            "period": [period for period, _, _ in rows],
            "amplitude": [amplitude for _, amplitude, _ in rows],
            "settled after": [settled_after([run]) for _, _, run in rows],
            "misadjustments": [float(run.misadjustments) for _, _, run in rows],
            "overshoots": [float(run.overshoots) for _, _, run in rows],
        },
        units={"period": "s", "amplitude": "m", "settled after": "s"},
    )
