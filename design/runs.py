"""Closed-loop runs of one point over drawn devices, through the `Balancer` of its scene."""

from __future__ import annotations

from collections import Counter
from typing import Final

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.design.axes import Point
from ringbalance.design.static import EMPTY, FAULTS, REFUSED, Record, point_scene, refusal
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

_FIRST: Final = 16
"""Devices after which the verdict of most designs is known."""


def run_row(scene: SceneFile, point: Point, runs: int) -> Record:
    """What drawn devices of a point come to under the settings of its scene, plain data.

    Args: `runs`: devices at most; they are doubled from 16 until the verdict is known.
    Returns: `devices` that were run, `fraction` that meets all that the scene requires, `low` and `high`
        (Wilson, 95 %), `verdict`, `settling_time` within which the fraction asked for has settled, s, and
        `settling_time_high`, its upper bound (both None where too few settle), `ended` (devices by code),
        `finding`.
    """
    try:
        balancer = balancer_of(point_scene(scene, point))
        (judgement,) = judged_all(balancer, [{}], first=min(_FIRST, runs), most=runs, whole=False)
    except (SceneError, *FAULTS) as error:
        return {**EMPTY, "verdict": REFUSED, "finding": refusal(error)}
    time, high = judgement.settling_time(judgement.asked) or (None, None)
    return {
        "devices": judgement.fraction.of,
        "fraction": judgement.fraction.value,
        "low": judgement.fraction.low,
        "high": judgement.fraction.high,
        "verdict": judgement.verdict,
        "settling_time": time,
        "settling_time_high": high,
        "ended": dict(Counter(judgement.outcomes.ended)),
        "finding": None,
    }
