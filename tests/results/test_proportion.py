"""Fractions of drawn devices against published bounds and their own definition."""

from __future__ import annotations

import math

import pytest

from ringbalance.results.requirements import MET, MISSED, OPEN, Proportion


def test_wilsons_bounds() -> None:
    # Newcombe, "Two-sided confidence intervals for the single proportion", Statistics in Medicine 17 (1998),
    # Table I, method 3.
    for count, of, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        found = Proportion(count=count, of=of)
        assert (found.low, found.high) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(
    ("count", "of", "verdict"),
    [(64, 64, MET), (97, 100, MET), (92, 100, OPEN), (80, 100, MISSED), (0, 0, OPEN)],
)
def test_the_verdict_is_by_the_bounds(count: int, of: int, verdict: str) -> None:
    assert Proportion(count=count, of=of).verdict(0.9) == verdict


def test_nothing_drawn_says_nothing() -> None:
    nothing = Proportion(count=0, of=0)
    assert math.isnan(nothing.value)
    assert (nothing.low, nothing.high) == (0.0, 1.0)
