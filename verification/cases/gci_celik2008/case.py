"""Three-mesh grid convergence against the published worked examples."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Final

from ringbalance.physics.convergence import GridConvergence, GridVerdict, gci
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Table, as_found

_FORMAL_ORDER: Final = 2.0
_LAST_DIGIT: Final = {"order": 0.01, "limit": 0.0001, "error": 0.1, "index": 0.1}
_CELLS_OF_FIRST: Final = (18000, 8000, 4500)
_EXPECTED: Final = (GridVerdict.MONOTONE, GridVerdict.NOT_ASYMPTOTIC, GridVerdict.OSCILLATORY)


@dataclass(frozen=True, kw_only=True)
class _Column:
    """One published example."""

    name: str
    values: tuple[float, ...]
    sizes: tuple[float, ...]
    printed: Mapping[str, tuple[float, ...]]


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    columns = _columns()
    found = [_judge(column, defect) for column in columns]
    digits = {
        name: max(
            abs(mine - theirs) / unit
            for column, result in zip(columns, found, strict=True)
            for mine, theirs in zip(_results(result)[name], column.printed[name], strict=True)
        )
        for name, unit in _LAST_DIGIT.items()
    }
    wrong = sum(result.verdict is not expected for result, expected in zip(found, _EXPECTED, strict=True))
    return Evidence(
        found={f"{name}_digits": Found(value=value) for name, value in digits.items()}
        | as_found(wrong_verdicts=wrong),
        numbers={"worst": max(digits.values())},
        tables=(_table(columns, found),),
    )


@lru_cache(maxsize=1)
def _columns() -> tuple[_Column, ...]:
    path = files("ringbalance.verification.cases") / "gci_celik2008" / "data" / "celik2008_examples.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return tuple(_column(row, first=index == 0) for index, row in enumerate(rows))


def _column(row: Mapping[str, str], *, first: bool) -> _Column:
    number = {key: float(value) for key, value in row.items() if key != "case"}
    fine, middle, coarse = _CELLS_OF_FIRST
    r21, r32 = number["r21"], number["r32"]
    if first:
        # Printed as 1.333; the counts give it exactly, and p moves in its third digit.
        r21, r32 = (fine / middle) ** 0.5, (middle / coarse) ** 0.5
    return _Column(
        name=row["case"],
        values=(number["phi1"], number["phi2"], number["phi3"]),
        sizes=(1.0, r21, r21 * r32),
        printed={
            "order": (number["p"],),
            "limit": (number["phi_ext21"],),
            "error": (number["ea21_pct"], number["eext21_pct"]),
            "index": (number["GCI_fine21_pct"],),
        },
    )


def _judge(column: _Column, defect: str | None) -> GridConvergence:
    power = 2.0 if defect == "sizes_by_count" else 1.0
    return gci(
        values=column.values,
        sizes=[size**power for size in column.sizes],
        formal_order=_FORMAL_ORDER,
        safety=1.0 if defect == "safety_dropped" else 1.25,
    )


def _results(result: GridConvergence) -> Mapping[str, tuple[float, ...]]:
    return {
        "order": (result.observed_order,),
        "limit": (result.extrapolated,),
        "error": (100 * result.approximate_error, 100 * result.extrapolated_error),
        "index": (100 * result.index,),
    }


def _table(columns: Sequence[_Column], found: Sequence[GridConvergence]) -> Table:
    return Table(
        name="published examples, printed and found",
        columns={
            "example": [column.name for column in columns],
            "p printed": [column.printed["order"][0] for column in columns],
            "p found": [result.observed_order for result in found],
            "limit printed": [column.printed["limit"][0] for column in columns],
            "limit found": [result.extrapolated for result in found],
            "GCI printed, %": [column.printed["index"][0] for column in columns],
            "GCI found, %": [100 * result.index for result in found],
            "verdict": [result.verdict.value for result in found],
        },
    )
