"""The scene at its extremes: where answers end, and what is said beyond, from the heavy case `extremes`."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.section import Record, Section
from ringbalance.results.result import Table
from ringbalance.verification.extremes.study import axis_rows

CASE: Final = "extremes"


def _view(_own: Record, evidence: Record) -> Record:
    """Sentences and the table of axes."""
    case = next((c for c in evidence.get("verification", []) if c["id"] == CASE), None)
    if case is None or not case.get("tables"):
        return {"ran": False}
    tables = {table["name"]: table["columns"] for table in case["tables"]}
    return {
        "ran": True,
        "text": case.get("explanation", ""),
        "date": case.get("date", ""),
        "table": Table(
            caption="Each input alone, from end to end, all else as in the paper’s scene: where points begin "
            "to end in another way, and what is said there.",
            heads=("Input", "Stretch", "Answer", "Loop", "Said"),
            rows=axis_rows(tables["axes"]),
            style="",
        ),
    }


SECTION: Final = Section(name="extremes", title="At the extremes", show=_view)
"""Shown also where it was not run, to say how it is."""
