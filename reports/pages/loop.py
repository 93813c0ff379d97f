"""The loop and its tuning: runs under each law, and how many devices settle by when."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    MUTED,
    TIME,
    Drawing,
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
            time, value, low, high = (np.array(each[key]) for key in ("time_s", "value", "low", "high"))
            axes.step(time, value, where="post", **look)
            axes.fill_between(time, low, high, step="post", color=look["color"], alpha=0.2, linewidth=0)
        asked = (found["recommended"] or found["own"])["asked"]
        axes.axhline(asked, color=MUTED, linewidth=1, linestyle=":", label="asked")
        axes.yaxis.set_major_formatter(PercentFormatter(1, symbol=""))

    return draw(
        "settling",
        paint,
        x=TIME,
        y=("settled devices in %", "1"),
        xlim=(0, None),
        ylim=(0, 1.05),
        columns=3,
        wide=True,
    )


LOOP: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_loop, always=True
)


def _injections(_own: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"].get("calibrated")
    return {"fills": fill_ratios(run, early_time(run)) if run else None}


INJECTIONS: Final = Section(
    name="injections", title="The closed loop, injection by injection", show=_injections
)
