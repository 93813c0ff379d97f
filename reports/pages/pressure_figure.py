"""What a liquid ring's gas pressure decides: devices that settle, usable moment and time, over one axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from ringbalance.reports.figure import FOUND, INK, MUTED, PAPER, THIRD, Drawing, draw, figure_of, panels
from ringbalance.reports.section import Record
from ringbalance.results.requirements import MET, OPEN
from ringbalance.scene.arrays import FloatArray

_SHADES: Final = {MET: 0.28, OPEN: 0.1}
"""Opacity of the ground by what is known of the fraction there."""
_NAMES: Final = {MET: "met", OPEN: "undecided"}
_LEFT, _WIDTH = 0.12, 0.85
_BOXES: Final = ((0.64, 0.20), (0.385, 0.17), (0.12, 0.17))
"""Bottom and height of the panels."""
_MEGA, _TO_G_MM = 1e-6, 1e6


def pressure_figure(
    levels: Sequence[Record], *, asked: float, needed: float, own: float, recommended: float
) -> Drawing | None:
    """Of drawn devices at every gas pressure, each with its best settings; None with fewer than three.

    Args: `levels`: as in the evidence. `needed`: unbalance of the scene, kg m. `own`, `recommended`: gas
        pressures, Pa.
    """
    if len(levels) < 3:
        return None
    pressure = _MEGA * np.array([each["value"] for each in levels])

    def paint(axes: Axes) -> None:
        share, moment, time = panels(axes, *((_LEFT, low, _WIDTH, height) for low, height in _BOXES))
        _shares(share, pressure, [each["fraction"] for each in levels], asked)
        _moments(moment, pressure, levels, needed)
        _times(time, pressure, levels)
        for panel in (share, moment, time):
            _grounds(panel, pressure, [each["verdict"] for each in levels])
            panel.axvline(_MEGA * own, color=INK, linewidth=1, linestyle=":", label="the scene’s pressure")
            if recommended != own:
                panel.axvline(_MEGA * recommended, color=INK, linewidth=1.4, label="recommended")
            panel.set(xlim=(pressure[0], pressure[-1]))
        for panel in (share, moment):
            panel.tick_params(labelbottom=False)
        time.set_xlabel("gas pressure in MPa, gauge")
        handles, labels = share.get_legend_handles_labels()
        grounds = [Patch(color=THIRD, alpha=_SHADES[code], linewidth=0) for code in _NAMES]
        figure_of(axes).legend(
            [*handles, *grounds],
            [*labels, *_NAMES.values()],
            loc="upper left",
            ncols=2,
            borderaxespad=0.0,
            borderpad=0.1,
        )

    return draw("pressure-choice", paint, columns=0, height=3.5)


def _shares(panel: Axes, pressure: FloatArray, shares: Sequence[Record], asked: float) -> None:
    value, low, high = (100 * np.array([each[key] for each in shares]) for key in ("value", "low", "high"))
    panel.fill_between(pressure, low, high, color=FOUND, alpha=0.25, linewidth=0)
    panel.plot(pressure, value, color=FOUND, marker="o", markersize=3)
    panel.axhline(100 * asked, color=PAPER, linestyle="--", linewidth=1)
    _beside(panel, 100 * asked, "asked")
    panel.set(ylim=(0, 104))
    _name(panel, "devices that settle, in %")


def _moments(panel: Axes, pressure: FloatArray, levels: Sequence[Record], needed: float) -> None:
    low, middle, high = (
        _TO_G_MM
        * np.array([list(each["usable_moment_kg_m"].values()) for each in levels], dtype=np.float64).T
    )
    panel.fill_between(pressure, low, high, color=FOUND, alpha=0.25, linewidth=0)
    panel.plot(pressure, middle, color=FOUND)
    panel.axhline(_TO_G_MM * needed, color=PAPER, linestyle="--", linewidth=1)
    panel.set(ylim=(0, None))
    _name(panel, "moment that can be corrected, in g mm")
    _beside(panel, _TO_G_MM * needed, "unbalance")


def _name(panel: Axes, text: str) -> None:
    panel.set_title(text, loc="left", fontsize="medium", pad=3)


def _beside(panel: Axes, level: float, text: str) -> None:
    """Names a dashed level at its right end, below it."""
    look: dict[str, Any] = {"color": PAPER, "fontsize": "small", "ha": "right", "va": "top"}
    panel.annotate(text, (1.0, level), (-3, -2), panel.get_yaxis_transform(), "offset points", **look)


def _times(panel: Axes, pressure: FloatArray, levels: Sequence[Record]) -> None:
    looks: tuple[tuple[str, dict[str, Any]], ...] = (
        ("p50", {"color": FOUND, "marker": "o"}),
        ("p90", {"color": MUTED, "marker": "s"}),
    )
    for key, look in looks:
        times = np.array([each["settling_time_s"][key] for each in levels], dtype=np.float64)
        panel.plot(pressure, times, markersize=3, **look)
    panel.set(ylim=(0, None))
    _name(panel, "time to settle, in s")
    if not any(each["settling_time_s"]["p50"] is not None for each in levels):
        panel.set_yticks([])
        panel.text(0.5, 0.5, "half of the devices nowhere settle", ha="center", transform=panel.transAxes)


def _grounds(panel: Axes, pressure: FloatArray, verdicts: Sequence[str]) -> None:
    """Shaded half-way to the neighbours."""
    ends = np.concatenate([pressure[:1], (pressure[1:] + pressure[:-1]) / 2, pressure[-1:]])
    for low, high, verdict in zip(ends[:-1], ends[1:], verdicts, strict=True):
        if verdict in _SHADES:
            panel.axvspan(low, high, color=THIRD, alpha=_SHADES[verdict], linewidth=0)
