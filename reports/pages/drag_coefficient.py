"""Is k = 50 right?  The map over bore and viscosity, and the verdict for each liquid in the scene's tube."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ringbalance.physics.tube.loss import VELOCITIES
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    INK,
    MUTED,
    PAPER,
    SURFACE,
    THIRD,
    WIDE,
    Drawing,
    curve,
    draw,
    figure_of,
    legend_above,
    level,
    logarithmic,
)
from ringbalance.reports.pages.drag_map import ApparentDrag, DragMap, LiquidVerdicts
from ringbalance.reports.pages.drag_point import DragPoint
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import number, short
from ringbalance.scene.arrays import FloatArray

_SAME_POINT: Final = 1e-6
"""Relative difference of two velocities of one operating point: rounding."""
_DIGITS: Final = 5
_READINGS: Final = 60
_FIFTY: Final = paper.PAPER_DRAG_COEFFICIENT
_LEVELS: Final = (3, 5, 10, 20, 100, 200, 500, 1000, 10_000, 100_000, 1_000_000)
"""Of k, beside the paper's, on the map."""
_MM2: Final = 1e6
"""mm^2/s in m^2/s: no unit of a scale, since its powers of ten are those of no prefix."""
_HEIGHT: Final = 4.9
_LIST: Final = 2.35
"""Inches to the right of the map for the names of the liquids."""
_APART: Final = 0.155
"""Inches between two names."""


def _collect(work: Work) -> Record:
    """The map, its contours, the liquids, and Eq. 18's reading of a separated column, as plain numbers."""
    found = DragMap.of(calibration=work.calibration)
    verdicts = LiquidVerdicts.of(calibration=work.calibration)
    return {
        "bore_m": work.scene.tube.bore,
        "decreed_k": work.scene.tube.drag_coefficient,
        "map": _map_record(found),
        "contours": {
            name: _contour(found, apparent=apparent) for name, apparent in (("k", False), ("apparent", True))
        },
        "liquids": [
            record | {"verdict": _verdict_on_fifty(record)}
            for record in _with_budget(_liquid_records(verdicts), work.calibration)
        ],
        "apparent": _apparent(work.calibration),
    }


def _rounded(values: npt.ArrayLike) -> Any:
    """Nested lists to five significant digits: a map is read off a figure."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1:
        return [_rounded(row) for row in array]
    return [float(f"{value:.{_DIGITS - 1}e}") for value in array]


def _map_record(found: DragMap) -> Record:
    point = found.point
    return {
        "bore_m": _rounded(found.bore),
        "kinematic_viscosity_m2_s": _rounded(found.kinematic_viscosity),
        "density_kg_m3": found.density,
        "gas_pressure_Pa": found.gas_pressure,
        "velocity_paper_m_s": found.velocity_paper,
        "k": _rounded(point.k),
        "k_uncertainty": _rounded(point.k_point_uncertainty),
        "apparent_k": _rounded(point.apparent_k),
        "tearing": _rounded(point.separation_excess),
        "in_range": point.in_range.astype(int).tolist(),
        "runs": bool(np.all(point.runs)),
        "starts": bool(np.all(point.regime != Regime.BLOCKED)),
    }


def _contour(found: DragMap, *, apparent: bool) -> Record:
    viscosity, bore = found.contour(apparent=apparent)
    return {"kinematic_viscosity_m2_s": _rounded(viscosity), "bore_m": _rounded(bore)}


def _liquid_records(verdicts: LiquidVerdicts) -> list[Record]:
    """The verdict on k = 50 for each liquid.

    Returns: One record a liquid: under the scene's gas where that starts the flow, else at equal heads.
    """
    errors = verdicts.velocity_errors()
    found = []
    for i, liquid in enumerate(verdicts.liquids):
        starts = bool(verdicts.at_scene.regime[i] != Regime.BLOCKED)
        point = verdicts.at_scene if starts else verdicts.at_equal_head
        own, equal = verdicts.velocity_paper_at_scene[i], verdicts.velocity_paper_at_equal_head[i]
        scene_pressure = verdicts.equal_head_pressure[0]
        found.append(
            {
                "name": liquid.name,
                "temperature_K": liquid.temperature,
                "density_kg_m3": liquid.density,
                "kinematic_viscosity_m2_s": liquid.kinematic_viscosity,
                "starts_at_scene_pressure": starts,
                "starting_pressure_Pa": float(verdicts.starting_pressure[i]),
                "gas_pressure_Pa": float(scene_pressure if starts else verdicts.equal_head_pressure[i]),
                **_point_record(point, i),
                "velocity_paper_m_s": float(own if starts else equal),
                "velocity_error": float(errors[0][i] if starts else errors[1][i]),
                "bore_for_paper_m": float(verdicts.bore_for_paper[i]) or None,
            }
        )
    return found


def _with_budget(liquids: list[Record], calibration: Calibration) -> list[Record]:
    """The scene's own liquid, the first, with the uncertainties that every other table gives its point.

    Where an unprimed tube spills at the operating point, the primed one of this section is another point.
    """
    first, *others = liquids
    budgets, speed = calibration.budgets, float(calibration.operating_point.velocity)
    same = math.isclose(first["velocity_m_s"], speed, rel_tol=_SAME_POINT)
    if first["starts_at_scene_pressure"] and same and calibration.scene.tube.drag_coefficient is None:
        names = {"velocity_uncertainty": "velocity", "k_uncertainty": "drag_coefficient"}
        first = first | {key: budgets[name].total for key, name in names.items() if name in budgets}
    return [first, *others]


def _point_record(point: DragPoint, i: int) -> Record:
    regime = Regime(int(point.regime[i]))
    return {
        "regime": regime.label,
        "runs": bool(point.runs[i]),
        "velocity_m_s": float(point.velocity[i]),
        "velocity_uncertainty": float(point.velocity_uncertainty[i]),
        "k": float(point.k[i]),
        "k_uncertainty": float(point.k_point_uncertainty[i]),
        "apparent_k": float(point.apparent_k[i]),
        "reynolds": float(point.reynolds[i]),
        "flow_state": str(point.flow_state[i]),
        "in_range": bool(point.in_range[i]),
    }


def _apparent(calibration: Calibration) -> Record | None:
    law, point = calibration.flow_law, calibration.operating_point
    if law.path.hump_pressure is None or not point.loss_velocity:
        return None
    speed = np.geomspace(
        max(VELOCITIES[0], point.loss_velocity / 15), max(VELOCITIES[1], 2 * point.loss_velocity), _READINGS
    )
    read = ApparentDrag.of(law=law, velocity=speed, opposite_fill_ratio=law.max_fill_ratio / 2)
    fifty = float(np.interp(-paper.PAPER_DRAG_COEFFICIENT, -read.separated, speed))
    return {
        "velocity_m_s": _rounded(speed),
        "velocity_of_50_m_s": fifty,
        "hides_paper": bool(min(read.separated) < paper.PAPER_DRAG_COEFFICIENT < max(read.separated)),
        "pressure_of_50_Pa": (paper.PAPER_DRAG_COEFFICIENT + 1) * law.density * fifty**2 / 2,
        "siphon": _rounded(read.siphon),
        "separated": _rounded(read.separated),
        "read": _rounded(read.read),
        "floor": _rounded(read.lower_bound),
        "excess_head_m2_s2": read.excess_head,
        "operating_velocity_m_s": point.loss_velocity,
        "operating_k": 2 * point.gas_pressure / (law.density * point.loss_velocity**2) - 1,
    }


def _verdict_on_fifty(record: Record) -> str:
    """What a liquid says of k = 50, judged by the velocity that Eq. 19 gives with it."""
    if not record["runs"]:
        return "nothing flows"
    gap = record["velocity_paper_m_s"] - record["velocity_m_s"]
    if abs(gap) <= record["velocity_uncertainty"]:
        return "right"
    return "too low" if gap > 0 else "too high"


def _view(found: Record, _evidence: Record) -> Record:
    return {
        "map": _map_figure(found) if found["map"]["runs"] else None,
        "apparent": _apparent_figure(found["apparent"]) if found["apparent"] else None,
    }


def _map_figure(found: Record) -> Drawing:
    """k over bore and viscosity: lines of equal k, k = 50 with its band, the separated column, liquids."""
    drag = found["map"]
    bore = np.asarray(drag["bore_m"])
    nu = np.asarray(drag["kinematic_viscosity_m2_s"]) * _MM2

    def paint(axes: Axes) -> None:
        _shade(axes, drag, bore, nu)
        _lines(axes, drag, bore, nu)
        _mark_liquids(axes, found)
        axes.set(xlim=(bore[0], bore[-1]), ylim=(nu[0], nu[-1]))
        axes.grid(visible=False)
        legend_above(axes, columns=2)
        box = axes.get_position()
        axes.set_position((box.x0, box.y0, 1 - box.x0 - _LIST / WIDE, box.height))
        _name_liquids(axes, found)

    return draw(
        "fifty-map",
        logarithmic("x", within=(bore[0], bore[-1])),
        logarithmic("y", within=(nu[0], nu[-1])),
        paint,
        x=("bore of the tube", "m"),
        y=("kinematic viscosity", "mm²/s"),
        columns=0,
        wide=True,
        height=_HEIGHT,
    )


def _shade(axes: Axes, told: Record, bore: FloatArray, nu: FloatArray) -> None:
    tearing = np.asarray(told["tearing"]).T
    if np.any(tearing > 0):
        axes.contourf(bore, nu, tearing, levels=[0.0, 100.0], colors=[MUTED], alpha=0.16)
        axes.fill_between(
            [],
            [],
            [],
            color=MUTED,
            alpha=0.16,
            linewidth=0,
            label="column separated at the siphon crest",
        )
    k, width = (np.asarray(told[key]).T for key in ("k", "k_uncertainty"))
    near = np.where(
        np.abs(np.log(np.maximum(k, 1e-9) / _FIFTY)) < 2,
        np.abs(k - _FIFTY) - width,
        1.0,
    )
    axes.contourf(bore, nu, near, levels=[-1e9, 0], colors=[PAPER], alpha=0.2)


def _lines(axes: Axes, told: Record, bore: FloatArray, nu: FloatArray) -> None:
    k, read = (np.log10(np.maximum(np.asarray(told[key]).T, 1e-3)) for key in ("k", "apparent_k"))
    levels = [level for level in _LEVELS if k.min() < np.log10(level) < k.max()]
    thin = axes.contour(bore, nu, k, levels=np.log10(levels), colors=[FOUND], linewidths=0.7)
    shown = (short(level) if level < 10_000 else number(level, digits=1) for level in levels)
    names = dict(zip(thin.levels, shown, strict=True))
    texts = axes.clabel(thin, fmt=names, inline=True, inline_spacing=3)
    for text in texts:
        text.set_color(FOUND)
    if k.min() < np.log10(_FIFTY) < k.max():
        axes.contour(bore, nu, k, levels=[np.log10(_FIFTY)], colors=[PAPER], linewidths=2.2)
        axes.plot([], [], color=PAPER, linewidth=2.2, label="k = 50, with its 95 % band")
    axes.plot([], [], color=FOUND, linewidth=0.7, label="other k")
    apart = np.where(read - k > 1e-3, read, np.nan)
    if np.nanmin(apart, initial=9) < np.log10(_FIFTY) < np.nanmax(apart, initial=-9):
        axes.contour(
            bore,
            nu,
            read,
            levels=[np.log10(_FIFTY)],
            colors=[INK],
            linewidths=1.1,
            linestyles=[(0, (4, 2))],
        )
        axes.plot([], [], color=INK, linewidth=1.1, linestyle=(0, (4, 2)), label="Eq. 19’s velocity is right")


def _mark_liquids(axes: Axes, found: Record) -> None:
    for record in found["liquids"]:
        if record["runs"]:
            axes.plot(
                [found["bore_m"]],
                [record["kinematic_viscosity_m2_s"] * _MM2],
                "o",
                color=INK,
                markerfacecolor=INK if record["starts_at_scene_pressure"] else SURFACE,
                markersize=4.5,
                zorder=5,
            )
    axes.axvline(found["bore_m"], color=INK, linewidth=0.6, linestyle=":", zorder=2)


def _name_liquids(axes: Axes, found: Record) -> None:
    """Names at the right edge, level with their circles but never on top of each other."""
    figure = figure_of(axes)
    shown_liquids = sorted(
        (r for r in found["liquids"] if r["runs"]), key=lambda r: float(r["kinematic_viscosity_m2_s"])
    )
    box, (low, high) = axes.get_position(), np.log(axes.get_ylim())
    share = [(np.log(r["kinematic_viscosity_m2_s"] * _MM2) - low) / (high - low) for r in shown_liquids]
    wanted = [box.y0 + s * box.height for s in share]
    for record, at, place in zip(shown_liquids, wanted, _spread(wanted, _APART / _HEIGHT), strict=True):
        edge = box.x1
        leader = Line2D(
            [edge, edge + 0.012, edge + 0.022],
            [at, at, place],
            color=MUTED,
            linewidth=0.7,
            transform=figure.transFigure,
        )
        figure.add_artist(leader)
        text = f"{typeset(record['name'])}, k {number(record['k'], digits=2)}"
        figure.text(edge + 0.026, place, text, va="center", ha="left", color=INK)


def _spread(wanted: list[float], apart: float) -> list[float]:
    """Places at least so far apart, near the wanted ones, in their order: blocks that touch move as one."""
    blocks: list[tuple[float, int]] = []
    for place in wanted:
        blocks.append((place, 1))
        while len(blocks) > 1:
            (a, m), (b, n) = blocks[-2:]
            if b - a >= apart * (m + n) / 2:
                break
            blocks[-2:] = [((a * m + b * n) / (m + n), m + n)]
    return [middle + (i - (count - 1) / 2) * apart for middle, count in blocks for i in range(count)]


def _apparent_figure(read: Record) -> Drawing:
    """The k that Eq. 18 reads off the tube, over the velocity: its 1/u^2 line, k(u) and k = 50.

    Args: `read`: `apparent` of the evidence's `fifty`.
    """
    speed, siphon, separated, every, floor = (
        np.asarray(read[key]) for key in ("velocity_m_s", "siphon", "separated", "read", "floor")
    )
    crest, excess = {"color": THIRD}, read["excess_head_m2_s2"]
    part: dict[str, Any] = {**crest, "linewidth": 0.9, "linestyle": ":"}
    machine: dict[str, Any] = {"color": INK, "linestyle": "", "marker": "o", "markersize": 5}
    bottom = max(0.5 * min(siphon.min(), floor.min(), 2.0), 0.3)
    top = 2 * max(float(every.max()), _FIFTY)
    return draw(
        "fifty-apparent",
        level(_FIFTY, "the paper’s 50", **AS_PAPER),
        curve(speed, every, "what Eq. 18 reads", color=INK, linewidth=3.2, alpha=0.25),
        curve(speed, siphon, "k(u) of the full tube", color=FOUND),
        curve(speed, np.where(separated > 0, separated, np.nan), "separated at the siphon crest", **crest),
        *([curve(speed, 2 * excess / speed**2, "its part ∝ 1/u²", **part)] if excess > 0 else []),
        curve([read["operating_velocity_m_s"]], [read["operating_k"]], "this machine", **machine),
        logarithmic("x", within=(speed[0], speed[-1])),
        logarithmic("y", within=(bottom, top)),
        x=("mean velocity in the tube", "m/s"),
        y=("k as Eq. 18 has it", "1"),
        xlim=(speed[0], speed[-1]),
        ylim=(bottom, top),
        columns=3,
        wide=True,
        height=3.7,
    )


SECTION: Final = Section(name="fifty", title="Is k = 50 right?", collect=_collect, apart=True, show=_view)
