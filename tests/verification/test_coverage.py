"""The coverage study's own arithmetic, and a small run of it."""

from __future__ import annotations

import numpy as np
import pytest

from ringbalance.verification.cases.finite_elements import _error_ratios, _fared


@pytest.mark.parametrize(
    ("ratios", "expected"),
    [
        ([0.1, 0.3, 0.2], (1.0, 0.2, 3, 0.3)),
        ([0.5, 1.5, 0.7], (2 / 3, 0.7, 3, 1.5)),
        ([np.nan, np.nan], (1.0, 1.0, 0, 0.0)),
        ([np.nan, 4.0], (0.5, 4.0, 1, 4.0)),
    ],
)
def test_shares_and_medians(ratios: list[float], expected: tuple[float, ...]) -> None:
    assert _fared(np.array(ratios)) == pytest.approx(expected)


def test_a_dozen_random_discs() -> None:
    ratios = _error_ratios(12, 1)
    assert np.array_equal(ratios, _error_ratios.__wrapped__(12, 1), equal_nan=True)
    for column in ratios.T:
        fared = _fared(column)
        assert fared.share >= 0.9
        assert fared.tightness > 0.02
