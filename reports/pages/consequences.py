"""What a wrong k costs the machine, as tables of text and one figure, from the evidence's `consequences`."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Table, Work
from ringbalance.reports.studies.consequences import find_consequences
from ringbalance.results.numbers import MISSING, number, percent, short, shown

_MEMBERS: Final = MappingProxyType({"light": 500, "heavy": 20_000})
"""Runs of each ensemble, by level: at 500 a probability is known to about four per cent."""
_COLUMNS: Final = ("the paper’s law", "the calibrated law", "the calibrated law, recommended settings")
_CHANCES: Final = (
    ("not_settled", "not settled by the time limit"),
    ("overshoot", "overshoots"),
    ("misadjustment", "raises the vibration"),
)


def _collect(work: Work) -> Record:
    members = _MEMBERS[work.level]
    tuned = work.tuning.scene if work.tuning.gain else None
    return find_consequences(
        work.scene, work.calibration.model, recommended=tuned, members=members
    ).document()


def _view(found: Record, _evidence: Record) -> Record:
    return {
        "findings": found["findings"][:3],
        "notes": found["notes"],
        "gains": _gain_table(found["gain"]),
        "runs": _run_table(found["runs"]),
        "chances": _chance_table(found["ensembles"]),
        "figure": _gain_margin(found["gain"][-1]) if found["gain"] else None,
    }


def _gain_table(gains: list[Record]) -> Table:
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
    heads = [f"the {g['law']} law".replace("the paper law", "the paper’s law") for g in gains]
    return Table(
        caption="The loop’s gain under both laws. An operation that takes away more than the whole residual "
        "overshoots; more than twice, and the residual grows.",
        heads=("", *heads),
        rows=[(label, *cells) for label, cells in rows],
    )


def _gain(value: float | None) -> str:
    return shown(value, "s/m", digits=3)


def _run_table(runs: list[Record]) -> Table:
    rows = [
        (
            run["title"],
            MISSING if run["proportional_s_per_m"] is None else _gain(run["proportional_s_per_m"]),
            shown(run["settling_time_s"], "s", digits=3) if run["settled"] else run["verdict"],
            *(short(run[key]) for key in ("injections", "overshoots", "misadjustments")),
        )
        for run in runs
    ]
    return Table(
        caption="One run each, with the scene’s noise. The law-based controller computes its valve-open "
        "times from a law and needs no gain.",
        heads=("Run", "Kc", "Within the limit from", "Injections", "Overshoots", "Misadjustments"),
        rows=rows,
        style="",
    )


def _chance_table(ensembles: list[Record]) -> Table:
    chances = [
        (label, *(_chance(ensemble["probability"][key]) for ensemble in ensembles)) for key, label in _CHANCES
    ]
    times = (_times(ensemble["settling_time_s"]["quantiles"]) for ensemble in ensembles)
    members = short(ensembles[0]["members"]) if ensembles else ""
    return Table(
        caption="Probabilities over the uncertainty of k, λ, influence coefficient, lag angle and noise: "
        f"{members} runs each under the flow law alone; 95 % intervals in brackets.",
        heads=("", *_COLUMNS[: len(ensembles)]),
        rows=[*chances, ("half of all runs settled by (5 %; 95 %)", *times)],
        style="",
    )


def _chance(share: Record) -> str:
    return f"{percent(share['value'])} ({percent(share['low'])} to {percent(share['high'])})"


def _times(quantiles: Record | None) -> str:
    if not quantiles or quantiles.get("0.5") is None:
        return MISSING if quantiles is None else "not reached"
    low, middle, high = (
        "not reached" if quantiles[key] is None else shown(quantiles[key], "s", digits=3)
        for key in ("0.05", "0.5", "0.95")
    )
    return f"{middle} ({low}; {high})"


def _gain_margin(gain: Record) -> Drawing:
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
        alt="Gains at which the loop overshoots and at which it is unstable, both growing with k; the "
        f"scene’s gain is {_gain(gain['proportional_s_per_m'])} at k = "
        f"{number(gain['drag_coefficient'], digits=3)}.",
        caption="How much gain the loop bears, over the drag coefficient the tube really has. Lines: one "
        "operation takes away once and twice the residual. Dots: by simulation.",
    )


SECTION: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    collect=_collect,
    show=_view,
)
