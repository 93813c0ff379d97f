"""Settling time of the target-vector algorithm over Kp."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.loops import GAINS, PERIODS, runs_with, slowest_within

_RAISED: Final = GAINS[:3]


def values(scene: Scene) -> dict[str, float]:
    return {"least_ratio": float(np.min(_ratios(_times(scene, _RAISED))))}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    times = _times(scene, GAINS)
    return Evidence(
        found=as_found(least_ratio=np.min(_ratios(times[: len(_RAISED)]))),
        numbers={"periods": len(PERIODS), "beyond": float(np.max(times[-1] / times[-2]))},
        tables=(
            Table(
                name="settling time, proportional part alone, 10 micrometres at 90 degrees",
                columns={"Kp": GAINS}
                | {f"period {period:g} s": times[:, i].tolist() for i, period in enumerate(PERIODS)},
                units={"Kp": "s/m"} | {f"period {period:g} s": "s" for period in PERIODS},
            ),
        ),
    )


def _times(scene: Scene, gains: tuple[float, ...]) -> FloatArray:
    """Settling time, s, shape (gains, periods); the phase of the start makes no difference to this law."""
    return np.array(
        [
            [
                slowest_within(scene, [run])
                for run in runs_with(scene, proportional=gain, integral_time=None, derivative_time=0.0)
            ]
            for gain in gains
        ]
    )


def _ratios(times: FloatArray) -> FloatArray:
    return np.asarray(times[:-1] / times[1:], dtype=np.float64)
