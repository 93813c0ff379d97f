"""Figures of a sweep: a map over two keys, or curves over one, with feasible points, boundary and best."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ringbalance.design.axes import unit_of_path
from ringbalance.design.sweep import Sweep
from ringbalance.reports.figure import FIFTH, FOUND, INK, MAP, MUTED, Axis, Drawing, draw
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.platform.files import write_whole

_SHOWN: Final = ("fraction", "settling_time", "reach", "velocity", "loop_factor")
"""Columns that are drawn, where there are numbers."""
_OUTSIDE: Final = {"marker": "x", "color": FIFTH, "linewidths": 0.8}
_BEST: Final = {"marker": "*", "facecolors": "none", "edgecolors": INK}


def sweep_figures(sweep: Sweep, folder: Path) -> tuple[Path, ...]:
    """Write a figure of each quantity over the keys that vary; none where a key takes texts.

    Returns: The files. Raises: OSError: they cannot be written.
    """
    fields = {name: (unit, values) for name, unit, values in sweep.fields()}
    paths = [path for path in sweep.plan.paths if _numbers(fields[path][1])][:2]
    if not paths:
        return ()
    drawings = [
        _drawing(sweep, paths, name, *fields[name])
        for name in _SHOWN
        if name in fields and any(value is not None for value in fields[name][1])
    ]
    return tuple(write_whole(folder / f"{each.name}.svg", each.standalone()) for each in drawings)


def _numbers(values: list[Any]) -> bool:
    return all(isinstance(value, int | float) for value in values)


def _drawing(sweep: Sweep, paths: list[str], name: str, unit: str, values: list[Any]) -> Drawing:
    keys = [np.array([point[path] for point in sweep.points], dtype=np.float64) for path in paths]
    shown = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    axes: list[Axis] = [(path, unit_of_path(sweep.scene, path)) for path in paths]
    title = name.replace("_", " ")
    best, feasible = sweep.best, np.array(sweep.feasible)
    over = [*keys, shown][:2]

    def points(panel: Axes, mask: Any, **look: Any) -> None:
        if mask.any():
            panel.scatter(*(each[mask] for each in over), zorder=3, **look)

    def paint(panel: Axes) -> None:
        if len(keys) == 1:
            order = np.argsort(over[0], kind="stable")
            panel.plot(over[0][order], over[1][order], color=MUTED, linewidth=1)
            points(panel, feasible, s=14, label="feasible", color=FOUND)
        elif not _shaded(panel, sweep, keys, shown, f"{title} in {unit}" if unit != "1" else title):
            # Points of one colour are written in a third of the time that each with its own takes.
            label = "feasible"
            for shade, mask in _shades_of(shown, feasible):
                points(panel, mask, s=14, label=label, color=shade)
                label = ""
        points(panel, ~feasible, s=12, label="not feasible", **_OUTSIDE)
        if best is not None:
            points(panel, np.arange(feasible.size) == best, s=90, label="best", **_BEST)

    y = axes[1] if len(axes) > 1 else (title, unit)
    return draw(f"sweep-{name.replace('_', '-')}", paint, x=axes[0], y=y, columns=3, wide=True, height=3.6)


def _span(shown: FloatArray) -> tuple[float, float]:
    return float(np.nanmin(shown)), float(np.nanmax(shown))


def _shades_of(shown: FloatArray, among: BoolArray) -> Iterator[tuple[str, BoolArray]]:
    """Each shade of the map, from dark to light, with the points that have it, where there are any."""
    low, high = _span(shown)
    share = (shown - low) / ((high - low) or 1.0)
    known = among & np.isfinite(shown)
    place = np.minimum(np.nan_to_num(share) * len(MAP), len(MAP) - 1).astype(int)
    for number in range(len(MAP) - 1, -1, -1):
        if (mask := known & (place == number)).any():
            yield MAP[number], mask


def _shaded(panel: Axes, sweep: Sweep, keys: list[Any], shown: FloatArray, label: str) -> bool:
    """Shades over a grid of two keys with the boundary of what is feasible; false: there is no such grid."""
    sizes = [len(each) for each in sweep.grid().values()]
    if len(sizes) != 2 or min(sizes) < 2:
        return False
    low, high = _span(shown)
    span: dict[str, Any] = {"cmap": ListedColormap(list(MAP)), "vmin": low, "vmax": high}
    x, y, z, inside = (np.reshape(each, sizes) for each in (*keys, shown, np.array(sweep.feasible)))
    panel.pcolormesh(x, y, z, shading="nearest", edgecolors="none", **span)
    if inside.any() and not inside.all():
        panel.contour(x, y, inside.astype(float), levels=[0.5], colors=INK, linewidths=1.2)
    panel.text(
        1, 1.02, f"{label}: {low:.3g} (light) to {high:.3g} (dark)", ha="right", transform=panel.transAxes
    )
    return True
