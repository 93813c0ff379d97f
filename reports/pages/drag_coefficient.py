"""Is k = 50 right?  The map over bore and viscosity, and the verdict for each liquid in the scene's tube."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import VELOCITIES
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reports.figures.drag_coefficient import drag_figures
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.studies.drag_map import ApparentDrag, DragMap, LiquidVerdicts
from ringbalance.reports.studies.drag_point import DragPoint

_SAME_POINT: Final = 1e-6
"""Relative difference of two velocities of one operating point: rounding."""
_DIGITS: Final = 5
_READINGS: Final = 60


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
            record | {"verdict": verdict_on_fifty(record)}
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


def verdict_on_fifty(record: Record) -> str:
    """What a liquid says of k = 50, judged by the velocity that Eq. 19 gives with it."""
    if not record["runs"]:
        return "nothing flows"
    gap = record["velocity_paper_m_s"] - record["velocity_m_s"]
    if abs(gap) <= record["velocity_uncertainty"]:
        return "right"
    return "too low" if gap > 0 else "too high"


def _view(found: Record, _evidence: Record) -> Record:
    return {**drag_figures(found)}


SECTION: Final = Section(name="fifty", title="Is k = 50 right?", collect=_collect, apart=True, show=_view)
