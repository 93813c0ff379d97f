"""What is validated, what is verified, what is assumed; and a credibility assessment after NASA-STD-7009B."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

from ringbalance.reports import summary
from ringbalance.reports.prose import input_name
from ringbalance.reports.section import Cells, Record, Section, Table
from ringbalance.verification.standing import HEADS, standing_rows

_UNSURE: Final = ("assumed", "inferred", "default")
_NOBODYS: Final = {"assumed": "are assumed", "default": "are defaults of the program"}


def _view(_own: Record, evidence: Record) -> Record:
    return {
        "standing": _standing(evidence),
        "assumed": _origins(evidence),
        "credibility": _credibility(evidence),
        "fitted": bool(evidence["scene"].get("measured")),
    }


def _standing(evidence: Record) -> Table:
    cases = [case for case in evidence["verification"] if case["kind"] != "claim"]
    rows = standing_rows(cases, balancer=evidence.get("balancer", "liquid_ring"))
    return Table(
        caption="What stands behind each predicted quantity. Measurements are those of others on parts like "
        "the device’s; “within” is the share of the judged points that lie within both 95 % intervals, bias "
        "and scatter are those of predicted over measured values. Points that taught a coefficient are left "
        "out and not counted as predicted.",
        heads=HEADS,
        rows=[tuple(cell.replace(" -", " −") for cell in row) for row in rows],
        style="dense",
    )


def _outcome(cases: Sequence[Record]) -> str:
    counts = summary.verdict_counts(list(cases), tuple(dict.fromkeys(case["verdict"] for case in cases)))
    return ", ".join(f"{item['count']} {item['verdict']}" for item in counts) or "none run"


def _origins(evidence: Record) -> list[str]:
    """Inputs that nobody gave, by origin."""
    found = {
        origin: sorted(input_name(path) for path, own in _inputs(evidence).items() if own == origin)
        for origin in _UNSURE[:2]
    }
    return [f"{origin.capitalize()}: {', '.join(names)}." for origin, names in found.items() if names]


def _inputs(evidence: Record) -> dict[str, str]:
    """Origins by path, but those of stated uncertainties."""
    origins: dict[str, str] = evidence["scene"].get("origins") or {}
    return {path: origin for path, origin in origins.items() if not path.startswith("uncertainty.")}


def _credibility(evidence: Record) -> Table:
    return Table(
        caption="Credibility after NASA-STD-7009B: levels from 0 (insufficient evidence) to 4, assessed by "
        "the program’s authors and not reviewed by others.",
        heads=("Factor", "Level", "Evidence"),
        rows=[*_development(evidence), *_use(evidence)],
        style="whole",
    )


def _development(evidence: Record) -> list[Cells]:
    checks = summary.checks(evidence)
    failed = [case for case in checks if case["verdict"] == "failed"]
    known = {"given", "measured"} & set((evidence["scene"].get("origins") or {}).values())
    pedigree = ("1", "Some of the device’s data come from a document.")
    verified = (
        "1" if failed else "3",
        f"{_outcome(checks)}; numerical errors are estimated, and deliberate errors in the code must be "
        "noticed.",
    )
    validated = any(case["kind"] == "validation" for case in checks)
    measured = ("1", "Parts only, see above; none of the device.")
    return [
        ("Data pedigree", *(pedigree if known else ("0", "No value comes from a document of the device."))),
        ("Verification", *(verified if checks else ("0", "No check was run for this report."))),
        ("Validation", *(measured if validated else ("0", "None was run."))),
    ]


def _use(evidence: Record) -> list[Cells]:
    budgets = (evidence.get("calibration") or {}).get("budgets")
    moved = any(row["achieved_interval"] for row in evidence.get("requirements", ()))
    origins = Counter(row["origin"] for row in evidence["scene"].get("table") or [])
    unsure = " and ".join(f"{origins[each]} {words}" for each, words in _NOBODYS.items() if origins[each])
    return [
        (
            "Input pedigree",
            "1" if unsure else "2",
            f"Of the scene’s values {unsure}." if unsure else "Every input is given, measured or inferred.",
        ),
        (
            "Uncertainty characterisation",
            *(
                (
                    "3",
                    "Numerical, input and model parts of each main quantity; the closed loop over drawn "
                    "inputs and noise.",
                )
                if budgets
                else ("2", "Stated inputs and noise, of each result of the run; no model part.")
                if moved
                else ("1", "The filters’ covariances of one run with one seed.")
            ),
        ),
        ("Robustness of results", "2", "Sensitivity to each stated input; not to combinations of them.")
        if budgets or moved
        else ("Robustness of results", "0", "Not studied."),
        ("Use history", "0", "No decision on a built device is known to rest on this program."),
        ("Management", "2", "Versioned, tested at each change, evidence kept with dates and hashes."),
    ]


SECTION: Final = Section(
    name="credibility", title="What is validated, verified and assumed", place="report", show=_view
)
