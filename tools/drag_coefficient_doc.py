"""The tables of docs/is-k-50-right.md as Markdown, from the map of k, for `doc_tables`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from benchmark_tables import markdown

from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reports.pages.drag_coefficient import SECTION
from ringbalance.reports.pages.drag_map import DragMap, read_by_eq_18
from ringbalance.reports.section import Record, Work
from ringbalance.results.numbers import MISSING, format_given, measured, number, percent, shown
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.runner import paper_scene, run_case

_VISCOSITIES: Final = (0.7e-6, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4)
_BORES: Final = np.geomspace(0.2e-3, 5e-3, 61)


def document_tables() -> dict[str, str]:
    """The generated parts of the page, for the liquid-ring paper's disc with its assumed tube."""
    scene = paper_scene()
    calibration = calibrate(scene)
    section = SECTION.collect(Work(scene=scene, level="light"))
    assert section is not None
    return {
        "liquids": markdown(_LIQUID_HEADS, [tuple(_liquid_cells(each)) for each in section["liquids"]]),
        "bores": _bores_table(calibration),
        "rule": rule(calibration),
        "library": _library_table(),
        "hidden": _hidden_table(section["separated"]["velocity_of_50_m_s"], calibration),
    }


_LIQUID_HEADS: Final = (
    *("liquid", "viscosity", "kg/m³", "gas", "tube runs", "velocity", "k"),
    *("Eq. 18 reads", "Eq. 19 is off by", "50 is"),
)


def _liquid_cells(record: Record) -> Sequence[str]:
    """Cells of one liquid under `_LIQUID_HEADS`; a star: not with the scene's gas."""
    runs = record["runs"]
    star = "" if record["starts_at_scene_pressure"] else "*"
    return (
        record["name"],
        shown(record["kinematic_viscosity_m2_s"], "m^2/s", digits=3),
        f"{record['density_kg_m3']:.0f}",
        f"{format_given(record['gas_pressure_Pa'], 'Pa', digits=3)}{star}",
        f"{record['regime']}, {record['flow_state']}" if runs else "nothing flows",
        shown(record["velocity_m_s"], "m/s", record["velocity_uncertainty"]) if runs else MISSING,
        measured(record["k"], record["k_uncertainty"]) if runs else MISSING,
        measured(record["apparent_k"], None, digits=3) if runs else MISSING,
        percent(record["velocity_error"], signed=True, digits=2) if runs else MISSING,
        record["verdict"],
    )


def _bores_table(calibration: Calibration) -> str:
    """Bore at which k is the paper's, with its uncertainty range, over the viscosity."""
    drag = DragMap.of(calibration=calibration, bore=_BORES, kinematic_viscosity=list(_VISCOSITIES))
    k, width = drag.point.k, drag.point.k_uncertainty
    columns = [drag.bores_for(k + side * width) for side in (0.0, -1.0, 1.0)]
    rows = []
    for i, viscosity in enumerate(_VISCOSITIES):
        middle, low, high = (column[i] for column in columns)
        rows.append((shown(viscosity, "m^2/s", digits=2), _bore(middle), f"{_bore(low)} to {_bore(high)}"))
    return markdown(("viscosity", "k = 50 at a bore of", "within its uncertainty from"), rows)


def rule(calibration: Calibration) -> str:
    """Velocity and Reynolds number of k = 50 in laminar flow, as one number for this tube."""
    laminar = [nu for nu in _VISCOSITIES if 5e-6 <= nu <= 1e-4]
    drag = DragMap.of(calibration=calibration, bore=_BORES, kinematic_viscosity=laminar)
    bores = drag.bores_for(drag.point.k)
    ratio = np.array([nu / d**2 for nu, d in zip(laminar, bores, strict=True) if d is not None])
    low, high = (number(float(value), digits=2) for value in (ratio.min(), ratio.max()))
    speed = number(float(_velocity_at_fifty(calibration)), digits=2)
    return (
        f"From 5 to 100 mm²/s the line k = 50 follows ν/d² = {low} to {high} mm²/s per mm² of bore squared, "
        f"for this length of 120 mm and the {speed} m/s that 0.7 MPa gives water’s density at k = 50."
    )


def _library_table() -> str:
    """k by the library `fluids` alone and by the program, over the velocity."""
    evidence = run_case("k_by_fluids", scene=paper_scene()).evidence
    assert evidence is not None
    heads = ("velocity", "Re", "`fluids`, at rest", "program, at rest", "program, turning", "by")
    rows = [
        (
            shown(velocity, "m/s", digits=2),
            f"{reynolds:,.0f}",
            f"{number(low, digits=3)} to {number(high, digits=3)}",
            number(rest, digits=3),
            measured(turning, width),
            by,
        )
        for velocity, reynolds, low, high, rest, turning, width, by in zip(
            *evidence.tables[0].columns.values(), strict=True
        )
    ]
    return markdown(heads, rows)


def _velocity_at_fifty(calibration: Calibration) -> FloatArray:
    return paper.velocity_from_pressures(
        density=calibration.scene.liquid.density,
        drag_coefficient=paper.PAPER_DRAG_COEFFICIENT,
        pressure_difference=calibration.scene.gas.pressure,
    )


def _bore(value: float | None) -> str:
    return "beyond the map" if value is None else shown(value, "m", digits=3)


def _hidden_table(velocity_of_50: float, calibration: Calibration) -> str:
    """Apparent k by Eq. 18 of a column separated at the crest, over the velocity."""
    law = calibration.flow_law
    density, opposite = law.density, law.max_fill_ratio / 2
    rows = []
    for wanted in (2.0, velocity_of_50, 5.0, 10.0):
        k_siphon, read = (float(k) for k in read_by_eq_18(law, wanted, opposite_fill_ratio=opposite))
        pressure = (read + 1) * density * wanted**2 / 2
        error = np.sqrt((read + 1) / (paper.PAPER_DRAG_COEFFICIENT + 1)) - 1
        rows.append(
            (
                shown(wanted, "m/s", digits=2),
                shown(pressure, "Pa", digits=2),
                number(k_siphon, digits=2),
                number(read, digits=2),
                percent(float(error), signed=True, digits=2),
            )
        )
    return markdown(("velocity", "gas", "k of the tube", "Eq. 18 reads", "Eq. 19 is off by"), rows)
