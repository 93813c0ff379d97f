"""Overshoots and settling time of the target-vector algorithm over the derivative time."""

from __future__ import annotations

from typing import Final

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.loops import (
    AMPLITUDES,
    GAINS,
    overshooting,
    runs_with,
    slowest_within,
)

_OWN: Final = 0.06
"""The paper's 0.001 min, s."""
_TIMES: Final = (0.0, _OWN, 10 * _OWN, 100 * _OWN)
_INTEGRAL: Final = 48.0
"""The paper's 0.8 min, s."""


def values(scene: Scene) -> dict[str, float]:
    without, _, tenfold, hundredfold = (overshooting(_runs(scene, time)) for time in _TIMES)
    return {"extra_tenfold": tenfold - without, "extra_hundredfold": hundredfold - without}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    groups = [_runs(scene, time) for time in _TIMES]
    without, own, tenfold, hundredfold = fractions = list(map(overshooting, groups))
    longest = [slowest_within(scene, group) for group in groups]
    last = tenfold if defect == "hundredfold_left_out" else hundredfold
    return Evidence(
        found=as_found(extra_tenfold=tenfold - without, extra_hundredfold=last - without),
        numbers={
            "runs": len(groups[0]),
            "without": without,
            "own": own,
            "tenfold": tenfold,
            "hundredfold": hundredfold,
            "slower": longest[-1] / longest[0],
        },
        tables=(
            Table(
                name="overshoots over the derivative time, Kp = 0.08 s/um",
                columns={
                    "derivative time": _TIMES,
                    "runs that overshoot": fractions,
                    "longest settling time": longest,
                },
                units={"derivative time": "s", "longest settling time": "s"},
            ),
        ),
    )


def _runs(scene: Scene, derivative_time: float) -> list[Simulation]:
    return runs_with(
        scene,
        amplitudes=AMPLITUDES,
        proportional=GAINS[1],
        integral_time=_INTEGRAL,
        derivative_time=derivative_time,
    )
