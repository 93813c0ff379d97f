"""Claims and checks counted by their verdicts, and the colours of verdicts."""

from __future__ import annotations

import math
from collections import Counter
from typing import Final

from ringbalance.reports.section import Record
from ringbalance.results.requirements import MET, MISSED, OPEN, UNASKED

CLAIM_VERDICTS: Final = ("confirmed", "confirmed with correction", "refuted", "inconclusive", "not run")
CHECK_VERDICTS: Final = ("passed", "failed", "inconclusive", "not run")
TONES: Final = {
    "confirmed": "good",
    "passed": "good",
    "confirmed with correction": "fair",
    "refuted": "bad",
    "failed": "bad",
    "inconclusive": "open",
    "not run": "idle",
    MET: "good",
    MISSED: "bad",
    OPEN: "open",
    UNASKED: "idle",
}


def tone(verdict: str) -> str:
    """Colour group of a verdict."""
    return TONES.get(verdict, "open")


def claims(evidence: Record) -> list[Record]:
    """Cases that judge the paper of the balancer, in its order."""
    cases = [case for case in evidence["verification"] if case["kind"] == "claim"]
    return sorted(cases, key=lambda case: (case.get("number") or math.inf, case["id"]))


def checks(evidence: Record) -> list[Record]:
    """Cases that judge this program's own solvers."""
    return [case for case in evidence["verification"] if case["kind"] != "claim"]


def verdict_counts(cases: list[Record], verdicts: tuple[str, ...]) -> list[Record]:
    """Number of cases under each verdict, in a fixed order, without the empty ones."""
    tally = Counter(case["verdict"] for case in cases)
    return [{"verdict": v, "tone": tone(v), "count": tally[v]} for v in verdicts if tally[v]]


def common_causes(cases: list[Record]) -> list[Record]:
    """Causes that several claims share, with the claims' numbers; the most frequent cause first."""
    groups: dict[str, list[int]] = {}
    for case in cases:
        if case.get("cause"):
            groups.setdefault(case["cause"], []).append(case["number"])
    ordered = sorted(groups.items(), key=lambda group: -len(group[1]))
    return [{"cause": cause, "numbers": numbers} for cause, numbers in ordered if len(numbers) > 1]


def tallies(evidence: Record) -> Record:
    """Numbers of claims, of checks and of comparisons with measurements by verdict."""
    judged = claims(evidence)
    measured = [case for case in checks(evidence) if case["kind"] == "validation"]
    solver_checks = [case for case in checks(evidence) if case not in measured]
    run = [case for case in solver_checks if case["verdict"] != "not run"]
    return {
        "claims": verdict_counts(judged, CLAIM_VERDICTS),
        "claims_elsewhere": sum(elsewhere(case, evidence) for case in judged),
        "checks": verdict_counts(solver_checks, CHECK_VERDICTS),
        "checks_run": len(run),
        "checks_passed": sum(case["verdict"] == "passed" for case in run),
        "measured": len(measured),
        "measured_not_run": sum(case["verdict"] == "not run" for case in measured),
        "measured_confirmed": sum(case["verdict"] == "confirmed" for case in measured),
    }


def elsewhere(case: Record, evidence: Record) -> bool:
    """True if a case was judged on another scene than the report's, such as the paper's own disc."""
    judged = case.get("scene_sha256")
    return bool(judged) and judged != evidence["scene"]["values_sha256"]


def is_papers(evidence: Record) -> bool:
    """True if the scene is the one that its paper's claims are judged on."""
    cases = claims(evidence)
    return bool(cases) and not any(elsewhere(case, evidence) for case in cases)
