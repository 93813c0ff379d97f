"""Figures of the closed loop: amplitude and fill ratios against time under both laws."""

from __future__ import annotations

from collections import Counter
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import shown
from ringbalance.scene.arrays import FloatArray

Record = dict[str, Any]

_LAWS: Final = (
    ("calibrated", style.FOUND, "-", "the calibrated law"),
    ("paper", style.PAPER, (0, (5, 2)), "the paper’s law"),
)
_CHAMBER_COLOURS: Final = (style.FOUND, style.PAPER, style.THIRD, style.FOURTH, style.FIFTH, style.MUTED)
_TICKS: Final = [step * 10.0**exponent for exponent in range(-4, 4) for step in (1, 2, 5)]


def early_time(runs: Record) -> float:
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


def _decade_limits(values: FloatArray, limit: float) -> tuple[float, float]:
    positive = values[values > 0]
    bottom = min(positive.min(), limit) if positive.size else limit
    return bottom * 0.7, max(values.max(), limit) * 1.4


def _amplitude_axes(axes: Axes, values: FloatArray, limit: float) -> None:
    bottom, top = _decade_limits(values, limit)
    axes.axhline(limit, color=style.MUTED, linewidth=1, linestyle=":", label="limit")
    style.logarithmic(axes, "y", ticks=[tick for tick in _TICKS if bottom <= tick <= top])
    axes.set_ylim(bottom, top)
    axes.set_xlabel("time in s")
    axes.set_ylabel("amplitude in µm, zero to peak")


def amplitude(runs: Record, limit: float) -> Drawing:
    """Vibration amplitude at the controller's samples under the calibrated law and under the paper's.

    Args: `runs`: simulation documents by law, SI. `limit`: amplitude below which the controller rests, m.
    """
    present = [entry for entry in _LAWS if entry[0] in runs]
    sampled = {name: np.asarray(runs[name]["samples"]["time_s"]) for name, *_ in present}
    values = {
        name: np.interp(sampled[name], runs[name]["time_s"], runs[name]["amplitude_m"]) * 1e6
        for name, *_ in present
    }

    def paint(axes: Axes) -> None:
        for name, colour, dashes, label in present:
            axes.plot(
                sampled[name],
                values[name],
                color=colour,
                linestyle=dashes,
                linewidth=1.2,
                marker="o",
                markersize=3,
                label=label,
            )
        _amplitude_axes(axes, np.concatenate(list(values.values())), limit * 1e6)
        axes.set_xlim(left=0)

    ends = ", ".join(
        f"{shown(runs[name]['amplitude_m'][-1], 'm', digits=2)} under {label}"
        for name, _, _, label in present
    )
    return draw(
        columns=3,
        name="amplitude",
        paint=paint,
        wide=True,
        height=3.5,
        alt=f"Vibration amplitude against time on a logarithmic scale; it ends at {ends}.",
        caption=f"Vibration amplitude at each sample of the controller, under both laws. It ends at {ends}.",
    )


def early_amplitude(runs: Record, limit: float) -> Drawing:
    """Vibration amplitude within the first operations, liquid flowing, under both laws.

    Args: `runs`: simulation documents by law, SI. `limit`: amplitude below which the controller rests, m.
    """
    present = [entry for entry in _LAWS if entry[0] in runs]
    until = early_time(runs)

    def paint(axes: Axes) -> None:
        seen = []
        for name, colour, dashes, label in present:
            time, values = np.asarray(runs[name]["time_s"]), np.asarray(runs[name]["amplitude_m"]) * 1e6
            axes.plot(time, values, color=colour, linestyle=dashes, linewidth=1.3, label=label)
            seen.append(values[time <= until])
        _amplitude_axes(axes, np.concatenate(seen), limit * 1e6)
        axes.set_xlim(0, until)

    return draw(
        columns=3,
        name="amplitude-early",
        paint=paint,
        alt=f"Vibration amplitude in the first {shown(until, 's', digits=2)}, under both laws.",
        caption=f"The first {shown(until, 's', digits=2)}, while liquid moves. A line that falls "
        "and rises again within one operation has passed its target.",
    )


def regimes(run: Record) -> Drawing | None:
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


def fill_ratios(run: Record, until: float) -> Drawing:
    """Fill ratio of every chamber against time under the calibrated law.

    Args: `run`: a simulation document, SI. `until`: end of the time axis, s.
    """

    def paint(axes: Axes) -> None:
        for index, (letter, values) in enumerate(run["fill_ratio"].items()):
            axes.plot(
                run["time_s"], values, color=_CHAMBER_COLOURS[index % len(_CHAMBER_COLOURS)], label=letter
            )
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
