"""Figures on k = 50: the map over bore and viscosity, and what Eq. 18 reads off a separated column."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record
from ringbalance.results.numbers import given, number, short
from ringbalance.scene.arrays import FloatArray

_LEVELS: Final = (3, 5, 10, 20, 100, 200, 500, 1000, 10_000, 100_000, 1_000_000)
_HEIGHT: Final = 4.9
_LIST: Final = 2.35
"""Inches to the right of the map for the names of the liquids."""
_APART: Final = 0.155
"""Inches between two names."""
_PAPER: Final = 50.0


def drag_figures(found: Record) -> dict[str, Drawing | None]:
    """By the names that the section's template has for them; None where there is nothing to draw."""
    return {
        "map": _map_figure(found) if found["map"]["runs"] else None,
        "apparent": _apparent_figure(found["apparent"]) if found["apparent"] else None,
    }


def _map_figure(found: Record) -> Drawing:
    """k over bore and viscosity: lines of equal k, k = 50 with its band, the separated column, liquids."""
    told = found["map"]
    bore, nu = (np.asarray(told[key]) for key in ("bore_m", "kinematic_viscosity_m2_s"))
    bore, nu = bore * 1e3, nu * 1e6

    def paint(axes: Axes) -> None:
        for name, values in (("x", bore), ("y", nu)):
            style.logarithmic(axes, name, within=(values[0], values[-1]))
        _shade(axes, told, bore, nu)
        _lines(axes, told, bore, nu)
        _mark_liquids(axes, found)
        axes.set_xlim(bore[0], bore[-1])
        axes.set_ylim(nu[0], nu[-1])
        axes.grid(visible=False)
        style.legend_above(axes, columns=2)
        box = axes.get_position()
        axes.set_position((box.x0, box.y0, 1 - box.x0 - _LIST / style.WIDE, box.height))
        _name_liquids(axes, found)

    gas, density = given(told["gas_pressure_Pa"], "Pa"), short(told["density_kg_m3"], digits=4)
    blocked = "" if told["starts"] else " This gas does not start the flow: k is that of a primed tube."
    return draw(
        x="bore of the tube in mm",
        y="kinematic viscosity in mm²/s",
        name="fifty-map",
        columns=0,
        paint=paint,
        wide=True,
        height=_HEIGHT,
        alt="Map of the drag coefficient at the operating point: it falls with the bore and rises with the "
        "viscosity; the line k = 50 runs from thin tubes for thin liquids to wide tubes for viscous ones.",
        caption=f"k over bore and viscosity, each point at its own operating point: equal fills, {gas}, "
        f"{density} kg/m³, all else as in the scene. Band: where k = 50 lies within its expanded uncertainty "
        "(95 %). "
        "Circles: the known liquids in this tube, each with k at its own density; open where the scene’s gas "
        f"does not start them, then at the gas pressure of equal head.{blocked}",
    )


def _shade(axes: Axes, told: Record, bore: FloatArray, nu: FloatArray) -> None:
    tearing = np.asarray(told["tearing"]).T
    if np.any(tearing > 0):
        axes.contourf(bore, nu, tearing, levels=[0.0, 100.0], colors=[style.MUTED], alpha=0.16)
        axes.fill_between(
            [],
            [],
            [],
            color=style.MUTED,
            alpha=0.16,
            linewidth=0,
            label="column separated at the siphon crest",
        )
    k, width = (np.asarray(told[key]).T for key in ("k", "k_uncertainty"))
    near = np.where(np.abs(np.log(np.maximum(k, 1e-9) / _PAPER)) < 2, np.abs(k - _PAPER) - width, 1.0)
    axes.contourf(bore, nu, near, levels=[-1e9, 0], colors=[style.PAPER], alpha=0.2)


def _lines(axes: Axes, told: Record, bore: FloatArray, nu: FloatArray) -> None:
    k, read = (np.log10(np.maximum(np.asarray(told[key]).T, 1e-3)) for key in ("k", "apparent_k"))
    levels = [level for level in _LEVELS if k.min() < np.log10(level) < k.max()]
    thin = axes.contour(bore, nu, k, levels=np.log10(levels), colors=[style.FOUND], linewidths=0.7)
    shown = (short(level) if level < 10_000 else number(level, digits=1) for level in levels)
    names = dict(zip(thin.levels, shown, strict=True))
    texts = axes.clabel(thin, fmt=names, inline=True, inline_spacing=3)
    for text in texts:
        text.set_color(style.FOUND)
    if k.min() < np.log10(_PAPER) < k.max():
        axes.contour(bore, nu, k, levels=[np.log10(_PAPER)], colors=[style.PAPER], linewidths=2.2)
        axes.plot([], [], color=style.PAPER, linewidth=2.2, label="k = 50, with its 95 % band")
    axes.plot([], [], color=style.FOUND, linewidth=0.7, label="other k")
    apart = np.where(read - k > 1e-3, read, np.nan)
    if np.nanmin(apart, initial=9) < np.log10(_PAPER) < np.nanmax(apart, initial=-9):
        axes.contour(
            bore,
            nu,
            read,
            levels=[np.log10(_PAPER)],
            colors=[style.INK],
            linewidths=1.1,
            linestyles=[(0, (4, 2))],
        )
        axes.plot(
            [], [], color=style.INK, linewidth=1.1, linestyle=(0, (4, 2)), label="Eq. 19’s velocity is right"
        )


def _mark_liquids(axes: Axes, found: Record) -> None:
    for record in found["liquids"]:
        if record["runs"]:
            axes.plot(
                [found["bore_m"] * 1e3],
                [record["kinematic_viscosity_m2_s"] * 1e6],
                "o",
                color=style.INK,
                markerfacecolor=style.INK if record["starts_at_scene_pressure"] else style.SURFACE,
                markersize=4.5,
                zorder=5,
            )
    axes.axvline(found["bore_m"] * 1e3, color=style.INK, linewidth=0.6, linestyle=":", zorder=2)


def _name_liquids(axes: Axes, found: Record) -> None:
    """Names at the right edge, level with their circles but never on top of each other."""
    figure = style.figure_of(axes)
    shown_liquids = sorted(
        (r for r in found["liquids"] if r["runs"]), key=lambda r: float(r["kinematic_viscosity_m2_s"])
    )
    box, (low, high) = axes.get_position(), np.log(axes.get_ylim())
    share = [(np.log(r["kinematic_viscosity_m2_s"] * 1e6) - low) / (high - low) for r in shown_liquids]
    wanted = [box.y0 + s * box.height for s in share]
    for record, at, place in zip(shown_liquids, wanted, _spread(wanted, _APART / _HEIGHT), strict=True):
        edge = box.x1
        leader = Line2D(
            [edge, edge + 0.012, edge + 0.022],
            [at, at, place],
            color=style.MUTED,
            linewidth=0.7,
            transform=figure.transFigure,
        )
        figure.add_artist(leader)
        text = f"{typeset(record['name'])}, k {number(record['k'], digits=2)}"
        figure.text(edge + 0.026, place, text, va="center", ha="left", color=style.INK)


def _spread(wanted: list[float], apart: float) -> list[float]:
    """Places at least so far apart, near the wanted ones, in their order: blocks that touch move as one."""
    blocks: list[tuple[float, int]] = []
    for place in wanted:
        blocks.append((place, 1))
        while len(blocks) > 1:
            (a, m), (b, n) = blocks[-2:]
            if b - a >= apart * (m + n) / 2:
                break
            blocks[-2:] = [((a * m + b * n) / (m + n), m + n)]
    return [middle + (i - (count - 1) / 2) * apart for middle, count in blocks for i in range(count)]


def _apparent_figure(read: Record) -> Drawing:
    """The k that Eq. 18 reads off the tube, over the velocity: its 1/u^2 line, k(u) and k = 50.

    Args: `read`: `apparent` of the evidence's `fifty`.
    """
    speed, siphon, separated, every, floor = (
        np.asarray(read[key]) for key in ("velocity_m_s", "siphon", "separated", "read", "floor")
    )
    excess = 2 * read["excess_head_m2_s2"] / speed**2

    def paint(axes: Axes) -> None:
        axes.axhline(_PAPER, **style.AS_PAPER, label="the paper’s 50")
        axes.plot(speed, every, color=style.INK, linewidth=3.2, alpha=0.25, label="what Eq. 18 reads")
        axes.plot(speed, siphon, color=style.FOUND, label="k(u) of the full tube")
        axes.plot(
            speed,
            np.where(separated > 0, separated, np.nan),
            color=style.THIRD,
            label="separated at the siphon crest",
        )
        if read["excess_head_m2_s2"] > 0:
            axes.plot(speed, excess, color=style.THIRD, linewidth=0.9, linestyle=":", label="its part ∝ 1/u²")
        axes.plot(
            [read["operating_velocity_m_s"]],
            [read["operating_k"]],
            "o",
            color=style.INK,
            markersize=5,
            label="this machine",
        )
        bottom = max(0.5 * min(siphon.min(), floor.min(), 2.0), 0.3)
        top = 2 * max(float(every.max()), _PAPER)
        style.logarithmic(axes, "x", within=(speed[0], speed[-1]))
        style.logarithmic(axes, "y", within=(bottom, top))
        axes.set_xlim(speed[0], speed[-1])
        axes.set_ylim(bottom, top)

    return draw(
        columns=3,
        x="mean velocity in the tube in m/s",
        y="k as Eq. 18 has it",
        name="fifty-apparent",
        paint=paint,
        wide=True,
        height=3.7,
        alt="The k that Eq. 18 reads off a separated column falls as one over u squared towards a floor, and "
        "lies "
        "above the tube’s own k wherever the column is separated.",
        caption="What Eq. 18 makes of the siphon crest, the opposite chamber at equal fill. The tube runs at "
        "the "
        "smaller velocity, so the larger k is read. The separated column’s part ∝ 1/u² depends on the siphon "
        "crest’s "
        "radius, the speed and the opposite level alone, not on the viscosity: measured at one velocity it "
        "passes for a drag coefficient, at another it does not.",
    )
