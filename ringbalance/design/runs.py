"""Closed-loop runs of one point over random devices, by the `Balancer` of its scene."""

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
"""Number of devices after which a design is dropped if none of them meets the requirements.

If 7 of 10 devices meet them, that happens once in a hundred times.  Runs that do not settle take longest.
"""
_FIRST_LOOK_TIME: Final = 2.0
"""Length of the runs of the first look over the required settling time; later settling is too late anyway."""
_SECOND_LOOK_DEVICES: Final = 16
"""Number of devices after which the verdict on most other designs is known."""


def run_row(scene: SceneFile, point: Point, runs: int) -> Record:
    """Run random devices of a point with the settings of its scene; plain data.

    Args: `runs`: largest number of devices; doubled from 16 until the verdict is known; only 4 if none of
        these meets the requirements.
    Returns: `devices` run, `fraction` that meets all requirements of the scene, `low` and `high`
        (Wilson, 95 %), `verdict`, `settling_time` within which the required fraction has settled, s, and
        `settling_time_high`, its upper bound (both None if too few settle), `ended` (devices by outcome),
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
