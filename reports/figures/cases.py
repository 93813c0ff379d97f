"""Figures of the verification cases: order plots, and whatever series a case hands over."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record
from ringbalance.results.numbers import DisplayUnit, display_unit, number
from ringbalance.scene.arrays import FloatArray

_LONGEST_LABEL: Final = 28
_SPARE: Final = (*(style.line(index) for index in (2, 3, 5)), {"color": style.INK})
"""Lines of further curves of a style that is taken."""


def order_plot(case: Record) -> Drawing | None:
    """Error against mesh size, a line per sequence, with the formal order as a slope to compare.

    Returns: The figure; None when no sequence has errors.
    """
    studies = [s for s in case.get("convergence") or [] if s.get("error")]
    sequences = [s for s in studies if all(error is not None and error > 0 for error in s["error"])]
    if not sequences:
        return None

    def paint(axes: Axes) -> None:
        for index, sequence in enumerate(sequences):
            size, error = np.asarray(sequence["h"]), np.asarray(sequence["error"])
            line = style.line(index, size=4)
            axes.plot(size, error, label=sequence["label"], **line)
            if sequence.get("formal_order"):
                slope = 0.6 * error[-1] * (size / size[-1]) ** sequence["formal_order"]
                axes.plot(size, slope, color=line["color"], linewidth=0.8, linestyle=":")
        style.logarithmic(axes, "x", ticks=sorted({float(f"{size:.3g}") for size in sequences[0]["h"]}))
        style.logarithmic(axes, "y")

    orders = [s["observed_order"][-1] for s in sequences if s["observed_order"]]
    # An error that changes its sign from mesh to mesh, or is rounding, falls at no order.
    last = [number(order, digits=3) if order > 0 else "none" for order in orders]
    told = f"Observed at the finest pair: {', '.join(last)}" if last else "No order was observed"
    return draw(
        columns=1,
        x="relative mesh or step size",
        y="error",
        name=f"order-{case['id'].replace('_', '-')}",
        paint=paint,
        alt=f"Error against mesh size, double logarithmic. {told}.",
        height=2.7 + 0.175 * len(sequences),
        caption=f"{case['title']}: error against size. Dotted: the formal order. {told}.",
    )


_STYLES: Final[dict[str, dict[str, Any]]] = {
    "paper": style.AS_PAPER,
    "found": {"color": style.FOUND},
    "reference": {"color": style.THIRD, "linestyle": (0, (1, 1.5))},
    "points": {"color": style.INK, "linestyle": "", "marker": "o", "markersize": 2.5},
}
"""Drawing of a curve by its style."""


def series_plots(case: Record) -> list[Drawing]:
    """The figures that a case hands over as plain series."""
    stem = f"case-{case['id'].replace('_', '-')}"
    return [_series_plot(f"{stem}-{index}", series) for index, series in enumerate(case.get("series") or [])]


def _with_gaps(values: list[float | None], unit: DisplayUnit) -> FloatArray:
    """Values in a display unit; None leaves a gap in the line."""
    return np.array([np.nan if value is None else value * unit.factor for value in values])


def _few(limits: tuple[float, float]) -> tuple[float, float] | None:
    """Limits of a logarithmic axis on which decades alone would be too few labels."""
    return limits if 0 < limits[0] < limits[1] < 50 * limits[0] else None


def _label(name: str, unit: str) -> str:
    return f"{name} in {unit}" if name and unit not in {"", "1"} else name or unit


def _series_plot(name: str, series: Record) -> Drawing:
    x_unit = display_unit(series["x"]["unit"].replace("*", " "), *series["x"]["values"])
    x = _with_gaps(series["x"]["values"], x_unit)
    curves, told = series["y"], typeset(series["name"][:1].upper() + series["name"][1:])
    unit = display_unit(curves[0]["unit"], *(value for curve in curves for value in curve["values"]))
    spare = iter(_SPARE * len(curves))
    used: list[Record] = []

    def paint(axes: Axes) -> None:
        for curve in curves:
            line = _STYLES[curve.get("style") or "found"]
            line = next(spare) if line in used else line
            used.append(line)
            y = _with_gaps(curve["values"], unit)
            axes.plot(x, y, label=typeset(curve["name"]), **line)
            if curve.get("uncertainty"):
                band = _with_gaps(curve["uncertainty"], unit)
                style.band(axes, x, y, band, line["color"])
        if series.get("log"):
            style.logarithmic(axes, "x", within=_few(axes.get_xlim()))
            style.logarithmic(axes, "y", within=_few(axes.get_ylim()))

    names = typeset(", ".join(curve["name"] for curve in curves))
    return draw(
        x=_label(typeset(series["x"]["name"]), x_unit.symbol),
        y=_label(told if len(told) < _LONGEST_LABEL else "", unit.symbol),
        name=name,
        paint=paint,
        alt=f"{told}: {names} against {series['x']['name']}.",
        caption=f"{told}.",
    )
