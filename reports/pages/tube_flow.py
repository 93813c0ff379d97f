"""Flow inside the tube, drawn: the secondary flow of its turning section, its entrance and its exit."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter
from matplotlib.tri import Triangulation

from ringbalance.physics.tube.loss import FlowState, tube_loss
from ringbalance.reports.figure import INK, MAP, MUTED, NARROW, Drawing, draw, figure_of, plain_number
from ringbalance.reports.pages.cases import anchor, case_view
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow_fields import FlowField, end_field, section_field

_LARGEST: Final = 500.0
"""Re up to which a flow is drawn: beyond, a laminar one is thin layers that no picture shows."""
_CHECK: Final = "bent_tube_3d"
_DIGITS: Final = 4

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


def _place(axes: Axes, width: float, height: float) -> None:
    """Gives the axes equal scales in the room below the colour bar."""
    total = figure_of(axes).get_figheight()
    room, tall = NARROW - _LEFT - 0.1, total - _BOTTOM - _TOP
    scale = min(room / width, tall / height)
    axes.set_position((_LEFT / NARROW, _BOTTOM / total, scale * width / NARROW, scale * height / total))
    axes.grid(visible=False)


def _colour_bar(axes: Axes, levels: FloatArray, title: str) -> None:
    figure = figure_of(axes)
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
    bar.tick_params(length=2, pad=1.5)
    bar.grid(visible=False)
    for spine in bar.spines.values():
        spine.set_visible(False)
    figure.text(_LEFT / NARROW + 0.49, 1 - 0.25 / total, title, va="center", color=INK)


def _levels(values: FloatArray) -> FloatArray:
    """Thirteen even levels from zero to a round number."""
    top = float(values.max())
    step = next(s for s in (0.05, 0.1, 0.125, 0.15, 0.175, 0.2, 0.25, 0.3, 0.5, 1.0, 2.0) if 12 * s >= top)
    return np.asarray(step * np.arange(13), dtype=np.float64)


def _section_figure(record: Record) -> Drawing:
    """Axial velocity in colour and in-plane streamlines in the section of the turning tube.

    Args: `record`: `section` of the evidence's `inside`.
    """
    field, psi = _unpacked(record, "colour"), _unpacked(record, "stream_function")
    drift = _unpacked(record, "velocity").reshape(2, -1)
    mesh = _triangulation(record, order=(1, 0))

    def paint(axes: Axes) -> None:
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
        _place(axes, 1.0, 1.0)
        _colour_bar(axes, levels, "axial, over the mean")

    along, across = ("z/d, along the axis of rotation", "1"), ("y/d", "1")
    return draw("flow-section", paint, x=along, y=across, columns=0, height=4.6)


def _end_figure(record: Record, end: str) -> Drawing:
    """Speed in colour and streamlines where liquid enters or leaves the tube."""
    field, psi = _unpacked(record, "colour"), _unpacked(record, "stream_function")
    points = _unpacked(record, "points").reshape(2, -1)
    low, high = float(points[0].min()), float(points[0].max())
    reach = 1.5
    left, right = (max(low, -1.5), min(high, 3.5)) if end == "entrance" else (-1.5, min(high, 5.0))
    inner = {"entrance": (0.0, right), "exit": (left, 0.0)}[end]

    def paint(axes: Axes) -> None:
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
        _place(axes, right - left, 2 * reach)
        _colour_bar(axes, levels, "speed over the mean")

    height = _BOTTOM + _TOP + (NARROW - _LEFT - 0.1) * 2 * reach / (right - left)
    return draw(
        f"flow-{end}", paint, x=("x/d, along the flow", "1"), y=("r/d", "1"), columns=0, height=height
    )


def _collect(work: Work) -> Record | None:
    """Laminar flow fields at the operating point, or at the nearest one that can be drawn."""
    scene, speed = work.scene, work.calibration.operating_point.loss_velocity
    if not speed:
        return None
    loss = tube_loss(scene, speed)
    reynolds = float(loss.reynolds)
    drawn = min(reynolds, _LARGEST)
    rotation = loss.rotation_reynolds * drawn / reynolds
    laminar = bool(loss.flow_state == FlowState.LAMINAR)
    return {
        "drawn": "not laminar" if not laminar else "as it is" if drawn == reynolds else "too fast",
        "reynolds": reynolds,
        "rotation_reynolds": loss.rotation_reynolds,
        "laminar": laminar,
        "section": _section_record(section_field(reynolds=drawn, rotation_reynolds=rotation)),
        "entrance": _end_record(end_field("entrance", reynolds=drawn)),
        "exit": _end_record(end_field("exit", reynolds=drawn)),
    }


def _packed(values: npt.ArrayLike) -> str:
    """Numbers as one line of text: a field of a thousand nodes is nothing to read number by number.

    Args: `values`: any shape; written flat.
    """
    return " ".join(f"{value:.{_DIGITS}g}" for value in np.asarray(values).ravel())


def _section_record(flow: FlowField) -> Record:
    return {
        "reynolds": flow.reynolds,
        "rotation_reynolds": flow.rotation_reynolds,
        "friction_ratio": flow.friction_ratio,
        "friction_change": flow.friction_ratio - 1,
        "largest_drift": float(np.hypot(*flow.velocity[:2]).max()),
        "points": _packed(flow.points),
        "triangles": " ".join(str(node) for node in flow.triangles.ravel()),
        "colour": _packed(flow.velocity[2]),
        "stream_function": _packed(flow.stream_function),
        "velocity": _packed(flow.velocity[:2]),
    }


def _end_record(flow: FlowField) -> Record:
    return {
        "reynolds": flow.reynolds,
        "points": _packed(flow.points),
        "triangles": " ".join(str(node) for node in flow.triangles.ravel()),
        "colour": _packed(np.hypot(*flow.velocity)),
        "stream_function": _packed(flow.stream_function),
    }


def _view(found: Record, evidence: Record) -> Record:
    ends = {name: _end_figure(found[name], name) for name in ("entrance", "exit")}
    return {
        "section": _section_figure(found["section"]),
        **ends,
        "check": _three_dimensional_check(evidence),
    }


def _three_dimensional_check(evidence: Record) -> Record | None:
    """The bent tube solved in three dimensions, against the sum of the terms of k: run when, on what, how.

    Returns: Verdict, texts and the place of the case on the page; None where there is no such case.
    """
    cases = [case for case in evidence["verification"] if case["id"] == _CHECK]
    if not cases:
        return None
    case: dict[str, Any] = cases[0]
    shown_case = case_view(case)
    run = case["verdict"] != "not run"
    digest = case.get("scene_sha256") or ""
    return {
        "verdict": case["verdict"],
        "anchor": anchor(case),
        "title": shown_case["title"],
        "rows": shown_case["rows"] if run else [],
        "when": case.get("date") or (evidence["times"]["date"] if run else ""),
        "hash": digest[:12] if run else "",
        "why_not_run": shown_case["why_not_run"],
    }


SECTION: Final = Section(
    name="inside", title="Flow inside the tube", collect=_collect, apart=True, show=_view
)
