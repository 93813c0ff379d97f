"""Figures of the closed loop: one run of a liquid ring, and runs under both laws against time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.operation import residual_polar
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record
from ringbalance.results.numbers import shown

_SAME: Final = 1e-3
"""Relative change of the amplitude that counts as none."""
_CROPPED: Final = 0.7
"""Fraction of a run up to which its rest is cut off, when nothing moves there."""
_MARKED: Final = 20
"""Samples that are marked."""
_LAWS: Final[dict[str, dict[str, Any]]] = {
    "calibrated": {"color": style.FOUND, "label": "the calibrated law"},
    "paper": {**style.AS_PAPER, "label": "the paper’s law"},
}


def loop_figures(evidence: Record) -> Record:
    """By the names that the templates have for them; None where the law was not run."""
    runs, limit = evidence["closed_loop"], evidence["limit_m"]
    found = runs.get("calibrated")
    return {
        "amplitude": _amplitude(runs, limit) if runs else None,
        "early_amplitude": _early_amplitude(runs, limit) if runs else None,
        "regimes": _regimes(found) if found else None,
        "fill_ratios": _fill_ratios(found, _early_time(runs)) if found else None,
    }


def _early_time(runs: Record) -> float:
    """Time by which most of the gas has been spent under the calibrated law: where the loop does its work.

    Args: `runs`: simulation documents by law, SI.
    Returns: s, positive.
    """
    run = next(iter(runs.values()))
    spent = np.cumsum([item["duration_s"] for item in run["injections"]])
    if spent.size == 0:
        return float(run["time_s"][-1]) or 1.0
    last = run["injections"][int(np.searchsorted(spent, 0.9 * spent[-1]))]
    return float(min(run["time_s"][-1], 1.4 * (last["time_s"] + last["duration_s"])))


def _amplitude(runs: Record, limit: float) -> Drawing:
    """Vibration amplitude at the controller's samples, m, under the laws that were run."""
    # Samples at rest repeat one value: the first of them say enough.
    marks = {"linewidth": 1.2, "marker": "o", "markersize": 3, "markevery": slice(0, _MARKED)}
    laws = {name: line for name, line in _LAWS.items() if name in runs}

    def curve(run: Record, line: dict[str, Any]) -> style.Curve:
        time = np.asarray(run["samples"]["time_s"])
        return time, np.interp(time, run["time_s"], run["amplitude_m"]), {**line, **marks}

    until, end = _still_from(list(runs.values()))

    def paint(axes: Axes) -> None:
        style.amplitudes(axes, [curve(runs[name], line) for name, line in laws.items()], limit)
        axes.set_xlim(0, until)

    rests = "" if until == end else f" Nothing moves from there to {shown(end, 's', digits=3)}."
    ends = ", ".join(
        f"{shown(runs[name]['amplitude_m'][-1], 'm', digits=2)} under {line['label']}"
        for name, line in laws.items()
    )
    return draw(
        name="amplitude",
        paint=paint,
        columns=3,
        wide=True,
        height=3.5,
        alt=f"Vibration amplitude against time on a logarithmic scale; it ends at {ends}.",
        caption="Vibration amplitude at each sample of the controller, under both laws; between samples it "
        f"may cross the limit before the line does. It ends at {ends}.{rests}",
    )


def _still_from(runs: Sequence[Record]) -> tuple[float, float]:
    """Time from which no amplitude changes, with some room before it, and the end of the runs; both in s."""
    end = max(float(run["time_s"][-1]) for run in runs)
    last = 0.0
    for run in runs:
        time, values = np.asarray(run["time_s"]), np.asarray(run["amplitude_m"])
        moving = np.flatnonzero(np.abs(values - values[-1]) > _SAME * values[-1])
        last = max(last, float(time[moving[-1]]) if moving.size else 0.0)
    room = 1.5 * last
    return (room, end) if 0 < room < _CROPPED * end else (end, end)


def _early_amplitude(runs: Record, limit: float) -> Drawing:
    """Vibration amplitude within the first operations, m, liquid flowing, under the laws that were run."""
    until = _early_time(runs)

    def curve(run: Record, line: dict[str, Any]) -> style.Curve:
        time, values = np.asarray(run["time_s"]), np.asarray(run["amplitude_m"])
        return time[time <= until], values[time <= until], {**line, "linewidth": 1.3}

    def paint(axes: Axes) -> None:
        laws = ((runs[name], line) for name, line in _LAWS.items() if name in runs)
        style.amplitudes(axes, [curve(run, line) for run, line in laws], limit)
        axes.set_xlim(0, until)

    return draw(
        name="amplitude-early",
        paint=paint,
        columns=3,
        alt=f"Vibration amplitude in the first {shown(until, 's', digits=2)}, under both laws.",
    )


def _regimes(run: Record) -> Drawing | None:
    """The regime of the tube in every gas operation under the calibrated law, by chamber and time.

    Args: `run`: a simulation document, SI.
    Returns: The figure; None for a run without operations.
    """
    operations = run["injections"]
    if not operations:
        return None
    letters = list(run["fill_ratio"])
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
            color=style.REGIME_COLOURS[regime],
            linewidth=0,
            label=None if regime in named else regime,
        )
        named.add(regime)

    def paint(axes: Axes) -> None:
        for item in operations:
            end = item.get("regime_end") or item["regime"]
            parts = [(item["regime"], (0.0, 1.0))]
            if end != item["regime"]:
                parts = [(item["regime"], (0.0, 0.5)), (end, (0.5, 1.0))]
            for regime, share in parts:
                bar(axes, item, regime, share)
        axes.set_yticks(range(len(letters)), letters)
        axes.set_ylim(len(letters) - 0.5, -0.5)
        axes.set_xlim(0, 1.02 * (last + least))

    counts = Counter(item["regime"] for item in operations)
    told = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    return draw(
        columns=4,
        x="time in s",
        y="gas into chamber",
        name="loop-regimes",
        paint=paint,
        wide=True,
        height=1.5 + 0.2 * len(letters),
        alt=f"Regime of the tube in each of {len(operations)} gas operations: {told} at their start.",
        caption=f"Regime of the tube in each gas operation under the calibrated law; at their start: {told}. "
        "A bar of two colours changed on the way. Short operations are drawn wider than they were.",
    )


def _fill_ratios(run: Record, until: float) -> Drawing:
    """Fill ratio of every chamber against time under the calibrated law.

    Args: `run`: a simulation document, SI. `until`: end of the time axis, s.
    """

    def paint(axes: Axes) -> None:
        for index, (letter, values) in enumerate(run["fill_ratio"].items()):
            axes.plot(run["time_s"], values, label=letter, **style.line(index))
        axes.set_xlim(0, until)

    letters = ", ".join(run["fill_ratio"])
    return draw(
        columns=6,
        x="time in s",
        y="fill ratio",
        name="fill-ratios",
        paint=paint,
        alt=f"Fill ratios of chambers {letters} against time.",
        caption=f"Fill ratios of chambers {letters} under the calibrated law.",
    )


def run_figures(run: Record) -> list[Drawing]:
    """Amplitude with its limit, valve-open times, fills, and the path of the residual vector."""
    times = [_valve_open_times(run)] if run["injections"] else []
    return [run_amplitude(run), *times, _fill_ratios(run, _early_time({"run": run})), residual_polar(run)]


def run_amplitude(run: Record) -> Drawing:
    """True and measured vibration amplitude over time, m, with the limit."""
    samples = run.get("samples", {"time_s": [], "amplitude_m": []})
    seen = [
        (time, value)
        for time, value in zip(samples["time_s"], samples["amplitude_m"], strict=True)
        if value is not None
    ]
    time, measured = np.array(seen, dtype=np.float64).reshape(-1, 2).T
    dots = {"color": style.PAPER, "linestyle": "", "marker": "o", "markersize": 2.5, "label": "measured"}
    line = {"color": style.FOUND, "linewidth": 1.2, "label": "true"}

    def paint(axes: Axes) -> None:
        true = (run["time_s"], np.asarray(run["amplitude_m"]), line)
        style.amplitudes(axes, [true, (time, measured, dots)] if seen else [true], run["limit_m"])

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
