"""Verdicts: on requirements, on whether the limit is within reach; claims and checks counted by theirs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
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
LIKELY: Final = 0.95
"""Fraction of runs that must settle in time, the confidence of every interval in the report."""


def above(value: float, bound: float, width: float) -> str:
    """Whether a value is above a bound by more than a half-width."""
    if abs(value - bound) <= width:
        return OPEN
    return MET if value > bound else MISSED


def below(values: Iterable[float], bound: float) -> str:
    """Whether all of some values are at most a bound, none, or some."""
    within = [value <= bound for value in values]
    return MET if all(within) else (OPEN if any(within) else MISSED)


def worst(*verdicts: str) -> str:
    """The worst of some verdicts on requirements."""
    return next(verdict for verdict in (MISSED, OPEN, MET) if verdict in verdicts)


def decided(judged: Sequence[tuple[str, str]]) -> str:
    """One sentence on requirements, given by name and verdict: how many are met, and which are not."""
    named = {v: [name for name, verdict in judged if verdict == v] for v in (MISSED, OPEN)}
    met = len(judged) - sum(map(len, named.values()))
    said = f"{met} of {len(judged)} requirements {'is' if met == 1 else 'are'} met"
    parts = [f"{verdict}: {', '.join(names)}" for verdict, names in named.items() if names]
    return "; ".join([said, *parts]) + "."


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
    cases = claims(evidence, paper=evidence.get("balancer", "liquid_ring"))
    return bool(cases) and not any(elsewhere(case, evidence) for case in cases)


def tuning_of(evidence: Record) -> Record:
    """The tuning's document; empty where nothing was tuned."""
    return (evidence.get("summary") or {}).get("tuning") or {}


def line_verdict(evidence: Record) -> str:
    """Whether the gas line's smallest correction leaves the limit within reach; met without one.

    Runs of a given line show it, and then it is judged with them.
    """
    line = evidence["calibration"].get("gas_line")
    if not line or any(end.get("smallest_correction_m") is None for end in line["ends"]):
        return MET
    if line["given"] and tuning_of(evidence).get("fraction_settled") is not None and settles(evidence) == MET:
        return MET
    return below((end["smallest_correction_m"] for end in line["ends"]), line["largest_correction_m"])


def runs_settled(tuning: Record) -> str:
    """How many of the runs settle: a count, which claims nothing finer than their number."""
    low, high = map(percent, tuning["fraction_settled_95"])
    return (
        f"{round(tuning['fraction_settled'] * tuning['runs'])} of {tuning['runs']} runs "
        f"(95 % confidence: {low} to {high})"
    )


def settles(evidence: Record) -> str:
    """Whether runs with the recommended settings settle, late or not; met where no runs were made."""
    tuning = tuning_of(evidence)
    if not tuning.get("runs") or tuning.get("fraction_settled") is None:
        return MET
    if tuning["fraction_settled_95"][1] < LIKELY:
        return MISSED
    return MET if tuning["fraction_settled"] >= LIKELY else OPEN


def what_enlarges(evidence: Record) -> str:
    """What makes the residual larger than noise does."""
    steps = {MISSED: "is", OPEN: "may be"}.get(line_verdict(evidence))
    told = [f"the smallest correction {steps} too large for the limit"] if steps else []
    if settles(evidence) != MET:
        told.append("too few runs settle")
    return "; ".join([ideal_valve(evidence), *told])


def ideal_valve(evidence: Record) -> str:
    """That runs are those of a valve that acts at once; empty where the scene describes one."""
    line = evidence["calibration"].get("gas_line") or {"given": True}
    return "" if line["given"] else "; for a valve that acts at once"
