"""Fractions of drawn devices against published bounds and their own definition."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringbalance.results.requirements import MET, MISSED, OPEN, Paired, Proportion


def test_wilsons_bounds() -> None:
    # Newcombe, "Two-sided confidence intervals for the single proportion", Statistics in Medicine 17 (1998),
    # Table I, method 3.
    for count, of, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        result = Proportion(count=count, of=of)
        assert (result.low, result.high) == pytest.approx((low, high), abs=5e-5)


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


def test_a_wider_interval_decides_later() -> None:
    share = Proportion(count=240, of=256)
    assert (share.verdict(0.9), share.verdict(0.9, deviations=3.0)) == (MET, OPEN)
    assert Proportion(count=250, of=256).verdict(0.9, deviations=3.0) == MET


def test_a_difference_of_paired_fractions() -> None:
    """Against the spread of many drawn pairs."""
    random = np.random.default_rng(1)
    result = []
    for _ in range(400):
        base, other = random.random((2, 256))
        first, second = (base < 0.9) & (other < 0.98), base < 0.9
        result.append(Paired.of(first, second).difference)
    changes, halves = np.array(result).T
    assert np.mean(changes) == pytest.approx(-0.9 * 0.02, abs=2e-3)
    assert 1.96 * np.std(changes) == pytest.approx(np.mean(halves), rel=0.1)
