"""Overshoots of the target-vector algorithm over the integral time."""

from __future__ import annotations

from typing import Final

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.loops import (
    AMPLITUDES,
    GAINS,
    PERIODS,
    overshooting,
    runs_with,
)

_SET: Final = 48.0
"""The paper's 0.8 min, s."""
_SMALL: Final = 1.2
_TIMES: Final = (None, _SET, 6.0, _SMALL, 0.3)


def values(scene: Scene) -> dict[str, float]:
    return {
        "fraction_small": overshooting(_runs(scene, _SMALL)),
        "fraction_set": overshooting(_runs(scene, _SET)),
    }


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    small = None if defect == "integral_left_out" else _SMALL
    runs = {time: _runs(scene, time) for time in _TIMES}
    return Evidence(
        found=as_found(fraction_small=overshooting(runs[small]), fraction_set=overshooting(runs[_SET])),
        numbers={
            "runs": len(runs[_SET]),
            "periods": len(PERIODS),
            "most": max(run.overshoots for run in runs[_TIMES[-1]]),
        },
        tables=(
            Table(
                name="overshoots over the integral time, Kp = 0.08 s/um",
                columns={
                    "integral time": ["none" if time is None else time for time in _TIMES],
                    "runs that overshoot": [overshooting(group) for group in runs.values()],
                    "most in one run": [float(max(r.overshoots for r in group)) for group in runs.values()],
                },
                units={"integral time": "s"},
            ),
        ),
    )


def _runs(scene: Scene, integral_time: float | None) -> list[Simulation]:
    return runs_with(
        scene,
        amplitudes=AMPLITUDES[::2],
        proportional=GAINS[1],
        integral_time=integral_time,
        derivative_time=0.0,
    )
