"""The trial algorithm at four phases over plausible steps and periods."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.controller.simulation import Simulation
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference, Series, Table, from_rounding
from ringbalance.verification.loops import (
    PHASES,
    amplitude_series,
    loop_scene,
    run_loop,
    settled_after,
    settling,
    slowest_within,
)

_TEN_SECONDS: Final = 10.0
_ABOUT: Final = 40.0
_STEPS: Final = {
    "light": ((0.02, 0.05), (0.1, 0.2), (0.003, 0.005), (0.25, 1.0)),
    "heavy": ((0.02, 0.05), (0.1, 0.2), (0.003, 0.005, 0.007), (0.25, 0.5, 1.0)),
}
"""First trial, long step, short step and period, s: each from barely visible to barely below the limit."""


reference = {"settling_time": Reference(value=_ABOUT, uncertainty=from_rounding(_TEN_SECONDS))}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Runs at all phases for every set of steps.

    Raises: ValueError: no set of steps settles at all phases.
    """
    target = defect == "target_vector_instead"
    sets = [_runs(scene, steps, target=target) for steps in itertools.product(*_STEPS[level])]
    slowest = np.array([max(settling(run) for run in runs) for runs in sets])
    settled = slowest[np.isfinite(slowest)]
    if not settled.size:
        raise ValueError("no set of steps settles at all four phases")
    counts = [run.misadjustments for runs in sets for run in runs if run.settled]
    trials = [run_loop(loop_scene(scene, kind="trial", phase=phase)) for phase in PHASES]
    own = slowest_within(scene, trials)
    return Evidence(
        found={
            "settling_time": Found(value=own).moved(float(settled.min()) - own, float(settled.max()) - own),
            "phases_settled": Found(value=float(max(sum(r.settled for r in runs) for runs in sets))),
            "misadjustments": Found(value=float(min(counts))),
        },
        numbers={
            "settings": float(len(sets)),
            "settling_sets": float(settled.size),
            "other_sets": float(len(sets) - settled.size),
            "time_limit": scene.run.time_limit,
            "fastest": float(settled.min()),
            "slowest": float(settled.max()),
            "fewest": float(min(counts)),
            "most": float(max(counts)),
        },
        series=(_figure(sets[len(sets) // 2]),),
        tables=(_table(level, sets),),
    )


def _runs(scene: Scene, steps: Sequence[float], *, target: bool) -> list[Simulation]:
    first, long, short, period = steps
    settings = {"first_trial": first, "long_step": long, "short_step": short, "period": period}
    kind = "target_vector" if target else "trial"
    return [
        run_loop(loop_scene(scene, kind=kind, phase=phase, **settings))  # type: ignore[arg-type]
        for phase in PHASES
    ]


def _figure(runs: Sequence[Simulation]) -> Series:
    names = [f"phase {math.degrees(phase):.0f} degrees" for phase in PHASES]
    return amplitude_series("amplitude under the trial algorithm", dict(zip(names, runs, strict=True)))


def _table(level: Level, sets: Sequence[Sequence[Simulation]]) -> Table:
    steps = list(itertools.product(*_STEPS[level]))
    return Table(
        name="sets of steps, and the slowest of the four phases",
        columns={
            "first trial": [one[0] for one in steps],
            "long step": [one[1] for one in steps],
            "short step": [one[2] for one in steps],
            "period": [one[3] for one in steps],
            "settled after": [settled_after(runs) for runs in sets],
            "misadjustments": [float(max(run.misadjustments for run in runs)) for runs in sets],
        },
        units=dict.fromkeys(("first trial", "long step", "short step", "period", "settled after"), "s"),
    )
