"""A calibration as the JSON document and the printed rows of `ringbalance calibrate`, and a law as tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.faceting import SMOOTH, axis_beside_shaft, drawing_shares, faceting, inward_share
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas import applied_pressure, chamber_pressures, leaks
from ringbalance.reduced_model.calibration_record import MAIN, Calibration
from ringbalance.reduced_model.chamber.contributions import compression
from ringbalance.reduced_model.chamber.element_check import CHECKED, ElementCheck
from ringbalance.reduced_model.chamber.tilted_ring import closed_ring
from ringbalance.reduced_model.chamber.values import paper_closed_forms, share_across
from ringbalance.reduced_model.gas_line import line_document, line_text
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.regime import cavity_pressure
from ringbalance.results.numbers import believed, format_given, rounded
from ringbalance.results.result import Rows, Table, models_table
from ringbalance.results.rows import Finding, sentences
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


_SYMMETRIC_DEG: Final = 0.01
"""Largest angle of the moment in a chamber that counts as symmetric."""
_INWARD_SHARE: Final = 1e-3
"""Fraction of the outer wall's area that may face inward without a warning."""
_MARKS: Final = MappingProxyType(
    {Regime.SIPHON: "", Regime.SEPARATED: "*", Regime.REVERSE: "r", Regime.UNDECIDED: "?"}
)


def calibration_rows(calibration: Calibration) -> Rows:
    """Quantities with their expanded uncertainties (95 %), findings, and tables over fill and velocity."""
    scene = calibration.scene
    pressure, half = applied_pressure(scene.gas), scene.disc.max_fill_ratio / 2
    where = f"{format_given(pressure, 'Pa')}, equal fills of {half:g}: {calibration.regime.label}"
    return Rows(
        title=f"Calibration of {scene.name} ({scene.source})",
        quantities=tuple(calibration.quantities.values()),
        main=MAIN,
        findings=tuple(_findings(calibration)),
        facts=(("operating point", where), ("gas line", line_text(calibration.gas_line))),
        tables=(
            _chamber_table(calibration),
            _tube_table(calibration),
            _law_table(calibration),
            models_table(calibration.models_used, tolerance=scene.tolerance),
        ),
    )


def _printable_uncertainty(calibration: Calibration, value: float, total: float | None) -> float | None:
    """Uncertainty to print; None below rounding, that of inputs if the scene states no uncertainty."""
    return believed(value, total, stated=bool(calibration.scene.uncertainty))


def _findings(calibration: Calibration) -> Iterator[Finding]:
    scene, status = calibration.scene, calibration.chamber.status
    if not status.ok:
        yield Finding(code="out_of_range", values={"text": status.text})
    yield from _mesh_findings(scene)
    yield from _flow_findings(calibration)
    if calibration.holding.finding is not None:
        yield calibration.holding.finding
    if calibration.instability is not None and calibration.instability.finding is not None:
        yield calibration.instability.finding
    if scene.disc.gas_hole_direction in ("axial", "inward"):
        yield Finding(code="gas_jet_bound", values={"direction": scene.disc.gas_hole_direction})
    blown = calibration.quantities.get("blowing_number")
    if blown is not None and (blown.value or 0.0) > 1.0:
        yield Finding(code="gas_jet_droplets", values={"number": blown.value})
    yield from _direction(calibration)
    if not scene.uncertainty:
        yield Finding(code="uncertainty_unstated")
    yield Finding(code="identifiability")


def _mesh_findings(scene: Scene) -> Iterator[Finding]:
    """Warnings of likely mistakes in an imported mesh; results are those of the mesh as it is."""
    geometry = scene.disc.geometry
    if geometry is None:
        return
    if (axis := axis_beside_shaft(geometry)) is not None:
        yield Finding(code="off_axis", values={"distance_m": float(np.hypot(*axis))})
    if (inward := inward_share(geometry)) > _INWARD_SHARE:
        yield Finding(code="outer_wall_faces_inward", values={"area_share": inward})
    bend, volume = faceting(geometry).steepest, drawing_shares(scene.disc, np.empty(0)).volume
    if bend > SMOOTH or volume > scene.tolerance:
        yield Finding(code="coarse_curves", values={"angle_rad": bend, "volume_share": volume})


def _flow_findings(calibration: Calibration) -> Iterator[Finding]:
    scene, quantities, answers = calibration.scene, calibration.quantities, calibration.answers
    if calibration.regime is Regime.BLOCKED:
        limits = [quantities.get(name) for name in ("priming_pressure_vented", "stall_pressure")]
        needed = max(each.upper or each.value or 0.0 for each in limits if each is not None)
        yield Finding(
            code="blocked", values={"gas_pressure": applied_pressure(scene.gas), "pressure": needed}
        )
    if leaks(scene.gas):
        gas, vented = scene.gas, chamber_pressures(scene.gas)[1] - scene.gas.ambient_pressure
        values = {"applied": applied_pressure(gas), "pressure": gas.pressure, "vented": vented}
        yield Finding(code="leak_lowers", values=values)
    elif scene.gas.leak_to_ambient or scene.gas.leak_from_supply:
        yield Finding(code="leak_costs_air")
    if answers.least_fill_ratio > 0:
        code = "draw_down" if answers.residual_fill_ratio >= answers.stalled_fill_ratio else "gas_stalls"
        values = {"fill_ratio": quantities["least_fill_ratio"], "depth": quantities["residual_depth"]}
        yield Finding(code=code, values=values)
    if "cavitation_margin" in quantities:
        margin, parts = float(answers.cavitation_margin), quantities["cavitation_margin"].parts
        law, half = calibration.flow_law, calibration.flow_law.max_fill_ratio / 2
        ends = law.ends(fill_ratio=half, opposite_fill_ratio=half, gas_pressure=applied_pressure(scene.gas))
        held = "crest_column_holds" if margin > 0 else "crest_column_separates"
        yield Finding(
            code="crest_column_undecided" if parts is not None and abs(margin) < parts.total else held,
            values={"margin": abs(margin), "cavity_pressure": float(cavity_pressure(law.path, ends))},
        )


def _direction(calibration: Calibration) -> Iterator[Finding]:
    """Angle between a pair's moment and the middle of its chamber, for an asymmetric imported chamber."""
    total, moment = calibration.scene.disc.max_fill_ratio, calibration.flow_law.moment
    fill = total * np.linspace(0.525, 1.0, 20)
    angles = np.angle(moment.pair_vector(fill_ratio=fill, opposite_fill_ratio=total - fill))
    if np.degrees(np.max(np.abs(angles))) >= _SYMMETRIC_DEG:
        numbers = {"angle_equal": float(angles[0]), "angle_full": float(angles[-1])}
        yield Finding(code="moment_aside", values=numbers)


def _legend(states: tuple[RowStatus, ...]) -> str:
    """Legend of the states that limit some rows."""
    return "; ".join(f"{s}: {sentences()[s].text}" for s in RowStatus if s in states and s != RowStatus.OK)


def _chamber_table(calibration: Calibration) -> Table:
    chamber, at = calibration.chamber, list(calibration.chamber.reported)
    states, by_paper = (
        chamber_status(calibration),
        paper_closed_forms(calibration.scene, chamber.fill_ratio[at]),
    )
    legend = _legend(states)
    pressure, moment = (
        np.maximum(np.hypot(curve.uncertainty, curve.inputs), 1e-9 * np.max(curve.value))
        for curve in (chamber.wall_pressure, chamber.moment)
    )

    def cell(value: float, total: float, factor: float) -> str:
        uncertainty = _printable_uncertainty(calibration, value, total)
        return rounded(factor * value, None if uncertainty is None else factor * uncertainty)

    rows = []
    for row, i in enumerate(at):
        p, u = float(chamber.wall_pressure.value[i]), float(chamber.moment.value[i])
        p_paper, u_paper = (float(column[row]) for column in by_paper)
        rows.append(
            (
                f"{chamber.fill_ratio[i]:g}",
                f"{1e3 * chamber.ring.surface_radius[i]:.2f}",
                cell(p, pressure[i], 1e-6),
                cell(p_paper, pressure[i], 1e-6),
                _off(p_paper, p),
                cell(u, moment[i], 1e6),
                cell(u_paper, moment[i], 1e6),
                _off(u_paper, u),
                *([str(states[row])] if legend else []),
            )
        )
    heads = ("fill", "R1' mm", "p MPa", "Eq. 12", "off %", "U g mm", "Eq. 7", "off %")
    return Table(caption="Chamber", heads=(*heads, *(["state"] if legend else [])), rows=rows, note=legend)


def _off(value: float, reference: float) -> str:
    """Deviation from a reference in percent, as text; zero without sign."""
    shown = f"{100 * (value / reference - 1):+.1f}" if reference else ""
    return "0.0" if shown in ("+0.0", "-0.0") else shown


def _tube_table(calibration: Calibration) -> Table:
    tube = calibration.tube
    terms = {name: term for name, term in tube.terms.items() if np.any(term)}
    rows = [
        (
            f"{tube.velocity[i]:.3g}",
            f"{tube.reynolds[i]:.0f}",
            *(rounded(float(v[i]), float(tube.k.uncertainty[i])) for v in (tube.k.value, tube.k.uncertainty)),
            f"{tube.flow_state[i]}{'' if tube.in_range[i] else '*'}",
            *(f"{term[i]:.3g}" for term in terms.values()),
        )
        for i in dict.fromkeys(np.linspace(0, tube.velocity.size - 1, 9).astype(int).tolist())
    ]
    note = "* outside the range of a source: " + "; ".join(tube.range_notes) if tube.range_notes else ""
    return Table(caption="Tube", heads=("u m/s", "Re", "k", "±", "state", *terms), rows=rows, note=note)


def _law_table(calibration: Calibration) -> Table:
    x = np.linspace(0, calibration.flow_law.max_fill_ratio, 5)
    states, rows = velocity_status(calibration, x), []
    for pressure in np.multiply(PRESSURE_FACTORS, applied_pressure(calibration.scene.gas)):
        flow = calibration.flow_law.evaluate(fill_ratio=x, gas_pressure=pressure)
        by_paper = calibration.paper_law.evaluate(fill_ratio=x, gas_pressure=pressure).velocity
        cells = []
        for r, velocity, total, eq_19 in zip(
            flow.regime, flow.velocity, flow.uncertainty, by_paper, strict=True
        ):
            regime = Regime(int(r))
            text = rounded(velocity, _printable_uncertainty(calibration, velocity, total))
            shown = "-" if regime is Regime.BLOCKED else f"{text}{_MARKS[regime]}"
            cells.append(f"{shown} ({eq_19:.1f})")
        rows.append((f"{pressure / 1e6:.3g}", *cells))
    note = (
        "* separated at the siphon crest, ? siphon or separated is undecided, r reverse, - blocked; "
        "x is the driven chamber's fill ratio"
    )
    if legend := _legend(states):
        rows.append(("state", *(str(state) for state in states)))
    heads = ("MPa", *(f"x = {v:.3g}" for v in x))
    caption = "Velocity from an empty tube, m/s (Eq. 19)"
    return Table(caption=caption, heads=heads, rows=rows, note="; ".join(filter(None, (note, legend))))
