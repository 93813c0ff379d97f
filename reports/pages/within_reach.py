"""Whether runs and the valve's smallest correction leave the limit of the vibration within reach."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.numbers import percent
from ringbalance.reports.section import Record
from ringbalance.reports.summary import MET, MISSED, OPEN, below

LIKELY: Final = 0.95
"""Fraction of runs that must settle in time, the confidence of every interval in the report."""


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
