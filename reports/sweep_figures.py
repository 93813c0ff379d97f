"""Figures of a sweep: a map over two keys, or curves over one, with feasible points, boundary and best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ringbalance.design.axes import unit_of_path
from ringbalance.design.sweep import Sweep
from ringbalance.reports.figure import FIFTH, FOUND, INK, MAP, MUTED, AxisLabel, Drawing, draw
from ringbalance.results.numbers import format_given
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.platform.files import write_whole

_COLUMNS: Final = ("fraction", "settling_time", "reach", "velocity", "loop_factor")
"""Columns of a sweep that are drawn if they have numbers."""
_MAX_NOTE_CHARACTERS: Final = 50
_OUTSIDE: Final = {"marker": "x", "linewidths": 1.0}
_POINT_SHADES: Final = MAP[3:]
"""Shades of points, which stand out from the page."""
_BEST: Final = {"marker": "*", "facecolors": "none", "edgecolors": INK}
_Shades = list[tuple[str, BoolArray]]
"""Colours, each with a mask of its points."""


@dataclass(frozen=True, kw_only=True)
class _View:
    """Part of a sweep that its figures show."""

    sweep: Sweep
    paths: tuple[str, ...]
    """Keys of one or two axes."""
    shown: BoolArray
    """Mask of the points; in a grid of more axes the others have the values of one row."""
    note: str
    """Values of the other axes; empty: all points are shown."""


def sweep_figures(sweep: Sweep, folder: Path) -> tuple[Path, ...]:
    """Write `sweep_drawings` into a folder. Returns: The files. Raises: OSError: they cannot be written."""
    drawings = sweep_drawings(sweep)
    return tuple(write_whole(folder / f"{each.name}.svg", each.standalone()) for each in drawings)


def sweep_drawings(sweep: Sweep) -> list[Drawing]:
    """A figure of each quantity over the keys that vary; none where a key takes texts.

    A grid of more than two axes is drawn over the two with most values, with the others as in the best row.
    """
    fields = {name: (unit, values) for name, unit, values in sweep.fields()}
    view = _view(sweep)
    if view is None:
        return []
    return [
        _drawing(view, name, *fields[name])
        for name in _COLUMNS
        if name in fields and any(value is not None for value in np.array(fields[name][1])[view.shown])
    ]


def _view(sweep: Sweep) -> _View | None:
    """Axes and points to draw; None where no axis has numbers."""
    numbers = [
        axis
        for axis in sweep.plan.axes
        if not axis.names and all(isinstance(point.get(axis.head), int | float) for point in sweep.points)
    ]
    shown = np.ones(len(sweep.points), dtype=np.bool_)
    if not numbers:
        return None
    if sweep.plan.sample:
        paths = tuple(axis.head for axis in numbers[:2])
        return _View(sweep=sweep, paths=paths, shown=shown, note="")
    most = sorted(numbers, key=lambda axis: -len(axis.grid()))[:2]
    axes = [axis for axis in sweep.plan.axes if axis in most]
    row = sweep.best_or_nearest or 0
    others = [axis for axis in sweep.plan.axes if axis not in most and len(axis.grid()) > 1]
    for axis in others:
        values = [sweep.points[row].get(path) for path in axis.paths]
        shown &= [[point.get(path) for path in axis.paths] == values for point in sweep.points]
    held = ", ".join(sweep.axis_text(axis, row) for axis in others)
    note = f"{held if len(held) <= _MAX_NOTE_CHARACTERS else 'other keys'} as in row {row}" if others else ""
    return _View(sweep=sweep, paths=tuple(axis.head for axis in axes), shown=shown, note=note)


def _drawing(view: _View, name: str, unit: str, values: list[Any]) -> Drawing:
    sweep, paths = view.sweep, view.paths
    keys = [np.array([point[path] for point in sweep.points], dtype=np.float64)[view.shown] for path in paths]
    shown = np.array([np.nan if value is None else value for value in values], dtype=np.float64)[view.shown]
    axes: list[AxisLabel] = [(path, unit_of_path(sweep.scene, path)) for path in paths]
    title = name.replace("_", " ")
    feasible = np.array(sweep.feasible)[view.shown]
    best = np.flatnonzero(view.shown) == sweep.best_or_nearest
    over = [*keys, shown][:2]

    def points(panel: Axes, mask: BoolArray, **look: Any) -> None:
        if mask.any():
            panel.scatter(*(each[mask] for each in over), zorder=3, **look)

    def paint(panel: Axes) -> None:
        inside, outside = [(FOUND, feasible)], [(FIFTH, ~feasible)]
        if len(keys) == 1:
            order = np.argsort(over[0], kind="stable")
            panel.plot(over[0][order], over[1][order], color=MUTED, linewidth=1)
            _noted(panel, view.note)
        else:
            inside, outside = _coloured(panel, view, keys, shown, feasible, title, unit)
        for index, (shade, mask) in enumerate(inside):
            points(panel, mask, s=14, color=shade, label="" if index else "feasible")
        for index, (shade, mask) in enumerate(outside):
            points(panel, mask, s=14, color=shade, label="" if index else "not feasible", **_OUTSIDE)
        points(panel, best, s=90, label="nearest" if sweep.best is None else "best", **_BEST)

    y = axes[1] if len(axes) > 1 else (title, unit)
    return draw(f"sweep-{name.replace('_', '-')}", paint, x=axes[0], y=y, columns=3, wide=True, height=3.6)


def _noted(panel: Axes, *parts: str) -> None:
    """Write a line of text above the frame, to the right of the legend."""
    panel.text(1, 1.02, "; ".join(filter(None, parts)), ha="right", transform=panel.transAxes)


def _coloured(
    panel: Axes, view: _View, keys: list[Any], shown: Any, feasible: Any, title: str, unit: str
) -> tuple[_Shades, _Shades]:
    """Shades over a grid of two keys, with the boundary of what is feasible; else those of points.

    Returns: Colours of the feasible points and of the others that are still to be drawn.
    """
    finite = shown[np.isfinite(shown)]
    low, high = float(finite.min()), float(finite.max())
    ends = (
        f"{title}: {format_given(low, unit, digits=3)} (light) to {format_given(high, unit, digits=3)} (dark)"
    )
    _noted(panel, view.note, ends)
    sizes = [len(np.unique(each)) for each in keys]
    if view.sweep.plan.sample or min(sizes) < 2 or math.prod(sizes) != shown.size:
        without = (FIFTH, ~feasible & ~np.isfinite(shown))
        return _shades(shown, low, high, feasible), [*_shades(shown, low, high, ~feasible), without]
    x, y, z, inside = (np.reshape(each, sizes) for each in (*keys, shown, feasible))
    colours = ListedColormap(list(MAP))
    panel.pcolormesh(x, y, z, shading="nearest", edgecolors="none", cmap=colours, vmin=low, vmax=high)
    if inside.any() and not inside.all():
        panel.contour(x, y, inside.astype(float), levels=[0.5], colors=INK, linewidths=1.2)
    return [], [(FIFTH, ~feasible)]


def _shades(shown: FloatArray, low: float, high: float, among: BoolArray) -> _Shades:
    """Shades of points, the darkest first, each with a mask of its points."""
    share = np.nan_to_num((shown - low) / ((high - low) or 1.0))
    index = np.minimum(share * len(_POINT_SHADES), len(_POINT_SHADES) - 1).astype(int)
    finite = among & np.isfinite(shown)
    masks = [(shade, finite & (index == number)) for number, shade in enumerate(_POINT_SHADES)]
    return [(shade, mask) for shade, mask in reversed(masks) if mask.any()]
