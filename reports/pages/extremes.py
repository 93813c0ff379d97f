"""The scene at its extremes: where answers end, and what is said beyond, from the heavy case `extremes`."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from textwrap import fill
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Cells, Record, Section, Table
from ringbalance.results.numbers import number
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.extremes.axes import MAP_PREFIX, Axis, places_of
from ringbalance.verification.extremes.point import GAS_TIME, PERIODS, Ending
from ringbalance.verification.runner import paper_scene

CASE: Final = "extremes"
_LOOPS: Final = {
    "settled": ("S", "settles", style.FOUND),
    "time_limit": ("T", "time is up", style.MUTED),
    "diverging": ("D", "diverges", style.PAPER),
    "drifting": ("D", "diverges", style.PAPER),
    "gas_time_too_short": ("G", "below the shortest valve-open time", style.THIRD),
    "noise": ("N", "lost in noise", style.FOURTH),
    "stalled": ("B", "blocked", style.FIFTH),
    "capacity_exceeded": ("C", "beyond the capacity", style.FOURTH),
    "": ("A", "answered, loop not run", style.GRID),
}
"""Sign, name and colour of how the loop ends, by its outcome."""
_ENDINGS: Final = {
    Ending.REFUSED: ("R", str(Ending.REFUSED), style.GRID),
    Ending.BROKEN: ("!", str(Ending.BROKEN), style.PAPER),
}
"""The same of points that no loop follows."""
_RESERVATION: Final = "*"
_SCENE: Final[dict[str, Any]] = {
    "color": style.INK,
    "markerfacecolor": "none",
    "markersize": 15,
    "markeredgewidth": 1.8,
}
_SHADE: Final = 0.3
_LABEL: Final = 34
"""Characters of an axis' label on one line."""


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
        "maps": map_drawings(tables, places_of(paper_scene())),
    }


def map_drawings(tables: Mapping[str, Record], places: Mapping[str, float]) -> list[Drawing]:
    """The stability maps.

    Args: `tables`: columns of the case's tables, by name. `places`: of the scene on the axes, in their units.
    """
    return [_map(name, columns, places) for name, columns in tables.items() if name.startswith(MAP_PREFIX)]


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


def _map(name: str, columns: Record, places: Mapping[str, float]) -> Drawing:
    x, y = (Axis.of(part) for part in name.removeprefix(MAP_PREFIX).split(" and "))
    xs, ys = (np.unique(np.asarray(columns[axis.name], dtype=np.float64)) for axis in (x, y))
    told = [_sign(*cell) for cell in zip(columns["ending"], columns["loop"], strict=True)]
    kinds = dict.fromkeys(kind for kind, _ in told)

    def paint(axes: Axes) -> None:
        edges_x, edges_y = _edges(x, xs), _edges(y, ys)
        numbers = np.reshape([list(kinds).index(kind) for kind, _ in told], (ys.size, xs.size))
        shades = ListedColormap([colour for *_, colour in kinds])
        axes.pcolormesh(
            edges_x, edges_y, numbers, cmap=shades, vmin=0, vmax=len(kinds) - 1 or 1, alpha=_SHADE
        )
        for (at_y, at_x), (_, sign) in zip(product(ys, xs), told, strict=True):
            axes.text(at_x, at_y, sign, ha="center", va="center", color=style.INK)
        axes.plot(places[x.name], places[y.name], "o", **_SCENE)
        for which, target, edges in (("x", x, edges_x), ("y", y, edges_y)):
            if target.spacing == "log":
                style.logarithmic(axes, which)
            getattr(axes, f"set_{which}lim")(edges[0], edges[-1])
        axes.grid(visible=False)
        for sign, title, colour in kinds:
            axes.fill_between([], [], [], color=colour, alpha=_SHADE, label=f"{sign}  {title}")
        style.legend_above(axes, columns=2)

    return draw(
        x=_label(x),
        y=_label(y),
        name=f"extremes-{x.name}-{y.name}",
        paint=paint,
        columns=0,
        height=3.6,
        alt=f"How the loop ends over {x.title} and {y.title}: {', '.join(title for _, title, _ in kinds)}.",
        caption=f"{x.title[0].upper()}{x.title[1:]} and {y.title}, all else as in the scene, which is the "
        f"ring. Loops run for {PERIODS} control periods and {GAS_TIME} s of gas, which need not be the "
        f"scene’s time. {_RESERVATION}: answered with a reservation.",
    )


def _sign(ending: str, loop: str) -> tuple[tuple[str, str, str], str]:
    """Sign, name and colour of a point's kind, and the sign as it stands in its cell."""
    kind = _ENDINGS.get(Ending(ending)) or _LOOPS.get(loop) or ("O", loop.replace("_", " "), style.MUTED)
    reserved = Ending(ending) in (Ending.STATUS, Ending.WIDE)
    return kind, kind[0] + (_RESERVATION if reserved else "")


def _edges(axis: Axis, values: FloatArray) -> FloatArray:
    """Edges of cells around the values, in the axis' own spacing."""
    place = np.log(values) if axis.spacing == "log" else values
    middle = (place[1:] + place[:-1]) / 2
    ends = np.concatenate([[2 * place[0] - middle[0]], middle, [2 * place[-1] - middle[-1]]])
    return np.exp(ends) if axis.spacing == "log" else ends


def _label(axis: Axis) -> str:
    told = axis.title if axis.unit == "1" else f"{axis.title} in {_shown(axis.unit)}"
    return fill(told, _LABEL)


SECTION: Final = Section(name="extremes", title="At the extremes", show=_view)
"""Shown also where it was not run, to say how it is."""
