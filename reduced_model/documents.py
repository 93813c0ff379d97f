"""A calibration as the JSON document of `ringbalance calibrate --json`, and a law as tables."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.chamber.contributions import compression
from ringbalance.reduced_model.chamber.element_check import CHECKED, ElementCheck
from ringbalance.reduced_model.chamber.tilted_ring import closed_ring
from ringbalance.reduced_model.chamber.values import paper_closed_forms, share_across
from ringbalance.reduced_model.gas_line import line_document
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.rules.working import LARGEST_COMPRESSION

PRESSURE_FACTORS: Final = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
"""Gas pressures of the law's table over the scene's gas pressure."""


def calibration_document(calibration: Calibration) -> dict[str, Any]:
    """Convert a calibration to plain lists, numbers and texts.

    `quantities` has the main numbers with their uncertainty budgets; the rest are curves over fill, velocity
    and pressure, and texts. `*_uncertainty` are expanded uncertainties (95 %). Those of wall pressure and
    moment are for the scene's nominal inputs (rounding, quadrature, contradictions by finite elements,
    neglected gravity and terms without a model); the contribution of uncertain inputs is
    `*_input_uncertainty`, and the two combine as the root of the sum of squares. Those of k and of velocities
    include all contributions. The law has rows along `gas_pressure_Pa` and columns along `fill_ratio`, for a
    tube that is empty beforehand.
    Returns: The document, in SI units and gauge pressures; no value is NaN or infinite.
    Source: combination after ASME V&V 20-2009.
    """
    scene, tube, instability = calibration.scene, calibration.tube, calibration.instability
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "chamber": _chamber(calibration),
        "check": _check(calibration.chamber.check),
        "tube": {
            "velocity_m_s": _listed(tube.velocity),
            "reynolds": _listed(tube.reynolds),
            "rotation_reynolds": tube.rotation_reynolds,
            "k": _listed(tube.k.value),
            "k_uncertainty": _listed(tube.k.uncertainty),
            "flow_state": _listed(tube.flow_state),
            "in_range": _listed(tube.in_range),
            "range_notes": list(tube.range_notes),
            "terms": {name: _listed(term) for name, term in tube.terms.items()},
            "uncertainty_parts": {name: _listed(part) for name, part in tube.uncertainty_parts.items()},
        },
        "law": _law(calibration),
        "regime": calibration.regime.label,
        "asynchronous_instability": None
        if instability is None
        else {
            "fill_ratio": instability.fill_ratio,
            "critical_speed_rad_s": instability.critical_speed,
            "growth_over_critical_speed": instability.growth,
        },
        "tolerance": scene.tolerance,
        "holding": {
            "holds": calibration.holding.holds,
            "largest_hump_radius_m": calibration.holding.largest_hump_radius,
        },
        "gas_line": line_document(calibration.gas_line),
        "models_used": [asdict(term) for term in calibration.models_used],
        "status": {"code": str(calibration.chamber.status.code), "text": calibration.chamber.status.text},
        "statistics": dict(calibration.statistics),
        **calibration.rows().document(),
    }


def _listed(values: npt.ArrayLike) -> Any:
    return np.asarray(values).tolist()


def _chamber(calibration: Calibration) -> dict[str, Any]:
    scene, chamber, at = calibration.scene, calibration.chamber, list(calibration.chamber.reported)
    fills = chamber.reported_fill_ratio
    document = {
        "fill_ratio": _listed(fills),
        "free_surface_radius_m": _listed(chamber.ring.surface_radius[at]),
        "row_status": [str(status) for status in chamber_status(calibration)],
    }
    for curve, name, unit in (
        (chamber.wall_pressure, "wall_pressure", "Pa"),
        (chamber.hydrostatic_pressure, "hydrostatic_pressure", "Pa"),
        (chamber.moment, "moment", "kg_m"),
    ):
        document |= {
            f"{name}_{unit}": _listed(curve.value[at]),
            f"{name}_status": str(curve.status.code),
            f"{name}_uncertainty": _listed(curve.uncertainty[at]),
            f"{name}_input_uncertainty": _listed(curve.inputs[at]),
            f"{name}_uncertainty_parts": {
                "numerical": _listed(curve.numerical[at]),
                "unmodelled_terms": _listed(curve.unmodelled[at]),
            },
        }
    pressure, moment = paper_closed_forms(scene, fills)
    return document | {
        "wall_pressure_paper_Pa": _listed(pressure),
        "moment_paper_kg_m": _listed(moment),
        "moment_angle_rad": _listed(np.arctan(share_across(scene.disc, fills))),
        "lambda_per_transferred_mass_m": _listed(calibration.lambda_over_fill(fill_ratio=fills)),
    }


def _check(check: ElementCheck) -> dict[str, Any]:
    """Finite elements at a few fills; differences are closed form less finite elements."""
    document: dict[str, Any] = {
        "by": "finite elements",
        "gravity": check.gravity,
        "fill_ratio": _listed(check.elements.fill_ratio),
        "cells": [list(cells) for cells in check.elements.cells],
        "finite_element_solves": check.solves,
        "agrees": check.status.ok,
        "excess": check.excess,
        "excess_by_quantity": dict(check.excesses),
    }
    for name, unit in zip(CHECKED, ("Pa", "kg_m", "kg_m2", "Pa"), strict=True):
        if name not in check.difference:
            continue
        estimate = getattr(check.elements, name)
        document[f"{name}_{unit}"] = _listed(estimate.value)
        document[f"{name}_uncertainty"] = _listed(estimate.uncertainty)
        document[f"{name}_difference"] = _listed(check.difference[name])
    return document


def _law(calibration: Calibration) -> dict[str, Any]:
    fills = calibration.chamber.reported_fill_ratio
    pressures = np.array(PRESSURE_FACTORS) * applied_pressure(calibration.scene.gas)
    flow = calibration.flow_law.evaluate(fill_ratio=fills[None, :], gas_pressure=pressures[:, None])
    by_paper = calibration.paper_law.evaluate(fill_ratio=fills[None, :], gas_pressure=pressures[:, None])
    return {
        "gas_pressure_Pa": _listed(pressures),
        "fill_ratio": _listed(fills),
        "velocity_m_s": _listed(flow.velocity),
        "velocity_uncertainty": _listed(flow.uncertainty),
        "column_status": [str(status) for status in velocity_status(calibration, fills)],
        "regime": [[Regime(int(r)).label for r in row] for row in flow.regime],
        "velocity_paper_m_s": _listed(by_paper.velocity),
    }


def chamber_status(calibration: Calibration) -> tuple[RowStatus, ...]:
    """Status of a chamber's results at the reported fill ratios."""
    scene, chamber = calibration.scene, calibration.chamber
    fills, computed = chamber.reported_fill_ratio, chamber.ring.closed[list(chamber.reported)]
    closed = computed & closed_ring(scene, fills)
    return _row_status(scene, fill_ratio=fills, closed=closed)


def velocity_status(calibration: Calibration, fill_ratio: FloatArray) -> tuple[RowStatus, ...]:
    """Status of the velocity out of a chamber at fill ratios, under the scene's gas pressure."""
    scene = calibration.scene
    return _row_status(
        scene,
        fill_ratio=fill_ratio,
        closed=closed_ring(scene, fill_ratio),
        fullest=np.maximum(fill_ratio, scene.disc.max_fill_ratio - fill_ratio),
        residual=float(calibration.answers.residual_fill_ratio),
    )


class RowStatus(StrEnum):
    """First limit that applies to a row at its fill ratio; each value is the code of a finding."""

    OK = "ok"
    NO_RING = "no_ring"
    PORT_UNCOVERED = "port_uncovered"
    OVER_CREST = "over_crest"
    GAS_DRAWN = "gas_drawn"
    LIQUID_COMPRESSED = "liquid_compressed"


def _row_status(
    scene: Scene,
    *,
    fill_ratio: FloatArray,
    closed: BoolArray,
    fullest: FloatArray | None = None,
    residual: float = 0.0,
) -> tuple[RowStatus, ...]:
    """Status of each fill ratio x; an empty chamber is limited by its residual liquid alone.

    NO_RING: not `closed` under gravity. PORT_UNCOVERED: a >= r_p. OVER_CREST: a <= r_m. GAS_DRAWN: x below
    `residual`, for what flows out of the chamber. LIQUID_COMPRESSED: at `fullest`, the fuller chamber of a
    pair, or at x. With the radii a of the concentric surface, r_p of the port and r_m of the crest, or r_p
    without one.
    """
    level, crest = surface_radius(disc=scene.disc, fill_ratio=fill_ratio), scene.tube.hump_radius
    inside = level <= (scene.tube.port_radius if crest is None else crest)
    limits = (
        (~closed & (fill_ratio > 0), RowStatus.NO_RING),
        ((level >= scene.tube.port_radius) & (fill_ratio > 0), RowStatus.PORT_UNCOVERED),
        (inside & (fill_ratio > 0), RowStatus.OVER_CREST),
        (fill_ratio < residual, RowStatus.GAS_DRAWN),
        (
            compression(scene, fill_ratio if fullest is None else fullest) > LARGEST_COMPRESSION,
            RowStatus.LIQUID_COMPRESSED,
        ),
    )
    return tuple(
        next((status for where, status in limits if where[row]), RowStatus.OK)
        for row in range(fill_ratio.size)
    )
