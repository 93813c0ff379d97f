"""What a wrong k costs the machine, as tables of text and one figure, from the evidence's `consequences`."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.studies.consequences import find_consequences

_MEMBERS: Final = MappingProxyType({"light": 500, "heavy": 20_000})
"""Runs of each ensemble, by level: at 500 a probability is known to about four per cent."""


def _collect(work: Work) -> Record:
    members = _MEMBERS[work.level]
    tuned = work.tuning.scene if work.tuning.gain else None
    return find_consequences(
        work.scene, work.calibration.model, recommended=tuned, members=members
    ).document()


def _view(found: Record, _evidence: Record) -> Record:
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


SECTION: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    collect=_collect,
    show=_view,
)
