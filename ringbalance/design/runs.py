"""Closed-loop runs of one point over drawn devices, through the `Balancer` of its scene."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import Final

from ringbalance.controller.balancer import quick_balancer
from ringbalance.controller.judging.judge import judged_all
from ringbalance.design.axes import Point
from ringbalance.design.static import BREAKDOWNS, EMPTY, REFUSED, Record, refusal
from ringbalance.results.requirements import OPEN
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

_FIRST_LOOK_DEVICES: Final = 4
"""Devices after which a design is left if none of them meets the requirements: where 7 of 10 do, that happens
once in a hundred times.  Runs that do not settle take longest."""
_FIRST_LOOK_TIME: Final = 2.0
"""End of the runs of the first look over the required settling time: later none of them meets it."""
_SECOND_LOOK_DEVICES: Final = 16
"""Devices after which the verdict of most other designs is known."""


def run_row(scene: SceneFile, point: Point, runs: int) -> Record:
    """Run drawn devices of a point under the settings of its scene; plain data.

    Args: `runs`: devices at most; they are doubled from 16 until the verdict is known, and only 4 run where
        none of these meets the requirements.
    Returns: `devices` that were run, `fraction` that meets all requirements of the scene, `low` and `high`
        (Wilson, 95 %), `verdict`, `settling_time` within which the required fraction has settled, s, and
        `settling_time_high`, its upper bound (both None where too few settle), `ended` (devices by code),
        `finding`.
    """
    try:
        balancer = quick_balancer(scene.with_values(point))
        judge = partial(judged_all, balancer, [{}], complete=False)
        until = _FIRST_LOOK_TIME * balancer.demands()[0].required
        (judgement,) = judge(most=min(_FIRST_LOOK_DEVICES, runs), deadline=until)
        if judgement.fraction.count or judgement.verdict == OPEN:
            (judgement,) = judge(first=min(_SECOND_LOOK_DEVICES, runs), most=runs)
    except (SceneError, *BREAKDOWNS) as error:
        return {**EMPTY, "verdict": REFUSED, "finding": refusal(error)}
    time, high = judgement.settling_time(judgement.required_fraction) or (None, None)
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
