"""Overshoot of the target-vector algorithm over Kp, and the rule behind it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from typing import Final

import numpy as np

from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference, Table, from_range
from ringbalance.verification.loops import (
    GAINS,
    amplitude_series,
    flow_law_of,
    loop_scene,
    run_loop,
    settled_after,
)
from ringbalance.verification.paper_numbers import fig_7_readings

_SEARCHED: Final = tuple((np.arange(2, 41) * 0.01e6).tolist())
_LAST_WITHOUT: Final = 0.12e6
_FIRST_WITH: Final = 0.16e6


_BETWEEN: Final = (_LAST_WITHOUT, _FIRST_WITH)

reference = {
    "onset": Reference(value=sum(_BETWEEN) / 2, uncertainty=from_range(_BETWEEN)),
    "overshoot_turn": Reference(value=math.pi),
}


def values(scene: Scene) -> dict[str, float]:
    return {"onset": _onset(scene)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    runs = {gain: _run(scene, gain) for gain in GAINS}
    rate = _rate(scene, paper_model(scene))
    _, bare = fig_7_readings()
    calibrated = _rate(bare, BalancerModel.of(flow_law_of(bare)))
    onset = _onset(scene)
    return Evidence(
        found={
            "onset": Found(value=onset),
            "overshoot_turn": _turn(scene),
        },
        numbers={
            "rate_um": rate * 1e6,
            "bore": bare.tube.bore,
            "calibrated_rate_um": calibrated * 1e6,
            "onset_rule": 1e-6 / rate,
            "onset_um": onset * 1e-6,
            "onset_with_integral": _onset(scene, alone=False) * 1e-6,
            "calibrated_onset": 1e-6 / calibrated,
        },
        series=(
            amplitude_series(
                "amplitude over Kp", {f"Kp = {gain * 1e-6:.2f} s/um": run for gain, run in runs.items()}
            ),
        ),
        tables=(_table(runs),),
    )


def _run(scene: Scene, gain: float, *, alone: bool = True) -> Simulation:
    time = None if alone else scene.controller.integral_time
    return run_loop(loop_scene(scene, kind="target_vector", proportional=gain, integral_time=time))


def _onset(scene: Scene, *, alone: bool = True) -> float:
    """Smallest searched Kp at which the residual turns round; the largest searched one where none does."""

    def turns(gain: float) -> bool:
        return _run(scene, gain, alone=alone).overshoots > 0

    if alone:
        # A larger gain never overshoots less, so halving finds what trying one after the other would.
        return float(_SEARCHED[min(bisect_left(_SEARCHED, True, key=turns), len(_SEARCHED) - 1)])
    return float(next(filter(turns, _SEARCHED), _SEARCHED[-1]))


def _rate(scene: Scene, model: BalancerModel) -> float:
    """Fall of the vibration per second of gas into one chamber at equal fills, m/s."""
    middle = model.flow.max_fill_ratio / 2
    step = 1e-3 * middle
    velocity = float(model.flow.evaluate(fill_ratio=middle, gas_pressure=scene.gas.pressure).velocity)
    moments = model.moment.pair_moment(
        fill_ratio=np.array([middle + step, middle - step]),
        opposite_fill_ratio=np.array([middle - step, middle + step]),
    )
    per_fill = float(moments[0] - moments[1]) / (2 * step)
    fills_per_second = velocity * model.tube_area / model.chamber_volume
    return scene.rotor.influence_coefficient * per_fill * fills_per_second


def _turn(scene: Scene) -> Found:
    """The vibration along a chamber's own axis, so that a single valve answers for the overshoot."""
    phase = -scene.rotor.lag_angle
    run = run_loop(
        loop_scene(scene, kind="target_vector", proportional=GAINS[-1], integral_time=None, phase=phase)
    )
    seen = [sample.measurement for sample in run.samples if sample.measurement is not None]
    turn = abs(math.remainder(seen[1].phase - seen[0].phase, 2 * math.pi))
    return Found(value=turn, numerical=1e-9)


def _table(runs: Mapping[float, Simulation]) -> Table:
    return Table(
        name="target-vector algorithm, proportional part alone, 10 micrometres at 90 degrees",
        columns={
            "Kp": list(runs),
            "overshoots": [float(run.overshoots) for run in runs.values()],
            "misadjustments": [float(run.misadjustments) for run in runs.values()],
            "settled after": [settled_after([run]) for run in runs.values()],
        },
        units={"Kp": "s/m", "settled after": "s"},
    )
