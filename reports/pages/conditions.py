"""The numbers to use, with what makes each uncertain, and the inputs on which they rest."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.reduced_model.budget import UNSTATED
from ringbalance.reports.figures.operation import tornado
from ringbalance.reports.prose import named_with_origin, read, states_uncertainty, traced
from ringbalance.reports.section import Cells, Record, Section, Table
from ringbalance.results.numbers import MISSING, believed, display_unit, fixed, given, number, shown
from ringbalance.verification.standing import budget_standing

_NAMES: Final = {
    "lambda": "Lever arm λ, moment per transferred mass",
    "drag_coefficient": "Loss coefficient k of the tube",
    "velocity": "Velocity in the tube at equal fills",
    "wall_pressure": "Wall pressure at the largest fill",
    "moment": "Moment of one chamber at the largest fill",
    "usable_moment": "Usable moment of one pair",
    "chamber_volume": "Volume of one chamber",
    "crest_pressure": "Pressure over the siphon crest as the tube runs, gauge",
    "cavitation_margin": "Cavitation margin of a tube that ran full; below zero the column separates",
}
_EXACT: Final = 1e-6
"""Relative total below which a number is a closed form of inputs that are taken as exact."""
_DRAWN: Final = {"velocity": "Velocity", "usable_moment": "Usable moment", "lambda": "Lever arm λ"}
_REGIMES: Final = {
    "blocked": "is blocked",
    "siphon": "runs as a full siphon",
    "separated": "runs with a separated column",
    "reverse": "runs in reverse",
    "cannot be told": "runs full or with a separated column, which cannot be told",
}


def _view(_own: Record, evidence: Record) -> Record:
    drawn = tornado(evidence["calibration"].get("budgets") or {}, _DRAWN)
    return {"state": _state(evidence), "budgets": _budget_table(evidence), "tornado": drawn}


def _state(evidence: Record) -> str:
    """At which gas pressure and fill the velocities hold, and how the tube then runs."""
    point = evidence["operating_point"]
    at = f"At {given(point['gas_pressure_Pa'], 'Pa')} and equal fills of {given(point['fill_ratio'], '1')}"
    if point["k"] is None:
        return f"{at} nothing flows: the tube {_REGIMES[point['regime']]}."
    return (
        f"{at} the tube {_REGIMES[point['regime']]}; the flow is {point['flow_state']}, Re "
        f"{traced(number(point['reynolds'], digits=2), 'operating_point.reynolds')}. Below "
        f"{read(evidence, 'operating_point.stall_pressure_Pa', 'Pa', width=point['stall_uncertainty'])} a "
        "full siphon stops before the chamber is empty."
    )


def _budget_table(evidence: Record) -> Table:
    budgets = evidence["calibration"].get("budgets") or {}
    return Table(
        caption="Numbers to use, with their expanded uncertainties (95 %): ± is the root of the sum of "
        "squares of the three parts. Pressures are gauge."
        f"{'' if states_uncertainty(evidence) else f' {UNSTATED}'}",
        heads=(
            "Quantity",
            "Value ± total",
            "Numerical",
            "Inputs",
            "Model",
            "Largest input",
            "Measurements behind the model part",
            "The paper",
        ),
        rows=[_row(evidence, name) for name in _NAMES if name in budgets],
        style="",
    )


def _row(evidence: Record, name: str) -> Cells:
    path, budget = f"calibration.budgets.{name}", evidence["calibration"]["budgets"][name]
    unit = display_unit(budget["unit"], budget["value"], budget["total"])
    parts = [
        _part(budget[part] * unit.factor, budget["total"] * unit.factor, f"{path}.{part}")
        for part in ("numerical", "input", "model")
    ]
    total = believed(budget["value"], budget["total"], stated=states_uncertainty(evidence))
    exact = total is None or total < _EXACT * abs(budget["value"])
    parts = [MISSING] * len(parts) if exact else parts
    value = traced(
        shown(budget["value"], budget["unit"], None if exact else total, digits=4), f"{path}.value"
    )
    behind = budget_standing(evidence["verification"], name)
    return _NAMES[name], value, *parts, _largest(evidence, budget), behind, _paper(evidence, name)


def _part(part: float, total: float, path: str) -> str:
    """A part to the place of the total's second digit, or that it is smaller than that."""
    place = math.floor(math.log10(total)) - 1 if total else 0
    if round(part, -place) == 0:
        return f"< {fixed(10.0**place, max(-place, 0))}"
    return traced(fixed(round(part, -place), max(-place, 0)), path)


def _largest(evidence: Record, budget: Record) -> str:
    inputs = budget["inputs"]
    if not inputs or not budget["value"]:
        return MISSING
    path = max(inputs, key=inputs.__getitem__)
    return named_with_origin(evidence, path)


def _paper(evidence: Record, name: str) -> str:
    paper, point = evidence["paper"], evidence["operating_point"]
    if name == "lambda":
        return f"{traced(given(paper['lambda_m'], 'm'), 'paper.lambda_m')} on its own disc"
    if name == "drag_coefficient":
        return f"about {traced(given(paper['drag_coefficient'], '1'), 'paper.drag_coefficient')}"
    if name == "velocity":
        return (
            read(evidence, "operating_point.velocity_paper_m_s", "m/s") + " by Eq. 19" if point else MISSING
        )
    if name == "wall_pressure":
        return read(evidence, "calibration.chamber.wall_pressure_paper_Pa.-1", "Pa", digits=4) + " by Eq. 12"
    if name == "moment":
        return read(evidence, "calibration.chamber.moment_paper_kg_m.-1", "kg m", digits=4) + " by Eq. 7"
    return MISSING


SECTION: Final = Section(
    name="conditions", title="Numbers to use, and their conditions", place="report", show=_view
)
