"""What is validated, what is verified, what is assumed; and a credibility assessment after NASA-STD-7009B."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

from ringbalance.reports import summary
from ringbalance.reports.prose import input_name
from ringbalance.reports.section import Record, Section, Table
from ringbalance.verification.standing import HEADS, standing_rows

_NOBODYS: Final = {"assumed": "are assumed", "default": "are defaults of the program"}


def _view(_own: Record, evidence: Record) -> Record:
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


SECTION: Final = Section(
    name="credibility", title="What is validated, verified and assumed", place="report", show=_view
)
