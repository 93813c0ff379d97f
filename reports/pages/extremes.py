"""The scene at its extremes: where answers end, and what is said beyond, from the heavy case `extremes`."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.section import Record, Section
from ringbalance.results.numbers import number
from ringbalance.results.result import Cells, Table

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


def axis_rows(columns: Record) -> list[Cells]:
    """The intervals of every axis: its title (at its first), interval, answer, loop and message."""
    before = ["", *columns["axis"]]
    return [
        (
            "" if title == before[index] else title,
            _span(columns["from"][index], columns["to"][index], columns["unit"][index]),
            str(columns["ending"][index]).removesuffix(" with a message"),
            str(columns["loop"][index]).replace("_", " "),
            _shortened(str(columns["said"][index])),
        )
        for index, title in enumerate(columns["axis"])
    ]


def _span(low: float, high: float, unit: str) -> str:
    """First and last value of a stretch, or the one where both are the same."""
    first, last = (number(float(end), digits=3) for end in (low, high))
    told = first if first == last else f"{first} to {last}"
    return told if unit == "1" else f"{told} {_shown(unit)}"


def _shown(unit: str) -> str:
    return unit.replace("^2", "²")


def _shortened(message: str) -> str:
    """The first line of a message, without the name of a file that nobody has."""
    return message.split("\n")[0].split(".toml: ", 1)[-1]


SECTION: Final = Section(name="extremes", title="At the extremes", show=_view)
"""Shown also where it was not run, to say how it is."""
