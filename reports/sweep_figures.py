"""Figures of a sweep: a map over two keys, or curves over one, with what is not feasible and the best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_hex
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import FuncFormatter, MaxNLocator
from matplotlib.transforms import Bbox

from ringbalance.design.axes import SweepAxis, unit_of_path
from ringbalance.design.sensitivity import MIN_ROWS, shares_alone
from ringbalance.design.static import BLOCKED, REFUSED
from ringbalance.design.sweep import Sweep, SweepColumn
from ringbalance.reports.figure import (
    COLUMN_IN,
    FOUND,
    INK,
    LIGHT_RAMP,
    MUTED,
    POINT_RAMP,
    SURFACE,
    AxisLabel,
    Drawing,
    draw,
    figure_of,
    plain_number,
)
from ringbalance.reports.figures_page import READING_FILE, ReadableFigure, ReadingColumn, figures_page
from ringbalance.reports.prose import input_name, opening, typeset
from ringbalance.results.numbers import display_unit
from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray
from ringbalance.scene.describe import setting_text, usual_name
from ringbalance.scene.platform.files import write_whole

COLUMNS: Final = MappingProxyType(
    {
        "fraction": "fraction of devices that meet the requirements",
        "settling_time": "time to settle",
        "reach": "usable moment in any direction",
        "velocity": "flow velocity",
        "loop_factor": "loop factor",
    }
)
"""Columns of a sweep that are drawn if they have numbers, with their names in words."""
_REASONS: Final = MappingProxyType({BLOCKED: "no flow", REFUSED: "refused scene"})
"""Reasons why a point has no value, by its status."""
_TOO_FEW: Final = "too few devices settle"
_MAX_NOTE_CHARACTERS: Final = 50
_MAX_COLUMN_NOTE_CHARACTERS: Final = 40
_MAX_BAR_LABEL_CHARACTERS: Final = 26
_CONTOURS: Final = 6
"""Largest number of steps between contour lines."""
_RASTER_PIXELS: Final = 600
"""Least number of pixels along each side of a map: where a viewer smooths pictures, cells stay sharp."""
_POINT_SHADES: Final = 24
"""Number of shades of the points of a sample."""
_POINT_PT: Final = 4.0
_DENSE_POINTS: Final = 600
"""Number of points beyond which they are drawn in half the size."""
_BAR_IN, _BAR_GAP_IN, _BAR_SPACE_IN = 0.12, 0.1, 0.8
_BEST: Final[dict[str, Any]] = {
    "marker": "*",
    "s": 90,
    "zorder": 5,
    "facecolors": SURFACE,
    "edgecolors": INK,
}
_HATCHED: Final[dict[str, Any]] = {"facecolor": "none", "edgecolor": MUTED, "linewidth": 0.0}


@dataclass(frozen=True, kw_only=True)
class View:
    """Part of a sweep that the figure of a quantity shows."""

    sweep: Sweep
    column: SweepColumn
    paths: tuple[str, ...]
    """Keys of one or two axes."""
    shown: BoolArray
    """Mask of the points; in a grid of more axes the others have the values of one row."""
    held: str
    """Names and values of the other axes; empty: all points are shown."""

    def keys(self) -> list[FloatArray]:
        """Values of the keys at the points shown, SI."""
        points = self.sweep.points
        return [np.array([p[path] for p in points], dtype=np.float64)[self.shown] for path in self.paths]

    def values(self) -> FloatArray:
        """Values of the quantity at the points shown, SI; NaN where not known."""
        return np.asarray(self.column.array[self.shown], dtype=np.float64)


def sweep_figures(sweep: Sweep, folder: Path) -> tuple[Path, ...]:
    """Write the figures of a sweep, each for the page's width and for a column of 85 mm, and a page on which
    they answer a pointer with their values.

    Returns: The files, the page last. Raises: OSError: they cannot be written.
    """
    views = _views(sweep)
    narrow = [_drawing(view, COLUMN_IN) for view in views]
    drawings = [*(_drawing(view, None) for view in views), *narrow]
    texts = {f"{each.name}.svg": each.standalone() for each in drawings}
    if views:
        texts[READING_FILE] = _page(views, narrow)
    return tuple(write_whole(folder / name, text) for name, text in texts.items())


def _page(views: list[View], drawings: list[Drawing]) -> str:
    """Page of figures in which a point is read out with all that is known of it."""
    view, sweep = views[0], views[0].sweep
    fields = {column.name: column for column in sweep.fields()}
    names = {"row": "row"}
    for axis in sweep.plan.axes:
        names |= {axis.head: axis.head} if axis.names else {}
        names |= {path: axis_name(path) for path in axis.paths}
    columns = []
    for name, words in {**names, **COLUMNS, "verdict": "verdict", "finding": "reason"}.items():
        values = np.array(fields[name].values, dtype=object)[view.shown] if name in fields else ()
        if any(value not in (None, "") for value in values):
            texts = [_REASONS.get(value, value) for value in values] if name == "verdict" else [*values]
            unit = "" if any(isinstance(text, str) for text in texts) else fields[name].unit
            columns.append(ReadingColumn(name=words, values=texts, unit=unit))
    figures = []
    for each, drawing in zip(views, drawings, strict=True):
        (x, y), words = [*each.keys(), each.values()][:2], COLUMNS[each.column.name]
        label = f"{words} over {' and '.join(map(axis_name, each.paths))}"
        caption = f"{opening(words)}."
        figures.append(ReadableFigure(drawing=drawing, label=label, caption=caption, curves=[(x, y)]))
    best = np.flatnonzero(np.flatnonzero(view.shown) == sweep.best_or_nearest)
    note = f" {opening(view.held)}, as in row {sweep.best_or_nearest or 0}." if view.held else ""
    return figures_page(
        sweep.scene.name,
        f"Sweep of {sweep.scene.source}, {len(sweep.points)} points.{note}",
        columns,
        figures,
        start=int(best[0]) if len(best) else 0,
        along_x=len(view.paths) == 1,
        has_dark=False,
    )


def _stem(column: str) -> str:
    return f"sweep-{column.replace('_', '-')}"


def sweep_drawings(sweep: Sweep, *, width: float | None = None) -> list[Drawing]:
    """A figure of each quantity over the keys that vary; none where a key takes texts.

    A sample of more than two axes is drawn over the two with the largest shares of the quantity, a grid over
    the two with most values (of as many, those with the largest shares of `Sweep.main_result`), with the
    others as in the best row; the axes that vary first where shares are not known.
    Args: `width`: inches; None: the page's width.
    """
    return [_drawing(view, width) for view in _views(sweep)]


def _views(sweep: Sweep) -> list[View]:
    """Content of each quantity's figure; empty where no axis has numbers."""
    axes = [
        axis
        for axis in sweep.plan.axes
        if not axis.names and all(isinstance(point.get(axis.head), int | float) for point in sweep.points)
    ]
    fields = {column.name: column for column in sweep.fields()}
    views = [_view(sweep, fields, name, axes) for name in COLUMNS if axes and name in fields]
    return [view for view in views if np.isfinite(view.values()).any()]


def _shares(sweep: Sweep, result: SweepColumn, axes: list[SweepAxis]) -> list[float]:
    """Share of a result that each axis explains; zeros where not known."""
    finite = np.isfinite(result.array)
    if np.count_nonzero(finite) < MIN_ROWS:
        return [0.0] * len(axes)
    keys = np.array([[point[axis.head] for axis in axes] for point in sweep.points], dtype=np.float64)
    return [*map(float, shares_alone(keys[finite], result.array[finite])[0])]


def _view(sweep: Sweep, fields: dict[str, SweepColumn], name: str, axes: list[SweepAxis]) -> View:
    sample = sweep.plan.sample
    # All maps of a grid show the same points, so that one page can read them out.
    decided = fields[name] if sample else fields.get(sweep.main_result, fields[name])
    shares = _shares(sweep, decided, axes)
    ranked = sorted(
        (0 if sample else -len(axis.grid()), -share, i)
        for i, (axis, share) in enumerate(zip(axes, shares, strict=True))
    )
    most = [axes[i] for *_, i in ranked[:2]]
    paths = tuple(axis.head for axis in axes if axis in most)
    shown = np.ones(len(sweep.points), dtype=np.bool_)
    if sample:
        return View(sweep=sweep, column=fields[name], paths=paths, shown=shown, held="")
    row = sweep.best_or_nearest or 0
    others = [axis for axis in sweep.plan.axes if axis not in most and len(axis.grid()) > 1]
    for axis in others:
        values = [sweep.points[row].get(path) for path in axis.paths]
        shown &= [[point.get(path) for path in axis.paths] == values for point in sweep.points]
    held = ", ".join(_held_text(sweep, axis, row) for axis in others)
    return View(sweep=sweep, column=fields[name], paths=paths, shown=shown, held=held)


def _held_text(sweep: Sweep, axis: SweepAxis, row: int) -> str:
    """Value of an axis in a row, under the name that a figure's axis has."""
    point = sweep.points[row]
    if axis.names:
        return f"{axis.head.partition('.')[0]}: {axis.name_of(point)}"
    return ", ".join(f"{axis_name(path)} = {setting_text(path, point.get(path))}" for path in axis.paths)


def axis_name(path: str) -> str:
    """Name of a key on an axis, such as "bore d", with its owner where it has no symbol."""
    name = usual_name(path)
    return input_name(path) if name == path or " " not in name else typeset(name)


def _drawing(view: View, width: float | None) -> Drawing:
    sweep, keys, shown = view.sweep, view.keys(), view.values()
    name, unit = view.column.name, view.column.unit
    axes: list[AxisLabel] = [(axis_name(path), unit_of_path(sweep.scene, path)) for path in view.paths]
    feasible = np.array(sweep.feasible)[view.shown]
    best = np.flatnonzero(view.shown) == sweep.best_or_nearest
    over, page = [*keys, shown][:2], width is None
    statuses = {
        row["status"]
        for row, finite in zip(np.array(sweep.static)[view.shown], np.isfinite(shown), strict=True)
        if not finite
    }
    reasons = ", ".join(sorted({_REASONS.get(status, _TOO_FEW) for status in statuses}))
    unmet = "not met or undecided" if sweep.runs else "no flow"

    def paint(panel: Axes) -> None:
        if view.held:
            note = view.held if len(view.held) <= _MAX_NOTE_CHARACTERS else "other keys held"
            panel.plot([], [], linestyle="", label=note if page else fill(note, _MAX_COLUMN_NOTE_CHARACTERS))
        if len(keys) == 1:
            order = np.argsort(over[0], kind="stable")
            panel.plot(over[0][order], over[1][order], color=MUTED, linewidth=1)
            _points(panel, over, np.full(shown.size, FOUND), feasible, unmet)
        else:
            _coloured(panel, view, keys, shown, feasible, (COLUMNS[name], unit), (unmet, reasons))
        if best.any():
            label = "nearest" if sweep.best is None else "best"
            panel.scatter(*(each[best] for each in over), label=label, **_BEST)

    y = axes[1] if len(axes) > 1 else (COLUMNS[name], unit)
    stem = _stem(name)
    size: dict[str, Any] = {"height": 3.6 if page else 2.9, "columns": 4 if page else 2, "wide": page}
    return draw(stem if page else f"{stem}-85mm", paint, x=axes[0], y=y, width=width, **size)


def _points(
    panel: Axes, over: list[FloatArray], colours: StringArray, feasible: BoolArray, unmet: str
) -> None:
    """Points as dots where feasible, as rings elsewhere.

    A line without length and with round ends is a dot, in a quarter of the bytes of a marker.
    """
    positions = np.stack(over[:2], axis=1)
    diameter = _POINT_PT / (2 if len(positions) > _DENSE_POINTS else 1)

    def dots(mask: BoolArray, colour: str, size: float) -> None:
        codes = np.resize([Outline.MOVETO, Outline.LINETO], 2 * np.count_nonzero(mask))
        shape = Outline(np.repeat(positions[mask], 2, axis=0), codes)
        # Lines without length would be left out.
        shape.should_simplify = False
        look: dict[str, Any] = {"linewidth": size, "capstyle": "round", "fill": False, "zorder": 3}
        panel.add_patch(PathPatch(shape, edgecolor=colour, **look))

    for mask, hollow, label in ((feasible, False, "feasible"), (~feasible, True, f"not feasible: {unmet}")):
        for colour in sorted({*colours[mask].tolist()}):
            dots(mask & (colours == colour), colour, diameter)
        if mask.any():
            if hollow:
                dots(mask, SURFACE, diameter / 2)
            look: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": _POINT_PT, "color": INK}
            panel.plot([], [], markerfacecolor=SURFACE if hollow else INK, label=label, **look)
    panel.autoscale_view()


def _coloured(
    panel: Axes,
    view: View,
    keys: list[FloatArray],
    shown: FloatArray,
    feasible: BoolArray,
    quantity: AxisLabel,
    words: tuple[str, str],
) -> None:
    """A grid of two keys as coloured cells with contour lines, or a sample as coloured points, with the bar.

    Args: `words`: why points are not feasible, and why they have no value.
    """
    finite, (unmet, reasons) = shown[np.isfinite(shown)], words
    low, high = float(finite.min()), float(finite.max())
    norm = Normalize(low, high if high > low else low + (abs(low) or 1.0))
    display = display_unit(quantity[1], low, high)
    ticks = MaxNLocator(_CONTOURS, steps=[1, 2, 5, 10]).tick_values(
        low * display.factor, high * display.factor
    )
    levels = [tick / display.factor for tick in ticks if low < tick / display.factor < high]
    panel.grid(visible=False)
    sizes = [len(np.unique(each)) for each in keys]
    sample = view.sweep.plan.sample or min(sizes) < 2 or math.prod(sizes) != shown.size
    _bar(panel, ScalarMappable(norm, POINT_RAMP if sample else LIGHT_RAMP), levels, quantity)
    if sample:
        steps = np.round(_POINT_SHADES * norm(np.where(np.isfinite(shown), shown, low))) / _POINT_SHADES
        colours = np.array([to_hex(POINT_RAMP(step)) for step in steps])
        colours[~np.isfinite(shown)] = MUTED
        _points(panel, keys, colours, feasible, unmet)
        return
    x, y, z, inside = (np.reshape(each, sizes) for each in (*keys, shown, feasible))
    # The first axis that varies is that of the rows.
    order = np.argsort(x[:, 0]), np.argsort(y[0])
    across, down, z, inside = x[order[0], 0], y[0, order[1]], z[np.ix_(*order)].T, inside[np.ix_(*order)].T
    edges = [_edges(across), _edges(down)]
    columns, rows = (
        np.searchsorted(each, np.linspace(each[0], each[-1], 2 * count + 1)[1::2]) - 1
        for each, count in ((each, (len(each) - 1) * -(-_RASTER_PIXELS // (len(each) - 1))) for each in edges)
    )
    picture = LIGHT_RAMP(norm(np.where(np.isfinite(z), z, low)), bytes=True)
    picture[~np.isfinite(z)] = (255, 255, 255, 0)
    extent = (edges[0][0], edges[0][-1], edges[1][0], edges[1][-1])
    panel.imshow(
        picture[np.ix_(rows, columns)], extent=extent, origin="lower", aspect="auto", interpolation="none"
    )
    empty = ~np.isfinite(z)
    for mask, hatch, label in (
        (empty, "xxxx", f"no value: {reasons}"),
        (~inside & ~empty, "///", f"not feasible: {unmet}"),
    ):
        if mask.any():
            panel.add_patch(PathPatch(_outline(mask, *edges), label=label, hatch=hatch, **_HATCHED))
    if min(sizes) > 2 and levels:
        lines = panel.contour(
            across, down, np.ma.masked_invalid(z), levels=levels, colors=INK, linewidths=0.7
        )
        panel.clabel(lines, fmt=lambda level: plain_number(level * display.factor), fontsize="small")
    panel.set(xlim=extent[:2], ylim=extent[2:])


def _bar(panel: Axes, colours: ScalarMappable, levels: list[float], quantity: AxisLabel) -> None:
    """Colour bar at the right of a map, which keeps its height, with the unit once."""
    figure, box = figure_of(panel), panel.get_position()
    space, gap, width = (each / figure.get_figwidth() for each in (_BAR_SPACE_IN, _BAR_GAP_IN, _BAR_IN))
    panel.set_position((box.x0, box.y0, box.width - space, box.height))
    bar = figure.add_axes((0, 0, 1, 1))

    def bar_box(*_: object) -> Bbox:
        map_box = panel.get_position()
        return Bbox.from_bounds(map_box.x1 + gap, map_box.y0, width, map_box.height)

    bar.set_axes_locator(bar_box)
    name, display = quantity[0], display_unit(quantity[1], *colours.get_clim())
    figure.colorbar(colours, cax=bar, ticks=levels)
    bar.yaxis.set_major_formatter(FuncFormatter(lambda level, _: plain_number(level * display.factor)))
    text = f"{name} in {display.symbol}" if display.symbol not in ("", "1") else name
    bar.set_ylabel(fill(text, _MAX_BAR_LABEL_CHARACTERS))


def _edges(centres: FloatArray) -> FloatArray:
    """Ends of cells half-way between their centres, the outermost as far out as in."""
    half = np.diff(centres) / 2
    return np.concatenate([[centres[0] - half[0]], centres[:-1] + half, [centres[-1] + half[-1]]])


def _outline(mask: BoolArray, across: FloatArray, down: FloatArray) -> Outline:
    """Area of the cells of a mask, each run of cells in a row as one rectangle."""
    parts = []
    for row, cells in enumerate(mask):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], cells.astype(int), [0]])))
        for start, stop in ends.reshape(-1, 2):
            (left, right), (low, high) = across[[start, stop]], down[row : row + 2]
            corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
            parts.append(Outline(corners, closed=True))
    return Outline.make_compound_path(*parts)
