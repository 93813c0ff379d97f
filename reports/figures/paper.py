"""Figs. 4, 6, 7 and 8 of the liquid-ring paper as this program has them."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record
from ringbalance.results.numbers import given, percent, short, shown

_FLOOR: Final = 5e-9
"""m: smaller amplitudes are drawn here."""


_LINES: Final = {
    "paper_m_s": (style.PAPER, (0, (5, 2)), "Eq. 19, as Fig. 4 has it"),
    "levels_m_s": (style.FOUND, "-", "k = 50, levels by finite elements"),
    "calibrated_m_s": (style.THIRD, "-", "calibrated law"),
}


def paper_figures(found: Record) -> Record:
    """By the names that the section's template has for them."""
    limit = found["limit_m"]
    return {
        "velocity": _figure_4(found["velocity"]),
        "trial": _figure_6(found["trial"], limit),
        "gains": [_figure_7(found["gains"], limit), _figure_7_phase(found["gains"])],
        "amplitudes": _figure_8(found["amplitudes"], limit),
    }


def _figure_4(velocity: list[Record]) -> list[Drawing]:
    """Velocity over the fill at both gas pressures: Eq. 19 against finite elements, and against the law.

    Returns: Two figures: with the paper's k and the finite elements' wall pressures, and with the calibrated
    law.
    """
    falls = "; ".join(_fall(told) for told in velocity)
    return [
        _velocities(
            velocity,
            "levels_m_s",
            name="paper-figure-4",
            caption=f"Fig. 4 again, with the paper’s k. From full to empty the velocity falls {falls}.",
        ),
        _velocities(
            velocity,
            "calibrated_m_s",
            name="paper-figure-4-law",
            caption="The same beside the calibrated law of the tube that had to be assumed, with its 95 % "
            "band: the levels change how far the velocity falls, k how large it is.",
        ),
    ]


def _velocities(velocity: list[Record], other: str, *, name: str, caption: str) -> Drawing:
    def paint(axes: Axes) -> None:
        for index, told in enumerate(velocity):
            fill = np.asarray(told["fill_ratio"])
            for key in ("paper_m_s", other):
                colour, dashes, label = _LINES[key]
                axes.plot(fill, told[key], color=colour, linestyle=dashes, label=None if index else label)
            if other == "calibrated_m_s":
                found, width = (np.asarray(told[k]) for k in (other, "calibrated_uncertainty"))
                style.band(axes, fill, found, width, style.THIRD)
            middle = len(fill) // 2
            axes.annotate(
                given(told["gas_pressure_Pa"], "Pa"),
                (fill[middle], told[other][middle]),
                xytext=(0, 7),
                textcoords="offset points",
                ha="center",
                color=style.MUTED,
            )
        axes.set_xlim(0, fill[-1])
        axes.set_ylim(bottom=0)

    return draw(
        x="fill ratio of the driven chamber",
        y="velocity in the tube in m/s",
        name=name,
        paint=paint,
        alt=f"Velocity over the fill ratio at both gas pressures of Fig. 4: Eq. 19 and {_LINES[other][2]}.",
        caption=caption,
        height=3.4,
    )


def _fall(told: Record) -> str:
    paper, printed, levels, calibrated = (
        percent(told[f"departure_{name}"], digits=3) for name in ("paper", "printed", "levels", "calibrated")
    )
    return (
        f"at {given(told['gas_pressure_Pa'], 'Pa')} by {paper} under Eq. 19 (printed {printed}), "
        f"{levels} with the finite elements’ levels, {calibrated} under the calibrated law"
    )


def _line(index: int, label: str) -> dict[str, Any]:
    return {"label": label, "linewidth": 1.2, **style.line(index, size=2.6)}


def _amplitudes(axes: Axes, runs: list[Record], labels: list[str], limit: float) -> None:
    style.amplitudes(
        axes,
        [
            (run["time_s"], np.maximum(run["amplitude_m"], _FLOOR), _line(index, label))
            for index, (run, label) in enumerate(zip(runs, labels, strict=True))
        ],
        limit,
    )


def _settled(run: Record) -> str:
    return shown(run["settling_time_s"], "s", digits=2) if run["settled"] else "not at all"


def _figure_6(runs: list[Record], limit: float) -> Drawing:
    """The trial algorithm from four phases; limit in m."""
    names = [f"{math.degrees(run['of']):.0f}°" for run in runs]

    def paint(axes: Axes) -> None:
        _amplitudes(axes, runs, names, limit)

    told = ", ".join(f"{_settled(run)} from {name}" for run, name in zip(runs, names, strict=True))
    rises = ", ".join(str(run["misadjustments"]) for run in runs)
    return draw(
        columns=5,
        name="paper-figure-6",
        paint=paint,
        wide=True,
        height=3.4,
        alt=f"Amplitude over time under the trial algorithm from four phases; settled after {told}.",
        caption="Fig. 6 again: the trial algorithm at four phases of the initial vibration. "
        f"Settled after {told}; misadjustments {rises}.",
    )


def _figure_7(runs: list[Record], limit: float) -> Drawing:
    """The target-vector algorithm with five gains: amplitude; limit in m."""
    names = [f"Kp = {run['of'] * 1e-6:.2f}" for run in runs]

    def paint(axes: Axes) -> None:
        _amplitudes(axes, runs, names, limit)

    told = ", ".join(f"{run['overshoots']} at {run['of'] * 1e-6:.2f}" for run in runs)
    return draw(
        columns=3,
        name="paper-figure-7",
        paint=paint,
        height=3.5,
        alt=f"Amplitude at each sample for five gains; overshoots: {told}.",
        caption=f"Fig. 7 again: the target-vector algorithm, proportional part alone, five gains Kp in s/µm. "
        f"Overshoots: {told}.",
    )


def _figure_7_phase(runs: list[Record]) -> Drawing:
    """The same runs: phase."""

    def paint(axes: Axes) -> None:
        for index, run in enumerate(runs):
            line = _line(index, f"Kp = {run['of'] * 1e-6:.2f}")
            axes.plot(run["time_s"], np.degrees(run["phase_rad"]), **line)
        axes.set_ylim(-190, 190)
        axes.set_yticks([-180, -90, 0, 90, 180])
        axes.set_xlim(left=0)
        axes.spines["bottom"].set_color(style.INK)

    loud = [short(run["of"] * 1e-6) for run in runs if run["overshoots"]]
    return draw(
        columns=3,
        x="time in s",
        y="phase in °",
        name="paper-figure-7-phase",
        paint=paint,
        height=3.5,
        alt=f"Phase at each sample for five gains; it flips to the opposite side at Kp of {', '.join(loud)}.",
        caption="Fig. 7 again: phase of the same runs. It drifts while both axes fall together, and flips to "
        f"the opposite side where an operation takes away too much: at Kp of {' and '.join(loud)}.",
    )


def _figure_8(runs: list[Record], limit: float) -> Drawing:
    """The target-vector algorithm with the paper's parameters from five amplitudes; limit in m."""
    names = [given(run["of"], "m") for run in runs]

    def paint(axes: Axes) -> None:
        _amplitudes(axes, runs, names, limit)
        axes.axvline(
            5.0, color=style.INK, linewidth=0.8, linestyle=(0, (5, 2)), label="the paper’s bound, 5 s"
        )
        axes.set_xlim(0, max(5.4, *(run["time_s"][-1] for run in runs)))

    told = ", ".join(f"{_settled(run)} from {name}" for run, name in zip(runs, names, strict=True))
    return draw(
        columns=4,
        name="paper-figure-8",
        paint=paint,
        wide=True,
        height=3.4,
        alt=f"Amplitude over time from five initial amplitudes; settled after {told}.",
        caption="Fig. 8 again: the target-vector algorithm with all three of the paper’s parameters. "
        f"Settled after {told}.",
    )
