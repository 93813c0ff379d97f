"""Every branch of the verdict's logic, on numbers made for it."""

from __future__ import annotations

import math

import pytest

from ringbalance.verification.evidence import Found, Reference
from ringbalance.verification.verdicts import Kind, Metric, Role, Verdict, combine, judge_quantity

TEN = Reference(value=10.0, uncertainty=0.1)
CLAIM: tuple[Kind, Metric, float] = ("claim", "validation", 0.05)
"""A comparison wider than 5 % of the reference, 0.5, says nothing."""
WITHIN: tuple[Kind, Metric, float] = ("solution_verification", "within_uncertainty", 0.05)
AT_MOST: tuple[Kind, Metric, float] = ("claim", "at_most", 1.0)
AT_LEAST: tuple[Kind, Metric, float] = ("claim", "at_least", 1.0)


@pytest.mark.parametrize(
    ("criterion", "number", "expected"),
    [
        (CLAIM, Found(value=10.1), "confirmed"),
        (CLAIM, Found(value=10.3), "refuted"),
        (CLAIM, Found(value=10.3, corrected=10.1), "confirmed with correction"),
        (CLAIM, Found(value=10.3, corrected=10.4), "refuted"),
        (CLAIM, Found(value=10.1, corrected=12.0), "confirmed"),
        (CLAIM, Found(value=10.3, input=1.0), "inconclusive"),
        (CLAIM, Found(value=13.0, input=1.0), "refuted"),
        (CLAIM, Found(value=10.3, numerical=0.2), "confirmed"),
        (CLAIM, Found(value=10.1, conclusive=False), "inconclusive"),
        (CLAIM, Found(value=99.0, conclusive=False), "inconclusive"),
        # An assumption may take a confirmation away: it departs by 0.1, and 5 % of ten is 0.5.
        (CLAIM, Found(value=10.1, reach=(-0.2, 0.2)), "confirmed"),
        (CLAIM, Found(value=10.1, reach=(0.0, 0.5)), "inconclusive"),
        (CLAIM, Found(value=10.1, reach=(-0.7, 0.0)), "inconclusive"),
        # And a refutation: it departs by 1.0, beyond 0.2.
        (CLAIM, Found(value=11.0, reach=(-0.5, 5.0)), "refuted"),
        (CLAIM, Found(value=11.0, reach=(-0.9, 0.0)), "inconclusive"),
        (CLAIM, Found(value=11.0, reach=(-20, 0)), "inconclusive"),
        (WITHIN, Found(value=10.1, numerical=0.1), "passed"),
        (WITHIN, Found(value=10.4, numerical=0.1), "failed"),
        (WITHIN, Found(value=10.4, numerical=1.0), "inconclusive"),
        (WITHIN, Found(value=10.4, numerical=0.1, corrected=10.0), "failed"),
        (WITHIN, Found(value=10.1, numerical=0.1, conclusive=False), "inconclusive"),
        (("code_verification", "relative", 0.05), Found(value=10.4), "passed"),
        (("code_verification", "relative", 0.05), Found(value=10.6), "failed"),
        (("code_verification", "relative", 0.05), Found(value=9.6), "passed"),
        (("code_verification", "absolute", 0.05), Found(value=10.04), "passed"),
        (("code_verification", "absolute", 0.05), Found(value=9.9), "failed"),
        (("code_verification", "at_most", 0.05), Found(value=0.05), "passed"),
        (("code_verification", "at_most", 0.05), Found(value=0.051), "failed"),
        (("code_verification", "at_least", 0.05), Found(value=0.05), "passed"),
        (("code_verification", "at_least", 0.05), Found(value=0.049), "failed"),
        (AT_MOST, Found(value=0.5), "confirmed"),
        (AT_MOST, Found(value=1.5), "refuted"),
        (AT_MOST, Found(value=0.5, input=0.1), "confirmed"),
        (AT_MOST, Found(value=0.9, input=0.1), "inconclusive"),
        (AT_MOST, Found(value=1.1, numerical=0.1), "inconclusive"),
        (AT_LEAST, Found(value=1.5, input=0.1), "confirmed"),
        (AT_LEAST, Found(value=0.5, input=0.1), "refuted"),
        (AT_LEAST, Found(value=1.0), "confirmed"),
        (AT_LEAST, Found(value=1.5, conclusive=False), "inconclusive"),
        # A bound may hold after a correction.
        (AT_LEAST, Found(value=0.4, corrected=1.0), "confirmed with correction"),
        (AT_LEAST, Found(value=0.4, corrected=0.9), "refuted"),
        (AT_LEAST, Found(value=1.2, corrected=0.9), "confirmed"),
    ],
)
def test_a_quantity(criterion: tuple[Kind, Metric, float], number: Found, expected: str) -> None:
    kind, metric, limit = criterion
    verdict, _ = judge_quantity(kind=kind, metric=metric, limit=limit, number=number.against(TEN))
    assert verdict == expected


@pytest.mark.parametrize(("uncertainty", "expected"), [(0.02, "confirmed"), (0.03, "inconclusive")])
def test_the_widest_useful_comparison_is_absolute_where_the_reference_is_zero(
    uncertainty: float, expected: str
) -> None:
    number = Found(value=0.01, input=uncertainty).against(0.0)
    assert judge_quantity(kind="claim", metric="validation", limit=0.05, number=number)[0] == expected


def test_what_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="needs a reference"):
        judge_quantity(kind="claim", metric="validation", limit=0.1, number=Found(value=1.0))
    with pytest.raises(ValueError, match="finite"):
        Reference(value=1.0, uncertainty=math.inf)
    with pytest.raises(ValueError, match="knows no"):
        combine(kind="claim", verdicts=[Verdict.PASSED])


@pytest.mark.parametrize(
    ("kind", "verdicts", "roles", "expected"),
    [
        ("claim", ["confirmed", "confirmed"], [], "confirmed"),
        ("claim", ["confirmed", "confirmed with correction"], [], "refuted"),
        ("claim", ["inconclusive", "confirmed with correction"], [], "inconclusive"),
        ("claim", ["inconclusive", "refuted", "confirmed"], [], "refuted"),
        ("code_verification", ["passed", "passed"], [], "passed"),
        ("code_verification", ["passed", "inconclusive"], [], "inconclusive"),
        ("code_verification", ["inconclusive", "failed"], [], "failed"),
        ("solution_verification", [], [], "not run"),
        (
            "claim",
            ["confirmed with correction", "confirmed"],
            ["number", "idea"],
            "confirmed with correction",
        ),
        ("claim", ["confirmed with correction", "refuted"], ["number", "idea"], "refuted"),
        ("claim", ["confirmed with correction", "inconclusive"], ["number", "idea"], "inconclusive"),
        ("claim", ["confirmed with correction", "confirmed"], ["number", "number"], "refuted"),
        ("claim", ["refuted", "confirmed"], ["number", "idea"], "refuted"),
        ("claim", ["refuted", "confirmed"], ["reading", "reading"], "confirmed"),
        ("claim", ["refuted", "inconclusive"], ["reading", "reading"], "inconclusive"),
        ("claim", ["refuted", "refuted"], ["reading", "reading"], "refuted"),
        ("claim", ["refuted", "confirmed", "confirmed"], ["reading", "reading", "idea"], "confirmed"),
        ("claim", ["confirmed", "confirmed", "refuted"], ["reading", "reading", "idea"], "refuted"),
    ],
)
def test_a_case_by_its_quantities(kind: Kind, verdicts: list[str], roles: list[Role], expected: str) -> None:
    assert combine(kind=kind, verdicts=[Verdict(word) for word in verdicts], roles=roles) == expected
