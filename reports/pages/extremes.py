"""The scene at its extremes: where answers end, and what is said beyond, from the heavy case `extremes`."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import number
from ringbalance.reports.section import Cells, Record, Section, Table
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.extremes.axes import Axis, axis_of
from ringbalance.verification.extremes.design import PERIODS
from ringbalance.verification.extremes.point import Ending
from ringbalance.verification.extremes.study import MAP_PREFIX

CASE: Final = "extremes"
_COLOURS: Final = {
    Ending.SOLVED: (style.FOUND, 0.55),
    Ending.WIDE: (style.FOUND, 0.22),
    Ending.STATUS: (style.THIRD, 0.5),
    Ending.REFUSED: (style.MUTED, 0.18),
    Ending.BROKEN: (style.PAPER, 1.0),
}
_MARKS: Final = (
    ("loop settles", ("settled",), "o", 3.0),
    ("loop diverges or drifts", ("diverging", "drifting"), "x", 3.5),
)
"""Outcomes of the closed loop that a map shows by marks."""
_LABEL: Final = 34
"""Characters of an axis' label on one line."""
_LEGEND: Final = 0.62
"""Inches above a map for its legend."""


def _view(_own: Record, evidence: Record) -> Record:
    """Sentences, the table of axes and the maps."""
    case = next((c for c in evidence.get("verification", []) if c["id"] == CASE), None)
    if case is None or not case.get("tables"):
        return {"ran": False}
    tables = {table["name"]: table["columns"] for table in case["tables"]}
    return {
        "ran": True,
        "text": case.get("explanation", ""),
        "date": case.get("date", ""),
        "table": Table(
            caption="Each input alone, from end to end, all else as in the paper’s scene: where points begin "
            "to end in another way, and what is said there.",
            heads=("Input", "Stretch", "Answer", "Loop", "Said"),
            rows=axis_rows(tables["axes"]),
            style="",
        ),
        "maps": map_drawings(tables),
    }


def map_drawings(tables: Mapping[str, Record]) -> list[Drawing]:
    """The stability maps. Args: `tables`: columns of the case's tables, by name."""
    return [_map(name, columns) for name, columns in tables.items() if name.startswith(MAP_PREFIX)]


def axis_rows(columns: Record) -> list[Cells]:
    """The intervals of every axis: its title (at its first), interval, answer, loop and message."""
    before = ["", *columns["axis"]]
    return [
        (
            "" if title == before[index] else title,
            _span(columns["from"][index], columns["to"][index], columns["unit"][index]),
            str(columns["ending"][index]).removesuffix(" with a message"),
            str(columns["loop"][index]).replace("_", " "),
            _shortened(str(columns["said"][index])),
        )
        for index, title in enumerate(columns["axis"])
    ]


def _span(low: float, high: float, unit: str) -> str:
    """First and last value of a stretch, or the one where both are the same."""
    first, last = (number(float(end), digits=3) for end in (low, high))
    told = first if first == last else f"{first} to {last}"
    return told if unit == "1" else f"{told} {_shown(unit)}"


def _shown(unit: str) -> str:
    return unit.replace("^2", "²")


def _shortened(message: str) -> str:
    """The first line of a message, without the name of a file that nobody has."""
    return message.split("\n")[0].split(".toml: ", 1)[-1]


def _map(name: str, columns: Record) -> Drawing:
    x, y = (axis_of(part) for part in name.removeprefix(MAP_PREFIX).split(" and "))
    xs, ys = (np.unique(np.asarray(columns[axis.name], dtype=np.float64)) for axis in (x, y))
    shape = (ys.size, xs.size)
    endings = np.asarray(columns["ending"], dtype=object).reshape(shape)
    loops = np.asarray(columns["loop"], dtype=object).reshape(shape)

    def paint(axes: Axes) -> None:
        edges_x, edges_y = _edges(x, xs), _edges(y, ys)
        present = [ending for ending in Ending if np.any(endings == str(ending))]
        for ending in present:
            colour, strength = _COLOURS[ending]
            there = np.ma.masked_not_equal(endings == str(ending), True)
            axes.pcolormesh(edges_x, edges_y, there, cmap=ListedColormap([colour]), alpha=strength)
        for label, outcomes, marker, size in _MARKS:
            rows, cols = np.nonzero(np.isin(loops, outcomes))
            if rows.size:
                axes.plot(
                    xs[cols],
                    ys[rows],
                    marker,
                    color=style.FOUND,
                    markersize=size,
                    markeredgewidth=0.9,
                    label=label,
                )
        for axis, target, edges in (("x", x, edges_x), ("y", y, edges_y)):
            if target.spacing == "log":
                style.logarithmic(axes, axis)
            getattr(axes, f"set_{axis}lim")(edges[0], edges[-1])
        axes.grid(visible=False)
        _legend(axes, present)

    return draw(
        x=_label(x),
        y=_label(y),
        name=f"extremes-{x.name}-{y.name}",
        paint=paint,
        columns=0,
        height=3.4,
        alt=f"Where the program answers over {x.title} and {y.title}, and where it refuses with a message.",
        caption=f"{x.title[0].upper()}{x.title[1:]} and {y.title}, all else as in the scene. "
        f"Unmarked: the loop ends in another way, most often because its time of {PERIODS} control periods, "
        "which need not be the scene’s, is up.",
    )


def _edges(axis: Axis, values: FloatArray) -> FloatArray:
    """Edges of cells around the values, in the axis' own spacing."""
    place = np.log(values) if axis.spacing == "log" else values
    middle = (place[1:] + place[:-1]) / 2
    ends = np.concatenate([[2 * place[0] - middle[0]], middle, [2 * place[-1] - middle[-1]]])
    return np.exp(ends) if axis.spacing == "log" else ends


def _label(axis: Axis) -> str:
    told = axis.title if axis.unit == "1" else f"{axis.title} in {_shown(axis.unit)}"
    return fill(told, _LABEL)


def _legend(axes: Axes, present: list[Ending]) -> None:
    cells = [Patch(color=_COLOURS[e][0], alpha=_COLOURS[e][1], linewidth=0, label=str(e)) for e in present]
    handles = [*cells, *axes.get_legend_handles_labels()[0]]
    figure = style.figure_of(axes)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.0)
    box, height = axes.get_position(), figure.get_figheight()
    axes.set_position((box.x0, box.y0, box.width, 1 - box.y0 - _LEGEND / height))


SECTION: Final = Section(name="extremes", title="At the extremes", show=_view)
"""Shown also where it was not run, to say how it is."""
