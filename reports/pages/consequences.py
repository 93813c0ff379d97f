"""What a wrong k costs the machine, as tables of text and one figure, from the evidence's `consequences`."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import MISSING, number, percent, short, shown
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Section

Record = dict[str, Any]

_TICKS: Final = [step * 10.0**exponent for exponent in range(-4, 5) for step in (1, 2, 5)]
_COLUMNS: Final = ("the paper’s law", "the calibrated law", "the calibrated law, gain re-tuned")
_CHANCES: Final = (
    ("not_settled", "does not settle in time"),
    ("overshoot", "overshoots"),
    ("misadjustment", "raises the vibration"),
)


def consequence_view(found: Record | None) -> Record | None:
    """The section on consequences, every number already text.

    Returns: `findings`, `notes`, `gains`, `runs`, `chances` and `figure`; None where there is nothing to
    show.
    """
    if not found:
        return None
    return {
        "findings": [typeset(text) for text in found["findings"][:3]],
        "notes": [typeset(text) for text in found["notes"]],
        "gains": _gain_table(found["gain"]),
        "runs": [_run_row(run) for run in found["runs"]],
        "chances": _chance_table(found["ensembles"]),
        "figure": gain_margin(found["gain"][-1]) if found["gain"] else None,
    }


def _gain_table(gains: list[Record]) -> Record:
    rows = (
        (
            "k at equal fills, as Eq. 18 reads the velocity",
            [number(g["drag_coefficient"], digits=3) for g in gains],
        ),
        ("velocity at equal fills", [shown(g["velocity_m_s"], "m/s", digits=3) for g in gains]),
        ("λ per transferred mass", [shown(g["moment_per_transferred_mass_m"], "m", digits=3) for g in gains]),
        (
            "amplitude taken away per second of gas",
            [shown(g["slope_m_per_s"], "m", digits=3) for g in gains],
        ),
        ("share that one operation takes away", [percent(g["gain_per_operation"], digits=3) for g in gains]),
        ("Kc in the scene", [_gain(g["proportional_s_per_m"]) for g in gains]),
        ("overshoot from Kc", [_gain(g["overshoot_proportional_s_per_m"]) for g in gains]),
        ("unstable from Kc", [_gain(g["instability_proportional_s_per_m"]) for g in gains]),
    )
    return {
        "heads": [f"the {g['law']} law".replace("the paper law", "the paper’s law") for g in gains],
        "rows": [{"label": label, "cells": cells} for label, cells in rows],
    }


def _gain(value: float | None) -> str:
    return shown(value, "s/m", digits=3)


def _run_row(run: Record) -> Record:
    return {
        "title": typeset(run["title"]),
        "gain": MISSING if run["proportional_s_per_m"] is None else _gain(run["proportional_s_per_m"]),
        "settled": shown(run["settling_time_s"], "s", digits=3) if run["settled"] else "does not settle",
        "operations": short(run["operations"]),
        "overshoots": short(run["overshoots"]),
        "misadjustments": short(run["misadjustments"]),
    }


def _chance_table(ensembles: list[Record]) -> Record:
    rows = [
        {"label": label, "cells": [_chance(e["probability"][key]) for e in ensembles]}
        for key, label in _CHANCES
    ]
    times = [_times(e["settling_time_s"]["quantiles"]) for e in ensembles]
    return {
        "heads": _COLUMNS[: len(ensembles)],
        "rows": [*rows, {"label": "settling time, median (5 % to 95 %)", "cells": times}],
        "members": short(ensembles[0]["members"]) if ensembles else "",
    }


def _chance(share: Record) -> str:
    return f"{percent(share['value'])} ({percent(share['low'])} to {percent(share['high'])})"


def _times(quantiles: Record | None) -> str:
    if not quantiles or quantiles.get("0.5") is None:
        return MISSING if quantiles is None else "not reached"
    low, middle, high = (
        "not reached" if quantiles[key] is None else shown(quantiles[key], "s", digits=3)
        for key in ("0.05", "0.5", "0.95")
    )
    return f"{middle} ({low} to {high})"


def gain_margin(gain: Record) -> Drawing:
    """Gains at which the loop starts to overshoot and to be unstable, over the tube's drag coefficient.

    Args: `gain`: one law's entry of `gain`, SI.
    """
    curve = gain["over_drag_coefficient"]
    k, seen = np.asarray(curve["values"]), np.asarray(curve["simulated_values"])
    lines = (
        ("overshoot_gain", "simulated_overshoot_gain", style.FOUND, "overshoot from"),
        ("instability_gain", "simulated_instability_gain", style.PAPER, "unstable from"),
    )
    scene = gain["proportional_s_per_m"] * 1e-6

    def paint(axes: Axes) -> None:
        for analytic, simulated, colour, label in lines:
            axes.plot(k, np.asarray(curve[analytic]) * 1e-6, color=colour, label=label)
            axes.plot(seen, np.asarray(curve[simulated], dtype=float) * 1e-6, "o", color=colour, markersize=4)
        axes.axhline(scene, color=style.MUTED, linewidth=1, linestyle=":", label="Kc in the scene")
        axes.plot(
            [gain["drag_coefficient"]], [scene], "D", color=style.INK, markersize=5, label="this machine"
        )
        values = np.concatenate([np.asarray(curve[name]) * 1e-6 for name, *_ in lines] + [[scene]])
        low, high = values.min() * 0.8, values.max() * 1.25
        style.logarithmic(axes, "x", ticks=[tick for tick in _TICKS if k[0] <= tick <= k[-1]])
        style.logarithmic(axes, "y", ticks=[tick for tick in _TICKS if low <= tick <= high])
        axes.set_ylim(low, high)

    return draw(
        columns=4,
        x="drag coefficient k at equal fills",
        y="Kc in s/µm",
        name="gain-margin",
        paint=paint,
        wide=True,
        height=3.4,
        alt="Gains at which the loop overshoots and at which it is unstable, both growing with k; the "
        f"scene’s gain is {_gain(gain['proportional_s_per_m'])} at k = "
        f"{number(gain['drag_coefficient'], digits=3)}.",
        caption="How much gain the loop bears, over the drag coefficient the tube really has. Lines: one "
        "operation takes away once and twice the residual. Dots: by simulation.",
    )


SECTION: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    view=lambda evidence: consequence_view(evidence.get("consequences")),
)
