"""Flow inside the tube, drawn: the secondary flow of its turning section, its entrance and its exit."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator
from matplotlib.tri import Triangulation

from ringbalance.physics.tube.loss import FlowState, tube_loss
from ringbalance.reports.figure import (
    INK,
    MAP,
    MUTED,
    AxisLabel,
    Drawing,
    Paint,
    draw,
    figure_of,
    plain_number,
)
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow_fields import FlowField, end_field, section_field
from ringbalance.verification.navier_stokes.tube import End

_MAX_REYNOLDS: Final = 500.0
"""Re up to which a flow is drawn; beyond, the layers of laminar flow are too thin for a picture."""
_DIGITS: Final = 4
_STREAM_FRACTIONS: Final = (0.1, 0.3, 0.5, 0.7, 0.9)
_WALL_STREAM_FUNCTION: Final = 1 / 8
"""Stream function at the tube's wall, over U d^2."""
_STREAM_LINES: Final = _WALL_STREAM_FUNCTION * np.linspace(0, 1, 7)[1:-1] ** 2
_PICTURE_HALF: Final = 1.5
"""Half of the picture of an end, from the axis of the tube, over d."""
_WINDOWS: Final[dict[End, tuple[float, float]]] = {"entrance": (-1.5, 3.5), "exit": (-1.5, 5.0)}
_TITLE_IN: Final = 0.4
"""Height of the text above the colour bar."""
_FRAME_IN: Final = 0.94 + _TITLE_IN
"""Height of axis, colour bar and the text above the bar."""
_FIELD_WIDTH_IN: Final = 2.9


def _collect(work: Work) -> Record | None:
    """Laminar flow fields at the operating point, or at the nearest one that can be drawn."""
    scene, speed = work.ring, float(work.calibration.answers.velocity)
    if not speed:
        return None
    loss = tube_loss(scene, speed)
    reynolds = float(loss.reynolds)
    reynolds_drawn = min(reynolds, _MAX_REYNOLDS)
    section = section_field(
        reynolds=reynolds_drawn, rotation_reynolds=loss.rotation_reynolds * reynolds_drawn / reynolds
    )
    ends = {name: end_field(name, reynolds=reynolds_drawn) for name in _WINDOWS}
    drift, centre = section.velocity[:2], np.argmin(np.hypot(*section.points))
    laminar = bool(loss.flow_state == FlowState.LAMINAR)
    return {
        "drawn": "not laminar" if not laminar else "as it is" if reynolds_drawn == reynolds else "too fast",
        "reynolds": reynolds,
        "rotation_reynolds": loss.rotation_reynolds,
        "laminar": laminar,
        "section": {
            **_field(section, section.velocity[2]),
            "rotation_reynolds": section.rotation_reynolds,
            "friction_ratio": section.friction_ratio,
            "friction_change": section.friction_ratio - 1,
            "largest_drift": float(np.hypot(*drift).max()),
            "core_goes": float(np.sign(drift[0, centre])),
        },
        **{name: _field(end, np.hypot(*end.velocity)) for name, end in ends.items()},
    }


def _field(flow: FlowField, colour: FloatArray) -> Record:
    return {
        "reynolds": flow.reynolds,
        "points": _packed(flow.points),
        "triangles": " ".join(str(node) for node in flow.triangles.ravel()),
        "colour": _packed(colour),
        "stream_function": _packed(flow.stream_function),
    }


def _packed(values: npt.ArrayLike) -> str:
    """Numbers as one line of text, which keeps a field of a thousand nodes short in the file."""
    return " ".join(f"{value:.{_DIGITS}g}" for value in np.asarray(values).ravel())


def _unpacked(record: Record, name: str) -> FloatArray:
    return np.array(record[name].split(), dtype=np.float64)


def _view(record: Record, _evidence: Record) -> Record:
    return {"section": _section(record["section"])} | {name: _end(record[name], name) for name in _WINDOWS}


def _section(record: Record) -> Drawing:
    """Axial velocity in colour and in-plane streamlines in the section of the turning tube."""
    y, z = _unpacked(record, "points").reshape(2, -1)
    psi, tip = _unpacked(record, "stream_function"), 0.17 * record["core_goes"]
    top = float(np.abs(psi).max())
    lines = np.sort(np.outer((-top, top), _STREAM_FRACTIONS).ravel()) if top > 0 else None

    def paint(axes: Axes) -> None:
        _fill(axes, record, (z, y), lines, "axial velocity over the mean")
        if top > 0:
            arrow = {"arrowstyle": "->", "color": INK, "linewidth": 1.4}
            axes.annotate("", (0, tip), xytext=(0, -tip), arrowprops=arrow)
        axes.add_patch(Circle((0, 0), 0.5, fill=False, color=MUTED, linewidth=1.4))

    label = ("z/d, along the axis of rotation", "1")
    return _drawing("section", paint, (-0.53, 0.53), (-0.53, 0.53), label, ("y/d", "1"))


def _end(record: Record, name: End) -> Drawing:
    """Speed in colour and streamlines where liquid enters or leaves the tube."""
    x, r = _unpacked(record, "points").reshape(2, -1)
    left, right = max(x.min(), _WINDOWS[name][0]), min(x.max(), _WINDOWS[name][1])
    start, stop = (0.0, right) if name == "entrance" else (left, 0.0)

    def paint(axes: Axes) -> None:
        for side in (1.0, -1.0):
            _fill(axes, record, (x, side * r), _STREAM_LINES, "speed over the mean" if side > 0 else "")
            corner = (start, 0.5 if side > 0 else -_PICTURE_HALF)
            wall = Rectangle(corner, stop - start, _PICTURE_HALF - 0.5, color=MUTED, alpha=0.3, linewidth=0)
            axes.add_patch(wall)

    label = ("x/d, along the flow", "1")
    return _drawing(name, paint, (left, right), (-_PICTURE_HALF, _PICTURE_HALF), label, ("r/d", "1"))


def _fill(axes: Axes, record: Record, points: tuple[FloatArray, FloatArray], lines: Any, title: str) -> None:
    """Draw a field in colour with its bar above, and streamlines. Args: `title`: empty: no bar."""
    mesh = Triangulation(*points, _unpacked(record, "triangles").astype(np.int64).reshape(-1, 3))
    colour = _unpacked(record, "colour")
    levels = np.linspace(0, MaxNLocator(4).tick_values(0, colour.max())[-1], len(MAP) + 1)
    filled = axes.tricontourf(mesh, colour, levels=levels, colors=list(MAP))
    if lines is not None:
        psi = _unpacked(record, "stream_function")
        axes.tricontour(mesh, psi, levels=lines, colors=[INK], linewidths=0.7, linestyles=["-"])
    if title:
        look: Record = {"ticks": levels[::3], "format": FuncFormatter(plain_number), "aspect": 22}
        bar = figure_of(axes).colorbar(filled, ax=axes, location="top", label=title, **look)
        bar.outline.set_visible(False)


def _drawing(
    name: str, paint: Paint, xlim: tuple[float, float], ylim: tuple[float, float], x: AxisLabel, y: AxisLabel
) -> Drawing:
    wide, tall = xlim[1] - xlim[0], ylim[1] - ylim[0]
    height = _FRAME_IN + _FIELD_WIDTH_IN * tall / wide

    def scaled(axes: Axes) -> None:
        box = axes.get_position()
        axes.set_position((box.x0, box.y0, box.width, box.height - _TITLE_IN / height))
        paint(axes)
        axes.set(aspect="equal")
        axes.grid(visible=False)

    return draw(f"flow-{name}", scaled, x=x, y=y, xlim=xlim, ylim=ylim, columns=0, height=height)


SECTION: Final = Section(name="inside", title="Flow inside the tube", collect=_collect, show=_view)
