"""The figure of the pressure along the tube's path."""

from __future__ import annotations

from itertools import groupby
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ringbalance.reports.figures.style import (
    FIFTH,
    FOUND,
    FOURTH,
    MUTED,
    THIRD,
    Drawing,
    draw,
    legend_above,
)
from ringbalance.reports.units import given, shown

Record = dict[str, Any]

REGIME_COLOURS: Final = {"siphon": FOUND, "separated": THIRD, "blocked": FIFTH, "reverse": FOURTH}
"""Of a regime, wherever one is drawn."""


def path_figure(found: Record) -> Drawing:
    """Gauge pressure along the path, one line a regime, dotted where the tube is not full.

    Args: `found`: the evidence's `hump`.
    """
    states = found["states"]

    def paint(figure: Figure, axes: Axes) -> None:
        for state in states:
            _line(axes, state)
        cavity = states[0]["cavity_pressure_Pa"] * 1e-6
        axes.axhline(cavity, color=MUTED, linewidth=1, linestyle=(0, (5, 2)), label="cavity pressure")
        hump = states[0]["hump_path_m"] * 1e3
        axes.axvline(hump, color=MUTED, linewidth=0.8, linestyle=":")
        _margin(axes, states, hump)
        length = states[0]["path_m"][-1] * 1e3
        axes.set_xlim(-0.015 * length, 1.015 * length)
        low, high = axes.get_ylim()
        axes.set_ylim(low - 0.04 * (high - low), high)
        axes.annotate(
            "hump", (hump, high), xytext=(5, -9), textcoords="offset points", color=MUTED, fontsize=8
        )
        axes.set_xlabel("path along the tube from the driven chamber in mm")
        axes.set_ylabel("gauge pressure in MPa")
        legend_above(figure, axes, columns=3)

    told = "; ".join(f"{_told(state)}" for state in states)
    return draw(
        name="hump-pressure",
        paint=paint,
        wide=True,
        height=4.0,
        alt="Pressure along the tube: it falls towards the siphon crest and rises behind it; in the "
        "separated regime "
        "it stays at the cavity pressure behind the siphon crest until the tube is full again.",
        caption=f"Pressure along the path, siphon crest at a radius of {given(found['hump_radius_m'], 'm')}: "
        f"{told}. "
        "Dotted: where gas or a cavity fills the bore. Steps: the ends and the bends. The bends are taken as "
        "evenly spread, the legs as straight in radius.",
    )


def _told(state: Record) -> str:
    return (
        f"{state['regime']} at a fill ratio of {state['fill_ratio']:.2f} and "
        f"{given(state['gas_pressure_Pa'], 'Pa', digits=3)}"
    )


def _line(axes: Axes, state: Record) -> None:
    path, pressure = np.asarray(state["path_m"]) * 1e3, np.asarray(state["pressure_Pa"]) * 1e-6
    colour, start = REGIME_COLOURS[state["regime"]], 0
    gas = given(state["gas_pressure_Pa"], "Pa", digits=3)
    label: str | None = f"{state['regime']}, {gas}"
    for full, members in groupby(state["full"]):
        count = len(list(members))
        part = slice(max(start - 1, 0) if not full else start, start + count + (0 if full else 1))
        style = "-" if full else (0, (1, 2))
        axes.plot(path[part], pressure[part], color=colour, linestyle=style, label=label if full else None)
        label = None if full else label
        start += count


def _margin(axes: Axes, states: list[Record], hump: float) -> None:
    """The siphon's margin at the crest, as an arrow with its size."""
    siphons = [s for s in states if s["regime"] == "siphon" and s["margin_Pa"] is not None]
    if not siphons:
        return
    state = siphons[0]
    low, high = state["cavity_pressure_Pa"] * 1e-6, state["hump_pressure_Pa"] * 1e-6
    axes.annotate(
        f"margin {shown(state['margin_Pa'], 'Pa', digits=2)}",
        (hump, high),
        xytext=(10, 26),
        textcoords="offset points",
        color=FOUND,
        fontsize=8,
        arrowprops={"arrowstyle": "-", "color": FOUND, "linewidth": 0.7},
    )
    axes.plot([hump, hump], [low, high], color=FOUND, linewidth=3, alpha=0.6, solid_capstyle="butt")
