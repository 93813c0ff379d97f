"""What the report rests on: numbers to use, evidence and credibility, document data, symbols, sources."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Final

from ringbalance.reports import summary
from ringbalance.reports.figures.operation import tornado
from ringbalance.reports.prose import input_name
from ringbalance.reports.section import Record, Section
from ringbalance.results.result import Table
from ringbalance.verification.standing import HEADS, budget_standing, standing_rows

_DRAWN: Final = {"velocity": "Velocity", "usable_moment": "Usable moment", "lambda": "Lever arm λ"}


def _conditions(_own: Record, evidence: Record) -> Record:
    budgets = evidence["calibration"].get("budgets") or {}
    return {
        "behind": {name: budget_standing(evidence["verification"], name) for name in budgets},
        "tornado": tornado(budgets, _DRAWN),
    }


CONDITIONS: Final = Section(
    name="conditions", title="Numbers to use, and their conditions", place="report", show=_conditions
)


_NOBODYS: Final = {"assumed": "are assumed", "default": "are defaults of the program"}


def _credibility(_own: Record, evidence: Record) -> Record:
    checks, scene = summary.checks(evidence), evidence["scene"]
    origins: dict[str, str] = scene.get("origins") or {}
    counts = Counter(row["origin"] for row in scene.get("table") or [])
    return {
        "standing": _standing(evidence, checks),
        **{origin: _inputs(origins, origin) for origin in ("assumed", "inferred")},
        "documented": bool({"given", "measured"} & set(origins.values())),
        "checks": _outcome(checks),
        "failed": any(case["verdict"] == "failed" for case in checks),
        "validated": any(case["kind"] == "validation" for case in checks),
        "unsure": [f"{counts[origin]} {words}" for origin, words in _NOBODYS.items() if counts[origin]],
        "budgets": bool((evidence.get("calibration") or {}).get("budgets")),
        "drawn": any(row["achieved_interval"] for row in evidence.get("requirements", ())),
    }


def _standing(evidence: Record, checks: list[Record]) -> Table:
    return Table(
        caption="What stands behind each predicted quantity. Measurements are those of others on parts like "
        "the device’s; “within” is the share of the judged points that lie within both 95 % intervals, bias "
        "and scatter are those of predicted over measured values. Points that taught a coefficient are left "
        "out and not counted as predicted.",
        heads=HEADS,
        rows=[
            tuple(cell.replace(" -", " −") for cell in row)
            for row in standing_rows(checks, balancer=evidence.get("balancer", "liquid_ring"))
        ],
        style="dense",
    )


def _outcome(cases: Sequence[Record]) -> str:
    """Number of cases under each verdict; empty without cases."""
    counts = Counter(case["verdict"] for case in cases)
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items())


def _inputs(origins: dict[str, str], origin: str) -> list[str]:
    """Names of the inputs of one origin, but of stated uncertainties."""
    paths = (path for path, of in origins.items() if of == origin and not path.startswith("uncertainty."))
    return sorted(map(input_name, paths))


CREDIBILITY: Final = Section(
    name="credibility", title="What is validated, verified and assumed", place="report", show=_credibility
)


@cache
def symbols_and_sources() -> Record:
    """Symbols with unit and term of the glossary, and sources, by kind of balancer."""
    path = files("ringbalance.reports").joinpath("templates", "document.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def evidence_text(evidence: Record) -> str:
    """The evidence as its file holds it."""
    return json.dumps(evidence, allow_nan=False, indent=1, ensure_ascii=False) + "\n"


def _document(_own: Record, evidence: Record) -> Record:
    listed = symbols_and_sources()
    balancer = listed[evidence.get("balancer", "liquid_ring")]
    return {
        "evidence_sha256": hashlib.sha256(evidence_text(evidence).encode()).hexdigest(),
        "kept": [case for case in evidence["verification"] if case.get("date")],
        "kept_by_date": Counter(evidence["times"].get("kept_cases", {}).values()),
        "symbols": balancer["symbols"],
        "sources": balancer["sources"] + listed["every"]["sources"],
    }


DOCUMENT: Final = Section(
    name="document", title="Document data, symbols and sources", place="report", show=_document
)
