"""Is k = 50 right?  The map over bore and viscosity, and the verdict for each liquid in the scene's tube."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from ringbalance.physics.tube.loss import VELOCITIES
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reports.figure import (
    FOUND,
    INK,
    MUTED,
    PAPER,
    SURFACE,
    draw,
    logarithmic,
    note,
    upright,
)
from ringbalance.reports.pages.drag_map import DragMap, liquids_in_tube, read_by_eq_18
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import number, short
from ringbalance.scene.arrays import FloatArray

_VELOCITY_ROUNDING: Final = 1e-6
"""Relative difference of two velocities of one operating point."""
_DIGITS: Final = 5
_VELOCITIES: Final = 60
_FIFTY: Final = paper.PAPER_DRAG_COEFFICIENT
_OTHER_K: Final = (3, 5, 10, 20, 100, 200, 500, 1000, 10_000, 100_000, 1_000_000)
_MM2_PER_M2: Final = 1e6
_NAME_SHIFT_PT: Final = {1: (8, "left"), -1: (-8, "right")}
"""Shift of a liquid's name from its circle, and alignment, by side."""
_NAME_WIDTH: Final = 0.35
"""Fraction of the map's width that a liquid's name takes."""


def _collect(work: Work) -> Record:
    scene, calibration = work.ring, work.calibration
    drag = DragMap.of(calibration=calibration)
    point = drag.point
    liquids = liquids_in_tube(calibration)
    first, budgets, speed = liquids[0], calibration.quantities, float(calibration.answers.velocity)
    # Where an unprimed tube spills, the primed tube of this section has another operating point.
    same = math.isclose(first["velocity_m_s"], speed, rel_tol=_VELOCITY_ROUNDING)
    if first["starts_at_scene_pressure"] and same and scene.tube.drag_coefficient is None:
        # The uncertainties of the scene's own liquid are those of all other tables.
        names = {"velocity_uncertainty": "velocity", "k_uncertainty": "drag_coefficient"}
        liquids[0] = first | {
            key: parts.total
            for key, name in names.items()
            if name in budgets and (parts := budgets[name].parts)
        }
    # The velocity at which a separated column reads as k = 50, and the gas pressure for it.
    law, separated = calibration.flow_law, None
    if law.path.hump_pressure is not None and speed:
        ends = max(VELOCITIES[0], abs(speed) / 15), max(VELOCITIES[1], 2 * abs(speed))
        velocity = np.geomspace(*ends, _VELOCITIES)
        _, k = read_by_eq_18(law, velocity, opposite_fill_ratio=law.max_fill_ratio / 2)
        if k.min() < _FIFTY < k.max():
            u = float(np.interp(-_FIFTY, -k, velocity))
            pressure = (_FIFTY + 1) * law.density * u**2 / 2
            separated = {"velocity_of_50_m_s": u, "pressure_of_50_Pa": pressure}
    return {
        "bore_m": scene.tube.bore,
        "decreed_k": scene.tube.drag_coefficient,
        "map": {
            "bore_m": _rounded(drag.bore),
            "kinematic_viscosity_m2_s": _rounded(drag.kinematic_viscosity),
            "density_kg_m3": scene.liquid.density,
            "gas_pressure_Pa": scene.gas.pressure,
            "k": _rounded(point.k),
            "k_uncertainty": _rounded(point.k_uncertainty),
            "apparent_k": _rounded(point.apparent_k),
            "separation": _rounded(point.separation_excess),
            "runs": bool(np.all(point.runs)),
            "starts": bool(np.all(point.regime != Regime.BLOCKED)),
        },
        "liquids": [record | {"verdict": _verdict_on_fifty(record)} for record in liquids],
        "separated": separated,
    }


def _rounded(values: npt.ArrayLike) -> Any:
    """Round to five significant digits, as nested lists: a map is read off a figure."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1:
        return [_rounded(row) for row in array]
    return [float(f"{value:.{_DIGITS - 1}e}") for value in array]


def _verdict_on_fifty(record: Record) -> str:
    """Verdict on k = 50 for a liquid, by the velocity of Eq. 19 with k = 50."""
    if not record["runs"]:
        return "nothing flows"
    gap = record["velocity_paper_m_s"] - record["velocity_m_s"]
    if abs(gap) <= record["velocity_uncertainty"]:
        return "right"
    return "too low" if gap > 0 else "too high"


def _draw_map(axes: Axes, drag: Record, bore: FloatArray, nu: FloatArray) -> None:
    """Lines of equal k, k = 50 with its band, and the area of separated columns."""
    k, width, separation, read = (
        np.asarray(drag[key]).T for key in ("k", "k_uncertainty", "separation", "apparent_k")
    )
    if np.any(separation > 0):
        axes.contourf(bore, nu, separation, levels=[0.0, 100.0], colors=[MUTED], alpha=0.16)
        grey: Record = {"color": MUTED, "alpha": 0.16, "linewidth": 0}
        axes.fill_between([], [], [], label="column separated at the siphon crest", **grey)
    # Far from the line k = 50 a wide uncertainty does not put a point into the band.
    far = np.abs(np.log(np.maximum(k, 1e-9) / _FIFTY)) > 2
    near = np.where(far, 1.0, np.abs(k - _FIFTY) - width)
    axes.contourf(bore, nu, near, levels=[-1e9, 0], colors=[PAPER], alpha=0.2)
    k, read = np.maximum(k, 1e-3), np.maximum(read, 1e-3)
    levels = [level for level in _OTHER_K if k.min() < level < k.max()]
    thin = axes.contour(bore, nu, np.log(k), levels=np.log(levels), colors=[FOUND], linewidths=0.7)
    names = (short(level) if level < 10_000 else number(level, digits=1) for level in levels)
    for text in axes.clabel(thin, fmt=dict(zip(thin.levels, names, strict=True)), inline_spacing=3):
        text.set_color(FOUND)
    if k.min() < _FIFTY < k.max():
        axes.contour(bore, nu, np.log(k), levels=[math.log(_FIFTY)], colors=[PAPER], linewidths=2.2)
        axes.plot([], [], color=PAPER, linewidth=2.2, label="k = 50, with its 95 % band")
    axes.plot([], [], color=FOUND, linewidth=0.7, label="other k")
    apart = read[np.log(read / k) > 1e-3]
    if apart.min(initial=np.inf) < _FIFTY < apart.max(initial=0.0):
        dashes = (0, (4, 2))
        look: Record = {"colors": [INK], "linewidths": 1.1, "linestyles": [dashes]}
        axes.contour(bore, nu, np.log(read), levels=[math.log(_FIFTY)], **look)
        axes.plot([], [], color=INK, linewidth=1.1, linestyle=dashes, label="Eq. 19’s velocity is right")


def _view(record: Record, _evidence: Record) -> Record:
    """Map of k over bore and viscosity: lines of equal k, the band of k = 50, separated columns, liquids."""
    drag = record["map"]
    if not drag["runs"]:
        return {"map": None}
    bore = np.asarray(drag["bore_m"])
    nu = np.asarray(drag["kinematic_viscosity_m2_s"]) * _MM2_PER_M2

    def liquids(axes: Axes) -> None:
        # Circles with names, on alternate sides where the map has room.
        running = [liquid for liquid in record["liquids"] if liquid["runs"]]
        running.sort(key=lambda liquid: float(liquid["kinematic_viscosity_m2_s"]))
        across = math.log(record["bore_m"] / bore[0]) / math.log(bore[-1] / bore[0])
        for index, liquid in enumerate(running):
            point = (record["bore_m"], liquid["kinematic_viscosity_m2_s"] * _MM2_PER_M2)
            face = INK if liquid["starts_at_scene_pressure"] else SURFACE
            axes.plot(*point, "o", color=INK, markerfacecolor=face, markersize=4.5, zorder=5)
            both = _NAME_WIDTH < across < 1 - _NAME_WIDTH
            side = (-1) ** index if both else 1 if across < _NAME_WIDTH else -1
            shift, aligned = _NAME_SHIFT_PT[side]
            text = f"{typeset(liquid['name'])}, k {number(liquid['k'], digits=2)}"
            ground = {"facecolor": SURFACE, "edgecolor": "none", "pad": 0.6, "alpha": 0.8}
            note(text, point, (shift, 0), color=INK, ha=aligned, va="center", bbox=ground, zorder=4)(axes)
        axes.grid(visible=False)

    figure = draw(
        "fifty-map",
        logarithmic("x", within=(bore[0], bore[-1])),
        logarithmic("y", within=(nu[0], nu[-1])),
        lambda axes: _draw_map(axes, drag, bore, nu),
        liquids,
        upright(record["bore_m"], color=INK, linewidth=0.6, linestyle=":", zorder=2),
        x=("bore of the tube", "m"),
        y=("kinematic viscosity", "mm²/s"),
        xlim=(bore[0], bore[-1]),
        ylim=(nu[0], nu[-1]),
        wide=True,
        height=4.9,
    )
    return {"map": figure}


SECTION: Final = Section(name="fifty", title="Is k = 50 right?", collect=_collect, show=_view)
