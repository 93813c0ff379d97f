"""Figures of flow fields: colour in twelve shades, streamlines on top."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter
from matplotlib.tri import Triangulation

from ringbalance.reports.figures.style import INK, MAP, MUTED, NARROW, Drawing, draw, plain_number
from ringbalance.reports.numbers import number, percent
from ringbalance.scene.arrays import FloatArray

Record = dict[str, Any]

_SHARES: Final = (0.1, 0.3, 0.5, 0.7, 0.9)
_FLOW_THROUGH: Final = 1 / 8
"""Stream function at the tube's wall, over U d^2."""
_LINES: Final = 6
_BAR: Final = 0.11
"""Height of the colour bar, in."""
_TOP: Final = 0.5
_BOTTOM: Final = 0.42
_LEFT: Final = 0.62


def _unpacked(record: Record, name: str) -> FloatArray:
    return np.array(record[name].split(), dtype=np.float64)


def _triangulation(record: Record, *, order: tuple[int, int] = (0, 1), sign: float = 1.0) -> Triangulation:
    points = _unpacked(record, "points").reshape(2, -1)
    triangles = np.array(record["triangles"].split(), dtype=np.int64).reshape(-1, 3)
    return Triangulation(points[order[0]], sign * points[order[1]], triangles)


def _place(figure: Figure, axes: Axes, width: float, height: float) -> None:
    """Gives the axes equal scales in the room below the colour bar."""
    total = figure.get_figheight()
    room, tall = NARROW - _LEFT - 0.1, total - _BOTTOM - _TOP
    scale = min(room / width, tall / height)
    axes.set_position((_LEFT / NARROW, _BOTTOM / total, scale * width / NARROW, scale * height / total))
    axes.grid(visible=False)


def _colour_bar(figure: Figure, levels: FloatArray, title: str) -> None:
    total = figure.get_figheight()
    bar = figure.add_axes((_LEFT / NARROW, 1 - 0.3 / total, 0.46, _BAR / total))
    width = levels[1] - levels[0]
    for low, shade in zip(levels, MAP, strict=False):
        bar.add_patch(Rectangle((low, 0), width, 1, color=shade, linewidth=0))
    bar.set_xlim(levels[0], levels[-1])
    bar.set_ylim(0, 1)
    bar.set_yticks([])
    bar.set_xticks(levels[::4])
    bar.xaxis.set_major_formatter(FuncFormatter(plain_number))
    bar.tick_params(length=2, pad=1.5, labelsize=7.5)
    bar.grid(visible=False)
    for spine in bar.spines.values():
        spine.set_visible(False)
    figure.text(_LEFT / NARROW + 0.49, 1 - 0.25 / total, title, fontsize=8, va="center", color=INK)


def _levels(values: FloatArray) -> FloatArray:
    """Thirteen even levels from zero to a round number."""
    top = float(values.max())
    step = next(s for s in (0.05, 0.1, 0.125, 0.15, 0.175, 0.2, 0.25, 0.3, 0.5, 1.0, 2.0) if 12 * s >= top)
    return np.asarray(step * np.arange(13), dtype=np.float64)


def section_figure(record: Record) -> Drawing:
    """Axial velocity in colour and in-plane streamlines in the section of the turning tube.

    Args: `record`: `section` of the evidence's `inside`.
    """
    field, psi = _unpacked(record, "colour"), _unpacked(record, "stream_function")
    drift = _unpacked(record, "velocity").reshape(2, -1)
    mesh = _triangulation(record, order=(1, 0))
    strongest = float(np.hypot(*drift).max())

    def paint(figure: Figure, axes: Axes) -> None:
        levels = _levels(field)
        axes.tricontourf(mesh, np.clip(field, 0, levels[-1]), levels=levels, colors=list(MAP))
        top = float(np.abs(psi).max())
        if top > 0:
            rising = sorted([-s * top for s in _SHARES] + [s * top for s in _SHARES])
            axes.tricontour(mesh, psi, levels=rising, colors=[INK], linewidths=0.8, linestyles=["-"])
            way = float(np.sign(drift[0, np.argmin(np.hypot(*_unpacked(record, "points").reshape(2, -1)))]))
            axes.annotate(
                "",
                (0, 0.17 * way),
                xytext=(0, -0.17 * way),
                arrowprops={"arrowstyle": "->", "color": INK, "linewidth": 1.4},
            )
        axes.add_patch(Circle((0, 0), 0.5, fill=False, color=MUTED, linewidth=1.4))
        axes.set_xlim(-0.53, 0.53)
        axes.set_ylim(-0.53, 0.53)
        axes.set_xlabel("z/d, along the axis of rotation")
        axes.set_ylabel("y/d")
        _place(figure, axes, 1.0, 1.0)
        _colour_bar(figure, levels, "axial velocity over its mean")

    re, rotation = (number(record[key], digits=3) for key in ("reynolds", "rotation_reynolds"))
    more = percent(record["friction_ratio"] - 1, signed=True, digits=2)
    return draw(
        name="flow-section",
        paint=paint,
        height=4.6,
        alt="Section of the turning tube: two mirrored vortices across the axial flow, whose peak they move "
        "towards one wall.",
        caption=f"Developed laminar flow in the turning tube’s section, Re {re}, ωd²/ν {rotation}: axial "
        "velocity in colour, in-plane streamlines; arrow: the way of the core. In-plane it is at most "
        f"{percent(strongest, digits=2)} of the mean velocity, yet friction changes by {more}.",
    )


def end_figure(record: Record, end: str) -> Drawing:
    """Speed in colour and streamlines where liquid enters or leaves the tube.

    Args: `record`: of the evidence's `inside`. `end`: "entrance" or "exit".
    """
    field, psi = _unpacked(record, "colour"), _unpacked(record, "stream_function")
    points = _unpacked(record, "points").reshape(2, -1)
    low, high = float(points[0].min()), float(points[0].max())
    reach = 1.5
    left, right = (max(low, -1.5), min(high, 3.5)) if end == "entrance" else (-1.5, min(high, 5.0))
    inner = {"entrance": (0.0, right), "exit": (left, 0.0)}[end]

    def paint(figure: Figure, axes: Axes) -> None:
        levels = _levels(field)
        lines = _FLOW_THROUGH * (np.arange(1, _LINES) / _LINES) ** 2
        for sign in (1.0, -1.0):
            mesh = _triangulation(record, sign=sign)
            axes.tricontourf(mesh, np.clip(field, 0, levels[-1]), levels=levels, colors=list(MAP))
            axes.tricontour(mesh, psi, levels=lines, colors=[INK], linewidths=0.7, linestyles=["-"])
            corner = (inner[0], 0.5 if sign > 0 else -reach)
            axes.add_patch(
                Rectangle(corner, inner[1] - inner[0], reach - 0.5, color=MUTED, alpha=0.3, linewidth=0)
            )
        axes.set_xlim(left, right)
        axes.set_ylim(-reach, reach)
        axes.set_xlabel("x/d, along the flow")
        axes.set_ylabel("r/d")
        _place(figure, axes, right - left, 2 * reach)
        _colour_bar(figure, levels, "speed over the mean")

    re = number(record["reynolds"], digits=3)
    what = {
        "entrance": "Streamlines converge from all sides at the sharp edge",
        "exit": "The stream leaves as a jet that takes its kinetic energy along",
    }[end]
    return draw(
        name=f"flow-{end}",
        paint=paint,
        height=_BOTTOM + _TOP + (NARROW - _LEFT - 0.1) * 2 * reach / (right - left),
        alt=f"Laminar flow at the tube’s {end}: speed and streamlines. {what}.",
        caption=f"The tube’s {end}, laminar at Re {re}: speed in colour, streamlines. {what}.",
    )
