"""The numbers to use, with what makes each uncertain, and the inputs on which they rest."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.figures.operation import tornado
from ringbalance.reports.section import Record, Section
from ringbalance.verification.standing import budget_standing

_DRAWN: Final = {"velocity": "Velocity", "usable_moment": "Usable moment", "lambda": "Lever arm λ"}


def _view(_own: Record, evidence: Record) -> Record:
    budgets = evidence["calibration"].get("budgets") or {}
    return {
        "behind": {name: budget_standing(evidence["verification"], name) for name in budgets},
        "tornado": tornado(budgets, _DRAWN),
    }


SECTION: Final = Section(
    name="conditions", title="Numbers to use, and their conditions", place="report", show=_view
)
