"""Tuning of eccentric masses: the sampled loops of their drives, and the settling times with sound gains."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from ringbalance.controller.eccentric_mass.devices import device
from ringbalance.controller.eccentric_mass.loop_rows import (
    loops_document,
    loops_quantities,
    loops_status,
    loops_table,
)
from ringbalance.controller.eccentric_mass.plan import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, advised
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.tuning.settling import QUANTILES, Progress, SettlingTimes, summary
from ringbalance.results.result import Result, Rows
from ringbalance.results.rows import Finding
from ringbalance.scene.draws import run_noise

RUNS: Final = 40
FIRST_RUNS: Final = 16
"""Of these come first; more only where their 95 % interval leaves it open that 95 % of them settle."""
_LONGER: Final = 2.0
"""Times what half of the runs take: for so long all run first, and to the end where they have not settled."""


@dataclass(frozen=True, kw_only=True)
class _EccentricSettling:
    """Settling with the recommended gains, over the stated uncertainty and the sensors' noise."""

    times: SettlingTimes
    span: float
    """s, of a run at most: until the speed changes, or the scene's time limit."""
    outcomes: Mapping[str, int]
    """Number of runs by how they ended."""
    advice: str
    """Status of one run that ended in the most frequent way without settling; empty: all settled."""


@dataclass(frozen=True, kw_only=True, repr=False)
class EccentricTuning(Result):
    """What is recommended for the drives of eccentric masses."""

    scene: EccentricScene
    """As given."""
    gains: RecommendedGains
    tuned: Mapping[str, float]
    """Keys that the runs had lowered or raised to the recommended value, SI."""
    settling: _EccentricSettling | None
    """None: not asked for, or the masses are locked."""

    def to_dict(self) -> dict[str, Any]:
        """The loops of the drives and the settling times in SI; null: not reached."""
        return _document(self)

    def rows(self) -> Rows:
        """The loops of the drives, and the settling times."""
        return _rows(self)

    @property
    def recommended_scene(self) -> EccentricScene:
        """The scene with the values that the runs had, checked, with a hash of its own."""
        return self.scene.with_values(self.tuned, origin="inferred")

    @property
    def succeeded(self) -> bool:
        """Whether 95 % of the runs settle; without runs, whether the scene's loops are stable."""
        if self.settling is None:
            return all(loop.stable for loop in self.gains.loops)
        return self.settling.times.quantiles["p95"] is not None

    @property
    def status(self) -> str:
        """Whether the loops have their margin and the runs settle, and what to change."""
        loops = loops_status(self.gains)
        tuned = f"tuned: {loops}" if loops.startswith("every") else loops
        return "; ".join(text for text in (tuned, _of_runs(self.settling)) if text)


def tune_eccentric(
    scene: EccentricScene, *, runs: int = RUNS, told: Progress | None = None
) -> EccentricTuning:
    """Judge the loops of a scene's drives, and let it settle many times with what is recommended.

    Args: `runs`: at the most; 0 judges the loops alone.
    """
    gains = RecommendedGains.of(scene)
    ready, changes = advised(scene, gains)
    settling = None
    if runs and scene.supervisor.strategy != "locked":
        settling = _eccentric_settling(ready, runs=runs, told=told or (lambda _: None))
    return EccentricTuning(
        scene=scene,
        gains=gains,
        tuned=changes,
        settling=settling,
    )


def _eccentric_settling(scene: EccentricScene, *, runs: int, told: Progress) -> _EccentricSettling:
    """Run a scene with its plant drawn from the stated uncertainty; the strategy keeps the scene's values.

    Few runs first, and more where these leave it open that 95 % settle.
    """
    span = scene.steady_until or scene.run.time_limit
    done: list[EccentricRun] = []
    # A mass that is balanced rests: what has settled by an early end is still so later.
    short = span
    for number in range(runs):
        told(f"run {number + 1}")
        done.append(_drawn_run(scene, number, spans=(short, span)))
        short = min(_until_rest(done), span)
        if number + 1 == min(FIRST_RUNS, runs) and _times(done).settled.high < QUANTILES["p95"]:
            break
    return _EccentricSettling(
        times=_times(done),
        span=span,
        outcomes=dict(Counter(run.outcome.value for run in done).most_common()),
        advice=_advice(done),
    )


def _drawn_run(scene: EccentricScene, number: int, *, spans: Sequence[float]) -> EccentricRun:
    """Args: `spans`: s, tried in turn until the run settles."""
    settings, plant = StrategySettings.of(scene), device(scene, number).scene
    for span in dict.fromkeys(spans):
        limited = replace(plant, run=replace(plant.run, time_limit=span))
        run = simulate_eccentric(limited, seed=run_noise(scene.run.seed, number), settings=settings)
        if run.settled:
            break
    return run


def _until_rest(done: list[EccentricRun]) -> float:
    """Time, s, within which most runs like those that have settled will have settled as well."""
    last = STAGE_NAMES[Stage.REST]
    rests = [s.start for run in done if run.settled for s in run.stages if s.name == last]
    return _LONGER * statistics.median(rests) if rests else math.inf


def _times(done: list[EccentricRun]) -> SettlingTimes:
    return summary([math.inf if run.settling_time is None else run.settling_time for run in done])


def _advice(done: list[EccentricRun]) -> str:
    failed = [run for run in done if not run.settled]
    if not failed:
        return ""
    usual = Counter(run.outcome for run in failed).most_common(1)[0][0]
    return next(run.status for run in failed if run.outcome is usual)


def _of_runs(settling: _EccentricSettling | None) -> str:
    if settling is None:
        return ""
    times = settling.times
    slow = times.quantiles["p95"]
    if slow is not None:
        return f"95 % of {times.runs} runs settle within {slow:.3g} s"
    return (
        f"{times.told(times.settled.value)} settle within {settling.span:.4g} s: 95 % is not "
        f"reached; most of the others: {settling.advice}"
    )


def _document(tuning: EccentricTuning) -> dict[str, Any]:
    scene, gains = tuning.scene, tuning.gains
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        **loops_document(gains),
        "status": tuning.status,
        "tuned": dict(tuning.tuned),
        "drawn": [each.quantity for each in scene.uncertainty],
        **_settling_document(tuning.settling),
        **tuning.rows().document(),
    }


def _settling_document(settling: _EccentricSettling | None) -> dict[str, Any]:
    if settling is None:
        return {}
    times = settling.times
    return {
        "settling_time_s": times.quantiles,
        "fraction_settled": times.settled.value,
        "fraction_settled_95": [times.settled.low, times.settled.high],
        "runs": times.runs,
        "span_s": settling.span,
        "outcomes": dict(settling.outcomes),
    }


def _rows(tuning: EccentricTuning) -> Rows:
    scene, gains, settling = tuning.scene, tuning.gains, tuning.settling
    drawn = ", ".join(each.quantity for each in scene.uncertainty) or "nothing, the scene states none"
    return Rows(
        title=f"Tuning of {scene.name} ({scene.source}), eccentric masses",
        quantities=(*loops_quantities(gains), *(() if settling is None else settling.times.quantities())),
        findings=(
            Finding(
                code="tuned" if tuning.succeeded else "not_tuned",
                values={"text": tuning.status},
                change=dict(tuning.tuned),
            ),
        ),
        facts=() if settling is None else (("drawn from their uncertainty", drawn),),
        tables=(loops_table(gains),),
    )
