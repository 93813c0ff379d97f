"""Figures of a liquid ring's loop: a run with its injections, and the ring itself at its stages."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Wedge
from matplotlib.ticker import FuncFormatter

from ringbalance.reports.figure import (
    INK,
    MAP,
    MUTED,
    SURFACE,
    Drawing,
    amplitudes,
    draw,
    panels,
    plain_number,
)
from ringbalance.reports.prose import series
from ringbalance.reports.section import Record
from ringbalance.results.numbers import shown
from ringbalance.scene.arrays import FloatArray

_MICROMETRE: Final = 1e6
_REST: Final = 0.6
"""Fraction of a run up to which its injections are drawn apart from the rest of it."""
_LETTERED: Final = 14
"""Most injections that are lettered."""
_FRAMES: Final = 7
"""Discs side by side at the most."""
_WHOLE: Final = (0.09, 0.15, 0.89, 0.68)
_PARTS: Final = (0.09, 0.15, 0.6, 0.68), (0.72, 0.15, 0.26, 0.68)
"""Boxes of the axes."""


def injections_until(run: Record) -> float:
    """End of the last injection, s; of the run where there is none."""
    ends = [item["time_s"] + item["duration_s"] for item in run["injections"]]
    return float(max(ends, default=run["time_s"][-1]))


def run_with_injections(
    runs: Mapping[str, Record], looks: Mapping[str, dict[str, Any]], limit: float
) -> Drawing:
    """Vibration amplitude over whole runs, m, with every injection of the first one.

    Where a long rest follows the injections it has an axis of its own.
    """
    first = next(iter(runs.values()))
    end = max(float(run["time_s"][-1]) for run in runs.values())
    early = 1.15 * max(map(injections_until, runs.values()))
    split = 0 < early < _REST * end

    def paint(axes: Axes) -> None:
        spans = ((0.0, early), (early, end)) if split else ((0.0, end),)
        for panel, span in zip(panels(axes, *(_PARTS if split else (_WHOLE,))), spans, strict=True):
            drawn = [(run["time_s"], _in_micrometres(run), looks[law]) for law, run in runs.items()]
            amplitudes(drawn, _MICROMETRE * limit)(panel)
            panel.set(xlim=span, xlabel="time in s")
            panel.xaxis.set_major_formatter(FuncFormatter(plain_number))
            if span[0] > 0:
                panel.tick_params(labelleft=False)
                continue
            panel.set_ylabel("amplitude, zero to peak, in µm")
            _mark_injections(panel, first["injections"])
        for look in (*(looks[law] for law in runs), {"color": MUTED, "linestyle": ":", "label": "limit"}):
            axes.plot([], [], **look)

    return draw("amplitude", paint, columns=3, wide=True, height=3.6)


def _in_micrometres(run: Record) -> FloatArray:
    return _MICROMETRE * np.asarray(run["amplitude_m"], dtype=np.float64)


def _mark_injections(panel: Axes, injections: Sequence[Record]) -> None:
    """A stroke at the top for the time that each keeps its valve open, and the chambers' letters."""
    along, groups = panel.get_xaxis_transform(), _together(injections)
    for start, items in groups:
        end = max(item["time_s"] + item["duration_s"] for item in items)
        panel.plot((start, end), (1.0, 1.0), color=INK, linewidth=3, transform=along, clip_on=False)
        panel.axvline(start, color=MUTED, linewidth=0.5, alpha=0.6)
        if len(groups) <= _LETTERED:
            letters = "".join(sorted(item["chamber"] for item in items))
            panel.text(start, 1.02, letters, color=INK, ha="center", va="bottom", transform=along)


def _together(injections: Sequence[Record]) -> list[tuple[float, list[Record]]]:
    """Injections by the time at which their valves open, s."""
    groups = groupby(injections, key=lambda item: item["time_s"])
    return [(float(start), list(items)) for start, items in groups]


def ring_frames(run: Record, disc: Record) -> Drawing:
    """The ring at the start, after each injection and at the end, as the shaft sees it: each chamber with its
    liquid, drawn as a sector between the radii that its fill takes.

    Args: `disc`: `chambers`, `outer_radius_m`, `inner_radius_m`. Of many injections some are left out.
    """
    frames = _frames(run)
    width = 1 / len(frames)

    def paint(axes: Axes) -> None:
        boxes = [(place * width + 0.004, 0.0, width - 0.008, 0.76) for place in range(len(frames))]
        for panel, (title, time) in zip(panels(axes, *boxes), frames, strict=True):
            fills = {
                letter: float(np.interp(time, run["time_s"], values))
                for letter, values in run["fill_ratio"].items()
            }
            left = float(np.interp(time, run["time_s"], run["amplitude_m"]))
            _ring(panel, fills, disc)
            panel.set_title(f"{title}\n{shown(left, 'm', digits=2)}", color=INK, fontsize="small")

    return draw("ring-frames", paint, columns=0, wide=True, height=1.15 + 6.6 / max(len(frames), 4) * 0.9)


def _frames(run: Record) -> list[tuple[str, float]]:
    """Titles and times, s."""
    end = float(run["time_s"][-1])
    kept = _together(run["injections"])[: _FRAMES - 2]
    after = [
        (
            f"{series(sorted(item['chamber'] for item in items))}, {shown(start, 's', digits=2)}",
            min(max(item["time_s"] + item["duration_s"] for item in items), end),
        )
        for start, items in kept
    ]
    return [("start", 0.0), *after, ("end", end)]


def _ring(panel: Axes, fills: Mapping[str, float], disc: Record) -> None:
    outer, inner, count = disc["outer_radius_m"], disc["inner_radius_m"], disc["chambers"]
    half = 180 / count
    for place, (letter, fill) in enumerate(fills.items()):
        middle = 2 * half * place
        surface = math.sqrt(outer**2 - fill * (outer**2 - inner**2))
        ends = (middle - half, middle + half)
        panel.add_patch(Wedge((0, 0), outer, *ends, width=outer - inner, facecolor=SURFACE, edgecolor=INK))
        panel.add_patch(Wedge((0, 0), outer, *ends, width=outer - surface, facecolor=MAP[8], edgecolor=INK))
        at = 0.55 * inner * np.exp(1j * math.radians(middle))
        panel.text(at.real, at.imag, letter, ha="center", va="center", color=MUTED, fontsize="small")
    panel.add_patch(Circle((0, 0), inner, fill=False, color=INK, linewidth=0.8))
    panel.set(xlim=(-1.05 * outer, 1.05 * outer), ylim=(-1.05 * outer, 1.05 * outer), aspect="equal")
    panel.set_axis_off()
