"""Verdicts by limits set before the result: first on each quantity, then on the whole case.

An assumed input can only weaken a verdict. A quantity is confirmed or refuted when it is so at every value
that its assumed inputs may have; otherwise it is inconclusive, however well the assumed values agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Literal

from ringbalance.verification.evidence import Deviation, Found, Reference

Kind = Literal["validation", "code_verification", "solution_verification", "claim"]
Metric = Literal["validation", "within_uncertainty", "relative", "absolute", "at_most", "at_least"]
Role = Literal["number", "idea", "reading"]
"""Subject of a claim's quantity: a number of the paper's, the idea behind it, or one of several readings."""


class Verdict(StrEnum):
    """Verdict on a quantity or a case."""

    PASSED = "passed"
    FAILED = "failed"
    CONFIRMED = "confirmed"
    CORRECTED = "confirmed with correction"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"
    NOT_RUN = "not run"


_OF_A_CHECK = (Verdict.FAILED, Verdict.INCONCLUSIVE, Verdict.PASSED, Verdict.NOT_RUN)
_OF_A_MODEL = (Verdict.REFUTED, Verdict.INCONCLUSIVE, Verdict.CONFIRMED, Verdict.NOT_RUN)
VOCABULARY: dict[Kind, tuple[Verdict, ...]] = {
    "claim": (*_OF_A_MODEL[:2], Verdict.CORRECTED, *_OF_A_MODEL[2:]),
    "validation": _OF_A_MODEL,
    "code_verification": _OF_A_CHECK,
    "solution_verification": _OF_A_CHECK,
}
"""Verdicts of each kind of case, the one that decides the case first."""


def judge_quantity(*, kind: Kind, metric: Metric, limit: float, number: Found) -> tuple[Verdict, Deviation]:
    """Judge one quantity by its metric and limit, compared with its reference, or with the limit as a bound.

    `validation` (claims) and `within_uncertainty`: E = S - D against 2 u_val, without what assumed inputs
    add. It holds when |E| <= 2 u_val <= limit |D| (limit alone where D is zero) and no assumed input takes
    |E| beyond limit |D|; it fails when no assumed input brings |E| within 2 u_val.  `relative`,
    `absolute`: |E| against limit |D| or limit.  `at_most`, `at_least`: S against the limit, inconclusive in a
    claim when the limit lies inside S's own 95 % interval or within the reach of the assumed inputs.
    Raises: ValueError: a metric that needs a reference, without one.
    """
    bound = metric in ("at_most", "at_least")
    reference = Reference(value=limit) if bound else number.reference
    if reference is None:
        raise ValueError(f'metric "{metric}" needs a reference')
    deviation = number.compared(reference)
    if not number.conclusive:
        return Verdict.INCONCLUSIVE, deviation
    if bound:
        verdict = _by_bound(kind, metric, number, deviation)
    elif metric in ("relative", "absolute"):
        scale = abs(reference.value) if metric == "relative" else 1.0
        verdict = _yes_or_no(kind, abs(deviation.error) <= limit * scale)
    else:
        verdict = _by_uncertainty(kind, limit, number, reference, deviation)
    return verdict, deviation


def _yes_or_no(kind: Kind, holds: bool) -> Verdict:
    if kind in ("claim", "validation"):
        return Verdict.CONFIRMED if holds else Verdict.REFUTED
    return Verdict.PASSED if holds else Verdict.FAILED


def _by_uncertainty(
    kind: Kind, limit: float, number: Found, reference: Reference, deviation: Deviation
) -> Verdict:
    widest = limit * (abs(reference.value) or 1.0)
    low, high = (deviation.error + reach for reach in number.reach)
    if deviation.consistent:
        decided = deviation.half_width <= widest and max(-low, high) <= widest
        return _yes_or_no(kind, True) if decided else Verdict.INCONCLUSIVE
    if low <= deviation.half_width and high >= -deviation.half_width:
        return Verdict.INCONCLUSIVE
    if kind == "claim" and number.corrected is not None:
        departure = abs(number.corrected - reference.value)
        return Verdict.CORRECTED if departure <= deviation.half_width else Verdict.REFUTED
    return _yes_or_no(kind, False)


def _by_bound(kind: Kind, metric: Metric, number: Found, deviation: Deviation) -> Verdict:
    """Verdict by the error against the limit; an exact number may lie on it."""
    low, high = number.reach
    uncertain = number.numerical > 0 or number.input > 0 or low < 0 or high > 0
    half_width = deviation.half_width
    if (
        kind in ("claim", "validation")
        and uncertain
        and low - half_width <= -deviation.error <= high + half_width
    ):
        return Verdict.INCONCLUSIVE
    holds = deviation.error <= 0 if metric == "at_most" else deviation.error >= 0
    if kind == "claim" and not holds and number.corrected is not None:
        corrected = number.corrected - number.value + deviation.error
        explained = corrected <= half_width if metric == "at_most" else corrected >= -half_width
        return Verdict.CORRECTED if explained else Verdict.REFUTED
    return _yes_or_no(kind, holds)


def combine(*, kind: Kind, verdicts: Sequence[Verdict], roles: Sequence[Role] = ()) -> Verdict:
    """Verdict of a case: that of its deciding quantity; not run without quantities.

    Readings of one claim count as one, the most favourable. A number that holds after a
    correction leaves a claim confirmed with correction where its idea was judged and confirmed; otherwise it
    is refuted. Args: `roles`: of each verdict, default "number".
    Raises: ValueError: a verdict that this kind of case does not have.
    """
    order = VOCABULARY[kind]
    unknown = [verdict for verdict in verdicts if verdict not in order]
    if unknown:
        raise ValueError(f'a {kind} case knows no "{unknown[0]}"')
    if not verdicts:
        return Verdict.NOT_RUN
    pairs = list(zip(verdicts, roles or ("number",) * len(verdicts), strict=True))
    counted = [verdict for verdict, role in pairs if role != "reading"]
    readings = [verdict for verdict, role in pairs if role == "reading"]
    if readings:
        counted.append(max(readings, key=order.index))
    worst = min(counted, key=order.index)
    if worst is Verdict.CORRECTED and (Verdict.CONFIRMED, "idea") not in pairs:
        return Verdict.REFUTED
    return worst
