"""Curves for figures: few points, ends and peaks kept."""

from __future__ import annotations

import numpy as np

from ringbalance.verification.papers import envelope, thinned


def test_a_thinned_curve_keeps_its_ends_and_its_order() -> None:
    values = np.linspace(3.0, 7.0, 10_001)
    few = thinned(values)
    assert few.size == 240
    assert (few[0], few[-1]) == (3.0, 7.0)
    assert np.all(np.diff(few) > 0)
    assert np.array_equal(thinned(values[:7]), values[:7])


def test_an_envelope_keeps_every_peak_at_the_place_of_its_stretch() -> None:
    values = np.zeros(10_001)
    values[[1234, 7777]] = 2.0, 5.0
    high = envelope(values)
    assert high.size == thinned(values).size
    assert np.flatnonzero(high).tolist() == [1234 * 239 // 10_000, 7777 * 239 // 10_000]
    assert high.max() == 5.0
