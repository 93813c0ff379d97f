"""The loop and its tuning: runs under each law and gain, how likely each settles, what a wrong k costs."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.operation import residual_polar, settling_histogram
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.pages.first_page import RETUNED, place_of_run
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.studies.consequences import find_consequences
from ringbalance.reports.summary import runs_settled, tuning_of

_GAINS: Final = {1: "with the scene’s gain", 2: "with the recommended settings"}
"""Titles of the calibrated law's ensembles, by their place in the evidence."""


def _reach(work: Work) -> Record:
    """What a pair cancels at the most, as a vibration; where the first pair's lies, by the sensor's phase."""
    scene, moment = work.scene, work.calibration.residual.usable_pair_moment
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
        "time_limit_s": scene.run.time_limit,
    }


def _loop(found: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"].get("calibrated")
    tuning = tuning_of(evidence)
    reached = tuning.get("fraction_settled") is not None
    return {
        "retuned": place_of_run(evidence, RETUNED),
        "runs_settled": runs_settled(tuning) if reached else "",
        "polar": residual_polar(run, found) if run and found else None,
        "settling": settling_histogram(_samples(found, evidence)) if found else None,
    }


def _samples(found: Record, evidence: Record) -> list[Record]:
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    return [
        {
            "title": title,
            "edges_s": ensembles[place]["settling_time_s"]["edges"],
            "counts": ensembles[place]["settling_time_s"]["counts"],
            "runs": ensembles[place]["members"],
            "not_settled": ensembles[place]["probability"]["not_settled"]["value"],
            "time_limit_s": found["time_limit_s"],
        }
        for place, title in _GAINS.items()
        if place < len(ensembles)
    ]


LOOP: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_loop, always=True
)


_MEMBERS: Final = MappingProxyType({"light": 500, "heavy": 20_000})
"""Runs of each ensemble, by level: at 500 a probability is known to about four per cent."""


def _find(work: Work) -> Record:
    members = _MEMBERS[work.level]
    tuned = work.tuning.scene if work.tuning.gain else None
    return find_consequences(
        work.scene, work.calibration.model, recommended=tuned, members=members
    ).document()


def _consequences(found: Record, _evidence: Record) -> Record:
    return {"figure": _gain_margin(found["gain"][-1]) if found["gain"] else None}


def _gain_margin(gain: Record) -> Drawing:
    """Gains at which the loop starts to overshoot and to be unstable, over the tube's drag coefficient.

    Args: `gain`: one law's entry of `gain`, SI.
    """
    curve = gain["over_drag_coefficient"]
    k = np.asarray(curve["values"])
    lines = (
        ("overshoot_gain", style.FOUND, "overshoot from"),
        ("instability_gain", style.PAPER, "unstable from"),
    )
    scene = gain["proportional_s_per_m"] * 1e-6

    def paint(axes: Axes) -> None:
        for analytic, colour, label in lines:
            axes.plot(k, np.asarray(curve[analytic]) * 1e-6, color=colour, label=label)
        axes.axhline(scene, color=style.MUTED, linewidth=1, linestyle=":", label="Kc in the scene")
        axes.plot(
            [gain["drag_coefficient"]], [scene], "D", color=style.INK, markersize=5, label="this machine"
        )
        values = np.concatenate([np.asarray(curve[name]) * 1e-6 for name, *_ in lines] + [[scene]])
        low, high = values.min() * 0.8, values.max() * 1.25
        style.logarithmic(axes, "x", within=(k[0], k[-1]))
        style.logarithmic(axes, "y", within=(low, high))
        axes.set_ylim(low, high)

    return draw(
        columns=4,
        x="drag coefficient k at equal fills",
        y="Kc in s/µm",
        name="gain-margin",
        paint=paint,
        wide=True,
        height=3.4,
        alt="Gains at which the loop overshoots and at which it is unstable, both growing with k.",
    )


CONSEQUENCES: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    collect=_find,
    show=_consequences,
)
