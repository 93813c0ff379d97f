"""Orders of sequences whose order is known."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.verification.evidence import Convergence


@given(st.floats(0.5, 5), st.floats(1e-6, 1), st.floats(1.2, 3))
def test_a_power_is_recovered(order: float, scale: float, ratio: float) -> None:
    size = [ratio**-k for k in range(4)]
    study = Convergence.of_errors("error", 1.0, size=size, error=[scale * h**order for h in size])
    assert study.observed_order == pytest.approx([order] * 3)
    assert study.finest_error == pytest.approx(scale * size[-1] ** order)


def test_the_lowest_of_the_two_finest_pairs_counts() -> None:
    study = Convergence.of_errors("error", 1.0, size=[8, 4, 2, 1], error=[1.0, 0.5, 0.125, 0.0625])
    assert study.observed_order == pytest.approx([1, 2, 1])
    assert study.settled_order == pytest.approx(1)


@pytest.mark.parametrize(
    ("size", "error"),
    [
        ([1.0], [1.0]),
        ([1.0, 0.5], [1.0]),
        ([1.0, 1.0], [1.0, 0.5]),
        ([0.5, 1.0], [1.0, 0.5]),
        ([1.0, 0.5], [1.0, 0.0]),
        ([1.0, 0.5], [1.0, 1e-16]),
        ([1.0, 0.5], [1.0, float("nan")]),
    ],
)
def test_sequences_that_show_no_order_are_refused(size: list[float], error: list[float]) -> None:
    with pytest.raises(ValueError, match=r"levels|sizes|errors"):
        Convergence.of_errors("error", 1.0, size=size, error=error)
