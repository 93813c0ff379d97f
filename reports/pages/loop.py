"""The loop and its tuning: runs under each law, and how many devices settle by when."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figure import (
    AMPLITUDE,
    AS_PAPER,
    FOUND,
    MUTED,
    REGIME_COLOURS,
    TIME,
    Curve,
    Drawing,
    amplitudes,
    draw,
)
from ringbalance.reports.ring_figures import ring_frames, run_with_injections
from ringbalance.reports.run_figures import early_time, fill_ratios, residual_polar
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.summary import is_papers

_SETTINGS: Final[dict[str, dict[str, Any]]] = {
    "own": {**AS_PAPER, "label": "the scene’s settings"},
    "recommended": {"color": FOUND, "label": "the recommended settings"},
}
_LAWS: Final[dict[str, dict[str, Any]]] = {
    "calibrated": {"color": FOUND, "label": "the calibrated law"},
    "paper": {**AS_PAPER, "label": "the paper’s law"},
}


def _reach(work: Work) -> Record:
    """What a pair cancels at the most, as a vibration; where the first pair's lies, by the sensor's phase."""
    scene, moment = work.ring, work.calibration.residual.usable_pair_moment
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
        "time_limit_s": scene.run.time_limit,
    }


def _loop(own: Record, evidence: Record) -> Record:
    runs, limit = _drawn_runs(evidence), evidence["limit_m"]
    run = runs.get("calibrated")
    disc = (evidence.get("operation") or {}).get("disc")
    return {
        "amplitude": run_with_injections(runs, _LAWS, limit) if runs else None,
        "rings": ring_frames(run, disc) if run and disc else None,
        "laws": list(runs),
        "polar": residual_polar(run, own) if run and own else None,
        "settling": _settling(evidence.get("summary") or {}),
    }


def _drawn_runs(evidence: Record) -> dict[str, Record]:
    """By law, the calibrated one first; the paper's law is compared on the paper's own disc alone."""
    runs = evidence["closed_loop"]
    return {law: runs[law] for law in _LAWS if law in runs and (law != "paper" or is_papers(evidence))}


def _settling(found: Record) -> Drawing | None:
    """Fraction of drawn devices that has settled by a time, with its bounds; None where none settles."""
    judged = {name: found[name]["settled"] for name in _SETTINGS if found.get(name)}
    if not any(each["time_s"] for each in judged.values()):
        return None

    def paint(axes: Axes) -> None:
        for name, each in judged.items():
            look = _SETTINGS[name]
            time, low, high = each["time_s"], each["low"], each["high"]
            axes.step(time, 100 * np.asarray(each["value"]), where="post", **look)
            axes.fill_between(
                time,
                100 * np.asarray(low),
                100 * np.asarray(high),
                step="post",
                color=look["color"],
                alpha=0.2,
                linewidth=0,
            )
        asked = (found["recommended"] or found["own"])["asked"]
        axes.axhline(100 * asked, color=MUTED, linewidth=1, linestyle=":", label="asked")

    return draw(
        "settling",
        paint,
        x=TIME,
        y=("settled devices in %", "1"),
        xlim=(0, None),
        ylim=(0, 105),
        columns=3,
        wide=True,
    )


LOOP: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_loop, always=True
)


def _injections(_own: Record, evidence: Record) -> Record:
    runs = evidence["closed_loop"]
    if not (run := runs.get("calibrated")):
        return {"early": None}
    until = early_time(next(iter(runs.values())))
    return {
        "early": _early_amplitude(runs, evidence["limit_m"], until),
        "fills": fill_ratios(run, until),
        "regimes": _regimes(run) if run["injections"] else None,
    }


def _early_amplitude(runs: Mapping[str, Record], limit: float, until: float) -> Drawing:
    """Vibration amplitude within the first operations, m, liquid flowing, under the laws that were run."""

    def of(run: Record, look: dict[str, Any]) -> Curve:
        early = np.asarray(run["time_s"]) <= until
        time, values = (np.asarray(run[key])[early] for key in ("time_s", "amplitude_m"))
        return time, values, {**look, "linewidth": 1.3}

    return draw(
        "amplitude-early",
        amplitudes([of(runs[name], look) for name, look in _LAWS.items() if name in runs], limit),
        x=TIME,
        y=AMPLITUDE,
        xlim=(0, until),
        columns=3,
    )


def _regimes(run: Record) -> Drawing:
    """The regime of the tube in every gas operation of a run, by chamber and time."""
    operations, letters = run["injections"], list(run["fill_ratio"])
    last = max(item["time_s"] + item["duration_s"] for item in operations)
    least = 0.006 * last
    named: set[str] = set()

    def bar(axes: Axes, item: Record, regime: str, share: tuple[float, float]) -> None:
        width = max(item["duration_s"], least)
        axes.barh(
            letters.index(item["chamber"]),
            width * (share[1] - share[0]),
            left=item["time_s"] + width * share[0],
            height=0.55,
            color=REGIME_COLOURS[regime],
            linewidth=0,
            label=None if regime in named else regime,
        )
        named.add(regime)

    def paint(axes: Axes) -> None:
        for item in operations:
            start, end = item["regime"], item.get("regime_end") or item["regime"]
            parts = [(start, (0.0, 1.0))] if end == start else [(start, (0.0, 0.5)), (end, (0.5, 1.0))]
            for regime, share in parts:
                bar(axes, item, regime, share)
        axes.set_yticks(range(len(letters)), letters)

    return draw(
        "loop-regimes",
        paint,
        x=TIME,
        y=("gas into chamber", "1"),
        xlim=(0, 1.02 * (last + least)),
        ylim=(len(letters) - 0.5, -0.5),
        columns=4,
        wide=True,
        height=1.5 + 0.2 * len(letters),
    )


INJECTIONS: Final = Section(
    name="injections", title="The closed loop, injection by injection", show=_injections
)
