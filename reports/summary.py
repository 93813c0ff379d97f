"""Verdicts in words: of devices that meet what is asked; claims and checks counted by theirs."""

from __future__ import annotations

import math
from collections import Counter
from typing import Final

from ringbalance.reports.prose import series
from ringbalance.reports.section import Record
from ringbalance.results.numbers import percent
from ringbalance.results.requirements import MET, MISSED, OPEN, UNASKED

CLAIM_VERDICTS: Final = ("confirmed", "confirmed with correction", "refuted", "inconclusive", "not run")
CHECK_VERDICTS: Final = ("passed", "failed", "inconclusive", "not run")
_TONES: Final = {
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


def is_verdict(text: str) -> bool:
    """Whether a cell of a table is a verdict, which has a colour of its own."""
    return text in _TONES


def tone(verdict: str) -> str:
    """Colour group of a verdict."""
    return _TONES.get(verdict, "open")


def claims(evidence: Record, *, paper: str = "liquid_ring") -> list[Record]:
    """Cases that judge one paper, in its order."""
    found = [
        case
        for case in evidence["verification"]
        if case["kind"] == "claim" and case.get("paper", "liquid_ring") == paper
    ]
    return sorted(found, key=lambda case: (case.get("number") or math.inf, case["id"]))


def checks(evidence: Record) -> list[Record]:
    """Cases that judge this program's own solvers."""
    return [case for case in evidence["verification"] if case["kind"] != "claim"]


def verdict_counts(cases: list[Record], verdicts: tuple[str, ...]) -> list[Record]:
    """Number of cases under each verdict, in a fixed order, without the empty ones."""
    tally = Counter(case["verdict"] for case in cases)
    return [{"verdict": v, "tone": tone(v), "count": tally[v]} for v in verdicts if tally[v]]


def counted(cases: list[Record]) -> list[str]:
    """How many claims have each verdict, as words."""
    counts = verdict_counts(cases, CLAIM_VERDICTS)
    return [f"{c['count']} {'is' if c['count'] == 1 else 'are'} {c['verdict']}" for c in counts]


def common_causes(cases: list[Record]) -> list[str]:
    """What several claims that do not simply hold have in common; the most frequent cause first."""
    groups: dict[str, list[str]] = {}
    for case in cases:
        if case.get("cause"):
            groups.setdefault(case["cause"], []).append(str(case["number"]))
    ordered = sorted(groups.items(), key=lambda group: -len(group[1]))
    return [f"{cause}: claims {', '.join(numbers)}" for cause, numbers in ordered if len(numbers) > 1]


def lead_sentence(evidence: Record) -> str:
    """The whole result in two sentences, counted from the verdicts."""
    parts = counted(claims(evidence))
    measured = [case for case in checks(evidence) if case["kind"] == "validation"]
    own = [case for case in checks(evidence) if case not in measured]
    run = [case for case in own if case["verdict"] != "not run"]
    passed = sum(case["verdict"] == "passed" for case in run)
    told = (
        f"Of {len(claims(evidence))} claims of the liquid-ring paper {series(parts) or 'none was judged'}. "
    )
    foreign = sum(elsewhere(case, evidence) for case in claims(evidence))
    if foreign:
        told += (
            f"{foreign} of them hold for the paper’s own disc alone and were judged on it, not on this one. "
        )
    told += f"Of {len(run)} checks of this program itself that were run, {passed} passed."
    if measured:
        confirmed = sum(case["verdict"] == "confirmed" for case in measured)
        told += f" Of {len(measured)} comparisons of parts with measurements, {confirmed} are confirmed."
    return told


def elsewhere(case: Record, evidence: Record) -> bool:
    """Whether a case was judged on another disc than the report's, such as the paper's own.

    Returns: True when its numbers are not those of the report's scene.
    """
    judged = case.get("scene_sha256")
    return bool(judged) and judged != evidence["scene"]["values_sha256"]


def is_papers(evidence: Record) -> bool:
    """Whether the scene is the one that its paper's claims are judged on."""
    cases = claims(evidence, paper=evidence["balancer"])
    return bool(cases) and not any(elsewhere(case, evidence) for case in cases)


def judged_sentences(evidence: Record) -> list[str]:
    """For what fraction of devices the scene's settings work, and what was recommended."""
    found = evidence.get("summary") or {}
    told = []
    for name, words in (("own", "the scene’s settings"), ("recommended", "the recommended settings")):
        if of := found.get(name):
            fraction = of["fraction"]
            low, high = percent(fraction["low"]), percent(fraction["high"])
            told.append(
                f"With {words} {percent(fraction['value'])} of {fraction['of']} drawn devices settle and "
                f"stay ({low} to {high}), {percent(of['asked'])} asked: {of['verdict']}."
            )
    return told
