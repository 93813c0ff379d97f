"""Verdicts from limits that stood before the result: first of each quantity, then of the whole case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from ringbalance.verification.comparison import Comparison, compare
from ringbalance.verification.evidence import Found, Reference

Kind = Literal["validation", "code_verification", "solution_verification", "claim"]
Metric = Literal["validation", "within_uncertainty", "relative", "absolute", "at_most", "at_least"]


class Verdict(StrEnum):
    """What is said of a quantity or a case."""

    PASSED = "passed"
    FAILED = "failed"
    CONFIRMED = "confirmed"
    CORRECTED = "confirmed with correction"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"
    NOT_RUN = "not run"


VOCABULARY: dict[Kind, tuple[Verdict, ...]] = {
    "claim": (
        Verdict.REFUTED,
        Verdict.INCONCLUSIVE,
        Verdict.CORRECTED,
        Verdict.CONFIRMED,
        Verdict.NOT_RUN,
    ),
    "validation": (Verdict.REFUTED, Verdict.INCONCLUSIVE, Verdict.CONFIRMED, Verdict.NOT_RUN),
    "code_verification": (Verdict.FAILED, Verdict.INCONCLUSIVE, Verdict.PASSED, Verdict.NOT_RUN),
    "solution_verification": (Verdict.FAILED, Verdict.INCONCLUSIVE, Verdict.PASSED, Verdict.NOT_RUN),
}
"""Verdicts of each kind of case, the one that decides the case first."""


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """One quantity of a case, judged."""

    verdict: Verdict
    comparison: Comparison
    """Against the reference, or against the limit where the metric knows no reference."""


def judge_quantity(
    *, kind: Kind, metric: Metric, limit: float, found: Found, reference: Reference | None
) -> Judgement:
    """Judge one quantity by its metric and limit.

    `validation` (claims) and `within_uncertainty`: E = S - D against 2 u_val; a comparison whose 2 u_val is
    wider than limit |D| (limit alone where D is zero) is inconclusive.  `relative`, `absolute`: |E| against
    limit |D| or limit.  `at_most`, `at_least`: S against the limit, inconclusive in a claim when the limit
    lies inside S's own 95 % interval.
    Raises: ValueError: a metric that needs a reference, without one.
    """
    if metric in ("at_most", "at_least"):
        return _judge_bound(kind, metric, limit, found)
    if reference is None:
        raise ValueError(f'metric "{metric}" needs a reference')
    comparison = _compare(found.value, found, reference)
    if not found.conclusive:
        return Judgement(verdict=Verdict.INCONCLUSIVE, comparison=comparison)
    if metric in ("relative", "absolute"):
        scale = abs(reference.value) if metric == "relative" else 1.0
        return Judgement(
            verdict=_yes_or_no(kind, abs(comparison.error) <= limit * scale), comparison=comparison
        )
    return Judgement(verdict=_against_uncertainty(kind, limit, found, reference), comparison=comparison)


def _compare(value: float, found: Found, reference: Reference) -> Comparison:
    return compare(
        found=value,
        reference=reference.value,
        numerical=found.numerical,
        input_=found.input,
        reference_uncertainty=reference.uncertainty,
    )


def _yes_or_no(kind: Kind, holds: bool) -> Verdict:
    if kind in ("claim", "validation"):
        return Verdict.CONFIRMED if holds else Verdict.REFUTED
    return Verdict.PASSED if holds else Verdict.FAILED


def _against_uncertainty(kind: Kind, limit: float, found: Found, reference: Reference) -> Verdict:
    comparison = _compare(found.value, found, reference)
    if comparison.consistent:
        widest = limit * (abs(reference.value) or 1.0)
        return _yes_or_no(kind, True) if comparison.half_width <= widest else Verdict.INCONCLUSIVE
    if kind == "claim" and found.corrected is not None:
        corrected = _compare(found.corrected, found, reference)
        return Verdict.CORRECTED if corrected.consistent else Verdict.REFUTED
    return _yes_or_no(kind, False)


def _judge_bound(kind: Kind, metric: Metric, limit: float, found: Found) -> Judgement:
    comparison = compare(found=found.value, reference=limit, numerical=found.numerical, input_=found.input)
    if not found.conclusive:
        return Judgement(verdict=Verdict.INCONCLUSIVE, comparison=comparison)
    uncertain = found.numerical > 0 or found.input > 0
    if kind == "claim" and uncertain and comparison.consistent:
        return Judgement(verdict=Verdict.INCONCLUSIVE, comparison=comparison)
    holds = found.value <= limit if metric == "at_most" else found.value >= limit
    return Judgement(verdict=_yes_or_no(kind, holds), comparison=comparison)


def combine(*, kind: Kind, verdicts: Sequence[Verdict]) -> Verdict:
    """Verdict of a case: that of its quantity that decides; not run when there are none.

    Raises: ValueError: a verdict that this kind of case does not know.
    """
    strange = [verdict for verdict in verdicts if verdict not in VOCABULARY[kind]]
    if strange:
        raise ValueError(f'a {kind} case knows no "{strange[0]}"')
    if not verdicts:
        return Verdict.NOT_RUN
    return min(verdicts, key=VOCABULARY[kind].index)
