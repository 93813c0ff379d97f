"""Every branch of the verdict's logic, on numbers made for it."""

from __future__ import annotations

import pytest

from ringbalance.verification.evidence import Found, Reference
from ringbalance.verification.verdicts import Kind, Metric, Role, Verdict, combine, judge_quantity


def verdict(kind: Kind, metric: Metric, limit: float, found: Found, reference: Reference | None) -> Verdict:
    found = found if reference is None else found.against(reference)
    return judge_quantity(kind=kind, metric=metric, limit=limit, number=found)[0]


TEN = Reference(value=10.0, uncertainty=0.1)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (Found(value=10.1), "confirmed"),
        (Found(value=10.3), "refuted"),
        (Found(value=10.3, corrected=10.1), "confirmed with correction"),
        (Found(value=10.3, corrected=10.4), "refuted"),
        (Found(value=10.1, corrected=12.0), "confirmed"),
        (Found(value=10.3, input=1.0), "inconclusive"),
        (Found(value=13.0, input=1.0), "refuted"),
        (Found(value=10.3, numerical=0.2), "confirmed"),
        (Found(value=10.1, conclusive=False), "inconclusive"),
        (Found(value=99.0, conclusive=False), "inconclusive"),
    ],
)
def test_a_claim_against_its_reference(found: Found, expected: str) -> None:
    # The limit: a comparison wider than 5 % of the reference, 0.5, cannot tell.
    assert verdict("claim", "validation", 0.05, found, TEN) == expected


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (Found(value=10.1, numerical=0.1), "passed"),
        (Found(value=10.4, numerical=0.1), "failed"),
        (Found(value=10.4, numerical=1.0), "inconclusive"),
        (Found(value=10.4, numerical=0.1, corrected=10.0), "failed"),
        (Found(value=10.1, numerical=0.1, conclusive=False), "inconclusive"),
    ],
)
def test_a_verification_within_its_uncertainty(found: Found, expected: str) -> None:
    assert verdict("solution_verification", "within_uncertainty", 0.05, found, TEN) == expected


def test_the_widest_useful_comparison_is_absolute_where_the_reference_is_zero() -> None:
    zero = Reference(value=0.0)
    assert verdict("claim", "validation", 0.05, Found(value=0.01, input=0.02), zero) == "confirmed"
    assert verdict("claim", "validation", 0.05, Found(value=0.01, input=0.03), zero) == "inconclusive"


@pytest.mark.parametrize(
    ("metric", "value", "expected"),
    [
        ("relative", 10.4, "passed"),
        ("relative", 10.6, "failed"),
        ("relative", 9.6, "passed"),
        ("absolute", 10.04, "passed"),
        ("absolute", 9.9, "failed"),
        ("at_most", 0.05, "passed"),
        ("at_most", 0.051, "failed"),
        ("at_least", 0.05, "passed"),
        ("at_least", 0.049, "failed"),
    ],
)
def test_plain_limits(metric: Metric, value: float, expected: str) -> None:
    assert verdict("code_verification", metric, 0.05, Found(value=value), TEN) == expected


@pytest.mark.parametrize(
    ("metric", "found", "expected"),
    [
        ("at_most", Found(value=0.5), "confirmed"),
        ("at_most", Found(value=1.5), "refuted"),
        ("at_most", Found(value=0.5, input=0.1), "confirmed"),
        ("at_most", Found(value=0.9, input=0.1), "inconclusive"),
        ("at_most", Found(value=1.1, numerical=0.1), "inconclusive"),
        ("at_least", Found(value=1.5, input=0.1), "confirmed"),
        ("at_least", Found(value=0.5, input=0.1), "refuted"),
        ("at_least", Found(value=1.0), "confirmed"),
        ("at_least", Found(value=1.5, conclusive=False), "inconclusive"),
    ],
)
def test_a_claimed_bound_and_the_interval_of_what_was_found(
    metric: Metric, found: Found, expected: str
) -> None:
    assert verdict("claim", metric, 1.0, found, None) == expected


def test_a_metric_that_needs_a_reference_says_so() -> None:
    with pytest.raises(ValueError, match="needs a reference"):
        verdict("claim", "validation", 0.1, Found(value=1.0), None)


def test_evidence_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        Found(value=float("nan"))
    with pytest.raises(ValueError, match="finite"):
        Reference(value=1.0, uncertainty=float("inf"))


@pytest.mark.parametrize(
    ("kind", "verdicts", "expected"),
    [
        ("claim", ["confirmed", "confirmed"], "confirmed"),
        ("claim", ["confirmed", "confirmed with correction"], "refuted"),
        ("claim", ["inconclusive", "confirmed with correction"], "inconclusive"),
        ("claim", ["inconclusive", "refuted", "confirmed"], "refuted"),
        ("code_verification", ["passed", "passed"], "passed"),
        ("code_verification", ["passed", "inconclusive"], "inconclusive"),
        ("code_verification", ["inconclusive", "failed"], "failed"),
        ("solution_verification", [], "not run"),
    ],
)
def test_the_deciding_quantity(kind: Kind, verdicts: list[str], expected: str) -> None:
    assert combine(kind=kind, verdicts=[Verdict(word) for word in verdicts]) == expected


def test_a_word_of_another_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="knows no"):
        combine(kind="claim", verdicts=[Verdict.PASSED])


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (Found(value=0.4, corrected=1.0), "confirmed with correction"),
        (Found(value=0.4, corrected=0.9), "refuted"),
        (Found(value=1.2, corrected=0.9), "confirmed"),
    ],
)
def test_a_bound_may_hold_after_a_correction(found: Found, expected: str) -> None:
    assert verdict("claim", "at_least", 1.0, found, None) == expected


@pytest.mark.parametrize(
    ("reach", "expected"),
    [
        ((-0.2, 0.2), "confirmed"),
        ((0.0, 0.5), "inconclusive"),
        ((-0.7, 0.0), "inconclusive"),
    ],
)
def test_an_assumption_may_take_a_confirmation_away(reach: tuple[float, float], expected: str) -> None:
    """It departs by 0.1, and 5 % of ten is 0.5."""
    assert verdict("claim", "validation", 0.05, Found(value=10.1, reach=reach), TEN) == expected


@pytest.mark.parametrize(
    ("reach", "expected"),
    [((-0.5, 5.0), "refuted"), ((-0.9, 0.0), "inconclusive"), ((-20, 0), "inconclusive")],
)
def test_an_assumption_may_take_a_refutation_away(reach: tuple[float, float], expected: str) -> None:
    """It departs by 1.0, beyond 0.2."""
    assert verdict("claim", "validation", 0.05, Found(value=11.0, reach=reach), TEN) == expected


@pytest.mark.parametrize(
    ("verdicts", "roles", "expected"),
    [
        (["confirmed with correction", "confirmed"], ["number", "idea"], "confirmed with correction"),
        (["confirmed with correction", "refuted"], ["number", "idea"], "refuted"),
        (["confirmed with correction", "inconclusive"], ["number", "idea"], "inconclusive"),
        (["confirmed with correction", "confirmed"], ["number", "number"], "refuted"),
        (["refuted", "confirmed"], ["number", "idea"], "refuted"),
        (["refuted", "confirmed"], ["reading", "reading"], "confirmed"),
        (["refuted", "inconclusive"], ["reading", "reading"], "inconclusive"),
        (["refuted", "refuted"], ["reading", "reading"], "refuted"),
        (["refuted", "confirmed", "confirmed"], ["reading", "reading", "idea"], "confirmed"),
        (["confirmed", "confirmed", "refuted"], ["reading", "reading", "idea"], "refuted"),
    ],
)
def test_ideas_numbers_and_readings(verdicts: list[str], roles: list[Role], expected: str) -> None:
    assert combine(kind="claim", verdicts=[Verdict(word) for word in verdicts], roles=roles) == expected
