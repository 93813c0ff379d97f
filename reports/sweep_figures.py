"""Figures of a sweep: a map over two keys, or curves over one, with feasible points, boundary and best."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from ringbalance.design.axes import unit_of_path
from ringbalance.design.sweep import Sweep
from ringbalance.reports.figure import FIFTH, FOUND, INK, MAP, MUTED, Axis, Drawing, draw
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

    def points(panel: Axes, mask: Any, look: dict[str, Any]) -> None:
        if mask.any():
            mine = {key: each[mask] if isinstance(each, np.ndarray) else each for key, each in look.items()}
            panel.scatter(*(each[mask] for each in over), zorder=3, **mine)

    def paint(panel: Axes) -> None:
        look: dict[str, Any] = {"color": FOUND}
        if len(keys) == 1:
            order = np.argsort(over[0], kind="stable")
            panel.plot(over[0][order], over[1][order], color=MUTED, linewidth=1)
        else:
            look = _coloured(panel, sweep, keys, shown, f"{title} in {unit}" if unit != "1" else title)
        if look:
            points(panel, feasible, {"s": 14, "label": "feasible", **look})
        points(panel, ~feasible, {"s": 12, "label": "not feasible", **_OUTSIDE})
        if best is not None:
            points(panel, np.arange(feasible.size) == best, {"s": 90, "label": "best", **_BEST})

    y = axes[1] if len(axes) > 1 else (title, unit)
    return draw(f"sweep-{name.replace('_', '-')}", paint, x=axes[0], y=y, columns=3, wide=True, height=3.6)


def _coloured(panel: Axes, sweep: Sweep, keys: list[Any], shown: Any, label: str) -> dict[str, Any]:
    """Shades over a grid of two keys with the boundary of what is feasible; else a look of the points."""
    known = shown[np.isfinite(shown)]
    low, high = float(known.min()), float(known.max())
    span: dict[str, Any] = {"cmap": ListedColormap(list(MAP)), "vmin": low, "vmax": high}
    sizes = [len(each) for each in sweep.grid().values()]
    if len(sizes) != 2 or min(sizes) < 2:
        return {"c": shown, **span}
    x, y, z, inside = (np.reshape(each, sizes) for each in (*keys, shown, np.array(sweep.feasible)))
    panel.pcolormesh(x, y, z, shading="nearest", edgecolors="none", **span)
    if inside.any() and not inside.all():
        panel.contour(x, y, inside.astype(float), levels=[0.5], colors=INK, linewidths=1.2)
    panel.text(
        1, 1.02, f"{label}: {low:.3g} (light) to {high:.3g} (dark)", ha="right", transform=panel.transAxes
    )
    return {}
