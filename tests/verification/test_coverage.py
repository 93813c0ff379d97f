"""The coverage study's own arithmetic, and a small run of it."""

from __future__ import annotations

import numpy as np

from ringbalance.verification.cases import uncertainties as case


def test_samples_are_the_same_every_time_and_differ_from_one_another() -> None:
    assert case._random_samples(count=5, seed=3) == case._random_samples(count=5, seed=3)
    assert case._random_samples(count=5, seed=3) != case._random_samples(count=5, seed=4)
    assert len({sample.disc for sample in case._random_samples(count=20, seed=0)}) == 20


def test_shares_and_medians() -> None:
    ratios = np.array([[0.1, 0.5, -1.0, 2.0], [0.3, 1.5, -1.0, 3.0], [0.2, 0.7, -1.0, 0.5]])
    found = case._coverage(ratios=ratios)
    assert [found[name].share for name in case._QUANTITIES] == [1.0, 2 / 3, 1.0, 1 / 3]
    assert [found[name].tightness for name in case._QUANTITIES] == [0.2, 0.7, 1.0, 2.0]
    assert [found[name].judged for name in case._QUANTITIES] == [3, 3, 0, 3]


def test_wider_bars_hold_more_and_are_less_tight() -> None:
    ratios = np.full((4, 4), 1.5)
    assert case._coverage(ratios=ratios)["moment"].share == 0.0
    wide = case._coverage(ratios=ratios, width_factor=100.0)["moment"]
    assert wide.share == 1.0
    assert wide.tightness < 0.02


def test_a_dozen_random_discs() -> None:
    found = case._coverage(ratios=case._error_ratios(samples=case._random_samples(count=12, seed=1)))
    for name in case._QUANTITIES:
        assert found[name].share >= 0.9, name
        assert found[name].tightness > 0.02, name
