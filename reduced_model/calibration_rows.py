"""Presentation of a calibration: quantities with intervals, findings, and tables."""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.faceting import SMOOTH, axis_beside_shaft, drawing_shares, faceting, inward_share
from ringbalance.physics.gas import applied_pressure, chamber_pressures, leaks
from ringbalance.reduced_model.calibration_record import MAIN, Calibration
from ringbalance.reduced_model.chamber.values import paper_closed_forms
from ringbalance.reduced_model.documents import PRESSURE_FACTORS, RowStatus, chamber_status, velocity_status
from ringbalance.reduced_model.gas_line import line_text
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.regime import cavity_pressure
from ringbalance.results.numbers import believed, format_given, rounded
from ringbalance.results.result import Rows, Table, models_table
from ringbalance.results.rows import Finding, sentences
from ringbalance.scene.models import Scene

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
