"""Studies of the scene: where answers end and what is said beyond, and speed against accuracy."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.result import Table
from ringbalance.scene.models import Scene
from ringbalance.verification.extremes.study import axis_rows
from ringbalance.verification.trade import TradeStudy, error_text, models_table, trade_study

_CASE: Final = "extremes"


def _extremes(_own: Record, evidence: Record) -> Record:
    """Sentences and the table of axes."""
    case = next((c for c in evidence.get("verification", []) if c["id"] == _CASE), None)
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


EXTREMES: Final = Section(name="extremes", title="At the extremes", show=_extremes)
"""Shown also where it was not run, to say how it is."""


def _collect(work: Work) -> Record | None:
    """The trade of the scene, light: without meshes in three dimensions."""
    return _study(work.ring).to_dict()


@lru_cache(maxsize=4)
def _study(scene: Scene) -> TradeStudy:
    """One measurement serves every report of a scene within a process."""
    return trade_study(scene, level="light")


def _trade(trade: Record, evidence: Record) -> Record:
    times = evidence["times"].get("trade") or {}
    terms = [(row["term"], row["group"], error_text(row["estimated_contribution"])) for row in trade["terms"]]
    quantities = [quantity for quantity in trade["quantities"] if quantity["models"]]
    return {
        "terms": Table(
            caption="What leaving a term out would change, by the dimensionless group that it grows with.",
            heads=("Term", "Group", "Estimated contribution"),
            rows=terms,
        ),
        "quantities": [_quantity(each, times) for each in quantities],
    }


def _quantity(quantity: Record, times: Record) -> Record:
    table = models_table(quantity, times)
    title = quantity["title"][0].upper() + quantity["title"][1:]
    return {"title": title, "status": table.note, "models": table}


TRADE: Final = Section(name="trade", title="Speed against accuracy", collect=_collect, show=_trade)
