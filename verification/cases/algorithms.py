"""Claims on how fast and how surely the two algorithms balance."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Evidence,
    Found,
    Level,
    Reference,
    Table,
    as_found,
    from_rounding,
)
from ringbalance.verification.loops import (
    AMPLITUDES,
    PERIODS,
    PHASES,
    amplitude_series,
    loop_scene,
    mistaken_lag,
    over_period,
    run_loop,
    runs_with,
    settled_after,
    settling,
    slowest_within,
)
from ringbalance.verification.papers import fig_7_readings

_ABOUT: Final = Reference(value=40.0, uncertainty=from_rounding(10.0))
"""The paper's settling time of the trial algorithm, s."""
_STEPS: Final = {
    "light": ((0.02, 0.05), (0.1, 0.2), (0.003, 0.005), (0.25, 1.0)),
    "heavy": ((0.02, 0.05), (0.1, 0.2), (0.003, 0.005, 0.007), (0.25, 0.5, 1.0)),
}
"""First trial, long step, short step and period, s: each from barely visible to barely below the limit."""
_STEP_NAMES: Final = ("first trial", "long step", "short step", "period")
_BOUND: Final = 5.0
_TRIAL: Final[Mapping[str, Any]] = {"first_trial": 0.02, "long_step": 0.1, "short_step": 0.005}
"""Steps with which the trial algorithm settles at every phase, s."""


def trial_algorithm(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The trial algorithm at four phases over plausible steps and periods.

    Raises: ValueError: no set of steps settles at all phases.
    """
    steps: dict[tuple[float, ...], list[Simulation]] = {}
    for first, long, short, period in itertools.product(*_STEPS[level]):
        steps[first, long, short, period] = runs_with(
            scene,
            kind="trial" if defect is None else "target_vector",
            phases=PHASES,
            periods=(period,),
            first_trial=first,
            long_step=long,
            short_step=short,
        )
    sets = list(steps.values())
    slowest = np.array([max(map(settling, runs)) for runs in sets])
    settled = slowest[np.isfinite(slowest)]
    if not settled.size:
        raise ValueError("no set of steps settles at all four phases")
    fastest, latest = float(settled.min()), float(settled.max())
    counts = [run.misadjustments for runs in sets for run in runs if run.settled]
    own = slowest_within(scene, [run_loop(loop_scene(scene, kind="trial", phase=phase)) for phase in PHASES])
    names = [f"phase {math.degrees(phase):.0f} degrees" for phase in PHASES]
    shown = dict(zip(names, sets[len(sets) // 2], strict=True))
    table = Table(
        name="sets of steps, and the slowest of the four phases",
        columns={
            **{name: [one[i] for one in steps] for i, name in enumerate(_STEP_NAMES)},
            "settled after": [settled_after(runs) for runs in sets],
            "misadjustments": [float(max(run.misadjustments for run in runs)) for runs in sets],
        },
        units=dict.fromkeys((*_STEP_NAMES, "settled after"), "s"),
    )
    return Evidence(
        found={
            "settling_time": Found(value=own).moved(fastest - own, latest - own),
            **as_found(
                phases_settled=max(sum(run.settled for run in runs) for runs in sets),
                misadjustments=min(counts),
            ),
        },
        reference={"settling_time": _ABOUT},
        numbers={
            "settings": float(len(sets)),
            "settling_sets": float(settled.size),
            "other_sets": float(len(sets) - settled.size),
            "time_limit": scene.run.time_limit,
            "fastest": fastest,
            "slowest": latest,
            "fewest": float(min(counts)),
            "most": float(max(counts)),
        },
        series=(amplitude_series("amplitude under the trial algorithm", shown),),
        tables=(table,),
    )


def five_seconds_ends(scene: Scene) -> Evidence:
    """The middle period alone."""
    runs = runs_with(scene, amplitudes=AMPLITUDES, periods=PERIODS[1:2])
    rises = max(run.misadjustments for run in runs)
    return Evidence(found=as_found(settling_time=slowest_within(scene, runs), misadjustments=rises))


def five_seconds(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The target-vector algorithm over amplitudes and periods."""
    given = mistaken_lag(scene) if defect == "lag_angle_wrong" else scene
    runs = {period: runs_with(given, amplitudes=AMPLITUDES, periods=(period,)) for period in PERIODS}
    slowest = [slowest_within(scene, group) for group in runs.values()]
    rises = [max(run.misadjustments for run in group) for group in runs.values()]
    _, bare = fig_7_readings()
    # No longer than it takes to see whether the bound is met.
    brief = dataclasses.replace(bare, run=dataclasses.replace(bare.run, time_limit=2 * _BOUND))
    calibrated = [
        run_loop(loop_scene(brief, kind="target_vector", amplitude=amplitude, period=0.5), "calibrated")
        for amplitude in (AMPLITUDES[0], AMPLITUDES[-1])
    ]
    rows = [
        (period, amplitude, run)
        for period, group in runs.items()
        for amplitude, run in zip(AMPLITUDES, group, strict=True)
    ]
    table = Table(
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
    shown = {f"{a * 1e6:.0f} um": run for a, run in zip(AMPLITUDES, runs[0.5], strict=True)}
    return Evidence(
        found={"settling_time": over_period(slowest), "misadjustments": over_period(rises)},
        numbers={
            "fastest": slowest[0],
            "middle": slowest[1],
            "slowest": slowest[2],
            "rises_slow": float(rises[2]),
            "bore": bare.tube.bore,
            "calibrated_settled": float(sum(settling(run) <= _BOUND for run in calibrated)),
            "calibrated_overshoots": float(sum(run.overshoots for run in calibrated)),
        },
        series=(amplitude_series("amplitude over time, a period of 0.5 s", shown),),
        tables=(table,),
    )


def faster_ends(scene: Scene) -> Evidence:
    """The middle period alone."""
    return Evidence(found=as_found(**_compared(scene, *_at_all_phases(scene, scene, PERIODS[1]))))


def faster(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Both algorithms side by side at four phases and several periods."""
    aimed = mistaken_lag(scene) if defect == "lag_angle_wrong" else scene
    runs = {period: _at_all_phases(aimed, scene, period) for period in PERIODS}
    judged = [_compared(scene, *pair) for pair in runs.values()]
    rows = [
        (period, phase, target, trial)
        for period, both in runs.items()
        for phase, target, trial in zip(PHASES, *both, strict=True)
    ]
    targets, trials = [target for _, _, target, _ in rows], [trial for _, _, _, trial in rows]
    table = Table(
        name="settling times of both algorithms",
        columns={
            "period": [row[0] for row in rows],
            "phase": [row[1] for row in rows],
            "target vector": [settled_after([run]) for run in targets],
            "trial": [settled_after([run]) for run in trials],
            "misadjustments, target vector": [float(run.misadjustments) for run in targets],
            "misadjustments, trial": [float(run.misadjustments) for run in trials],
        },
        units={"period": "s", "phase": "rad", "target vector": "s", "trial": "s"},
    )
    first_phase = {name: runs[PERIODS[1]][i][0] for i, name in enumerate(("target vector", "trial"))}
    return Evidence(
        found={name: over_period([one[name] for one in judged]) for name in judged[0]},
        numbers={
            "periods": float(len(PERIODS)),
            "trial_misadjustments": float(min(run.misadjustments for run in trials)),
        },
        series=(amplitude_series("amplitude, 90 degrees, a period of 0.5 s", first_phase),),
        tables=(table,),
    )


def _at_all_phases(aimed: Scene, scene: Scene, period: float) -> tuple[list[Simulation], list[Simulation]]:
    """Runs under the target-vector and under the trial algorithm."""
    each: dict[str, Any] = {"phases": PHASES, "periods": (period,)}
    return runs_with(aimed, **each), runs_with(scene, kind="trial", **each, **_TRIAL)


def _compared(scene: Scene, target: list[Simulation], trial: list[Simulation]) -> dict[str, float]:
    return {
        "speed_ratio": min(
            slowest_within(scene, [slow]) / slowest_within(scene, [fast])
            for slow, fast in zip(trial, target, strict=True)
        ),
        "largest_rise": max(map(_largest_rise, target)),
        "misadjustments": float(sum(run.misadjustments for run in target)),
    }


def _largest_rise(run: Simulation) -> float:
    """From one amplitude that the controller saw to the next, m."""
    seen = [sample.measurement.amplitude for sample in run.samples if sample.measurement is not None]
    return float(np.max(np.diff(seen), initial=-np.inf)) if len(seen) > 1 else 0.0
