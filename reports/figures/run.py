"""Figures of one closed-loop run of a liquid ring, from its document in SI."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.loop import early_time, fill_ratios
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import shown
from ringbalance.reports.section import Record


def run_figures(run: Record) -> list[Drawing]:
    """Amplitude with its limit, valve-open times, fills, and the path of the residual vector."""
    times = [valve_open_times(run)] if run["injections"] else []
    return [run_amplitude(run), *times, fill_ratios(run, early_time({"run": run})), residual_path(run)]


def run_amplitude(run: Record) -> Drawing:
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


def valve_open_times(run: Record) -> Drawing:
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


def residual_path(run: Record) -> Drawing:
    """The vibration vector in its plane: its path, the controller's samples, and the circle of the limit.

    The radius is asinh(amplitude/limit): linear within the limit, logarithmic far beyond it.
    """
    amplitude, limit = np.asarray(run["amplitude_m"]), run["limit_m"]
    vector = np.arcsinh(amplitude / limit) * np.exp(1j * np.asarray(run["phase_rad"]))
    at = np.searchsorted(run["time_s"], run["samples"]["time_s"])
    sampled = vector[np.minimum(at, vector.size - 1)]
    decades = range(max(1, math.ceil(math.log10(max(amplitude.max() / limit, 1.0)))) + 1)
    around = np.exp(1j * np.linspace(0, 2 * np.pi, 181))

    def paint(axes: Axes) -> None:
        axes.grid(visible=False)
        for decade in decades:
            circle = np.arcsinh(10.0**decade) * around
            colour, line = (style.MUTED, ":") if decade == 0 else (style.GRID, "-")
            label = None if decade else "limit"
            axes.plot(circle.real, circle.imag, color=colour, linestyle=line, linewidth=1, label=label)
            text = shown(10.0**decade * limit, "m", digits=2)
            axes.annotate(text, (0, float(np.arcsinh(10.0**decade))), color=style.MUTED, fontsize=8)
        axes.plot(vector.real, vector.imag, color=style.FOUND, linewidth=1, label="residual")
        axes.plot(sampled.real, sampled.imag, ".", color=style.FOUND, markersize=5, label="at the samples")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xticks=[], yticks=[])

    return draw(
        columns=3,
        x="0° to the right, 90° upwards",
        name="run-residual",
        paint=paint,
        height=3.6,
        alt="Path of the vibration vector in its plane, from its start towards the circle of the limit.",
        caption="Path of the vibration vector, zero to peak, with the controller’s samples. The radius is "
        "linear within the limit and logarithmic far beyond it.",
    )
