"""Figures of one closed-loop run of a liquid ring, from its document in SI."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.loop import early_time, fill_ratios
from ringbalance.reports.figures.operation import residual_polar
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import shown
from ringbalance.reports.section import Record


def run_figures(run: Record) -> list[Drawing]:
    """Amplitude with its limit, valve-open times, fills, and the path of the residual vector."""
    times = [_valve_open_times(run)] if run["injections"] else []
    return [_run_amplitude(run), *times, fill_ratios(run, early_time({"run": run})), residual_polar(run)]


def _run_amplitude(run: Record) -> Drawing:
    """True and measured vibration amplitude over time, m, with the limit."""
    seen = [
        (time, value)
        for time, value in zip(run["samples"]["time_s"], run["samples"]["amplitude_m"], strict=True)
        if value is not None
    ]
    time, measured = np.array(seen, dtype=np.float64).reshape(-1, 2).T
    dots = {"color": style.PAPER, "linestyle": "", "marker": "o", "markersize": 2.5, "label": "measured"}
    line = {"color": style.FOUND, "linewidth": 1.2, "label": "true"}

    def paint(axes: Axes) -> None:
        curves = [(run["time_s"], np.asarray(run["amplitude_m"]), line), (time, measured, dots)]
        style.amplitudes(axes, curves, run["limit_m"])

    end = shown(run["amplitude_m"][-1], "m", digits=2)
    return draw(
        name="run-amplitude",
        paint=paint,
        columns=3,
        wide=True,
        height=3.2,
        alt=f"Vibration amplitude against time on a logarithmic scale; it ends at {end}.",
        caption=f"Vibration amplitude and its limit. It ends at {end}.",
    )


def _valve_open_times(run: Record) -> Drawing:
    """How long each injection keeps its valve open, s, by chamber, over the time at which it opens."""
    injections = run["injections"]

    def paint(axes: Axes) -> None:
        for index, letter in enumerate(run["fill_ratio"]):
            mine = [item for item in injections if item["chamber"] == letter]
            axes.plot(
                [item["time_s"] for item in mine],
                [item["duration_s"] for item in mine],
                linestyle="",
                label=letter,
                **style.line(index, size=3.5),
            )
        spans = [item["duration_s"] for item in injections]
        style.logarithmic(axes, "y", within=(0.5 * min(spans), 2 * max(spans)))
        axes.set_ylim(0.7 * min(spans), 1.4 * max(spans))
        axes.set_xlim(left=0)

    return draw(
        columns=6,
        x="time in s",
        y="valve-open time in s",
        name="run-valve-open",
        paint=paint,
        alt=f"Valve-open times of {len(injections)} injections against time, by chamber.",
        caption=f"Valve-open times of {len(injections)} injections, by the chamber that the gas drives.",
    )
