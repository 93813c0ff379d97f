"""Grid convergence: sequences whose limit is known, and those with no order; a case has published ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.physics.convergence import GridVerdict, gci


def sequence(order: float, sizes: tuple[float, ...], scale: float = 0.1) -> list[float]:
    return [1.0 + scale * h**order for h in sizes]


@pytest.mark.parametrize("sizes", [(1.0, 2.0, 4.0), (1.0, 1.3, 2.1), (0.5, 0.9, 1.1)])
@pytest.mark.parametrize("order", [1.0, 1.7, 4.0])
def test_a_pure_power_gives_its_order_and_limit(order: float, sizes: tuple[float, ...]) -> None:
    found = gci(values=sequence(order, sizes), sizes=sizes, formal_order=order)
    assert found.observed_order == pytest.approx(order, rel=1e-8)
    assert found.extrapolated == pytest.approx(1.0, abs=1e-12)
    assert found.verdict is GridVerdict.MONOTONE
    assert found.uncertainty == pytest.approx(1.25 * 0.1 * sizes[0] ** order, rel=1e-8)


def test_fixed_point_solves_celiks_equation() -> None:
    p = gci(values=(1.0, 1.02, 1.13), sizes=(1.0, 1.4, 1.4 * 1.9), formal_order=4.0).observed_order
    q = np.log((1.4**p - 1) / (1.9**p - 1))
    assert p == pytest.approx(abs(np.log(0.11 / 0.02) + q) / np.log(1.4), rel=1e-10)


def test_the_order_is_capped_at_the_formal_one_of_the_quantity() -> None:
    """Leading errors that cancel look like a high order; the half-width must not shrink with it."""
    sizes = (1.0, 2.0, 4.0)
    found = gci(values=sequence(6.0, sizes, 1e-3), sizes=sizes, formal_order=4.0)
    assert found.observed_order == pytest.approx(6.0, rel=1e-6)
    assert found.order == 4.0
    change = 1e-3 * (2**6 - 1)
    assert found.uncertainty >= 1.25 * change / 15


@pytest.mark.parametrize("ratio", [4.0, 4.2, 5.0, 20.0])
def test_a_crossing_of_two_error_terms_stays_covered(ratio: float) -> None:
    """c h^4 - h^6: at c = 4.2 the two finest values agree by accident."""
    values = [1.0 + ratio * h**4 - h**6 for h in (1.0, 2.0, 4.0)]
    found = gci(values=values, sizes=(1.0, 2.0, 4.0), formal_order=4.0)
    assert abs(values[0] - 1.0) <= found.uncertainty


def test_round_off_is_said_and_gets_no_index() -> None:
    found = gci(values=(1.0, 1.0 + 1e-13, 1.0 + 1e-12), sizes=(1, 2, 4), formal_order=2.0, round_off=1e-12)
    assert found.verdict is GridVerdict.ROUND_OFF
    assert found.index == 0.0
    assert found.uncertainty >= 1e-12
    assert "round-off" in found.text


@pytest.mark.parametrize(("change", "noise"), [(3e-4, True), (4e-4, False)])
def test_a_change_is_round_off_where_the_coarser_pair_promises_no_more(change: float, noise: bool) -> None:
    """No change between the finer two, and change/(4^2 - 1)/1.5^2 foretold: 8.9 and 11.9 times the noise."""
    found = gci(values=(1.0, 1.0, 1.0 + change), sizes=(1, 1.5, 6), formal_order=2.0, round_off=1e-6)
    assert (found.verdict is GridVerdict.ROUND_OFF) == noise


def test_a_diverging_half_width_holds_the_noise() -> None:
    """No change between the coarser two: three times the last change, and the noise in a value beside it."""
    found = gci(values=(1.0, 1.1, 1.1), sizes=(1, 2, 4), formal_order=2.0, round_off=0.05)
    assert found.verdict is GridVerdict.DIVERGING
    assert found.uncertainty == pytest.approx(3 * 0.1 + 0.05, rel=1e-9)


def test_equal_values_are_round_off_and_not_an_error() -> None:
    for value in (0.0, 3.7):
        found = gci(values=(value,) * 3, sizes=(1, 2, 4), formal_order=2.0)
        assert found.verdict is GridVerdict.ROUND_OFF
        assert found.uncertainty >= 0


def test_oscillation_is_said_and_covers_half_the_range() -> None:
    found = gci(values=(1.0, 1.1, 0.7), sizes=(1, 2, 4), formal_order=2.0)
    assert found.verdict is GridVerdict.OSCILLATORY
    assert found.uncertainty >= 0.2
    assert "oscillates" in found.text


@pytest.mark.parametrize("values", [(1.0, 1.2, 1.3), (1.0, 0.9, 0.95), (1.0, 1.1, 1.1)])
def test_growing_changes_are_called_diverging(values: tuple[float, ...]) -> None:
    found = gci(values=values, sizes=(1, 2, 4), formal_order=2.0)
    assert found.verdict is GridVerdict.DIVERGING
    assert found.uncertainty >= 3 * abs(values[1] - values[0])
    assert found.observed_order <= 0


@pytest.mark.parametrize(
    ("values", "sizes"),
    [
        ((1.0, 2.0), (1, 2)),
        ((1.0, 2.0, 3.0), (1, 2)),
        ((1.0, 2.0, 3.0), (4, 2, 1)),
        ((1.0, 2.0, 3.0), (1, 1, 2)),
        ((1.0, np.nan, 3.0), (1, 2, 4)),
        ((1.0, 2.0, np.inf), (1, 2, 4)),
    ],
)
def test_impossible_sequences_are_refused(values: tuple[float, ...], sizes: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"values and sizes|sizes must"):
        gci(values=values, sizes=sizes, formal_order=2.0)


@given(
    changes=st.tuples(*[st.floats(-1e3, 1e3, allow_subnormal=False)] * 2),
    start=st.floats(-1e3, 1e3),
    ratios=st.tuples(st.floats(1.05, 4.0), st.floats(1.05, 4.0)),
)
def test_every_finite_sequence_gets_a_finite_answer(
    changes: tuple[float, float], start: float, ratios: tuple[float, float]
) -> None:
    values = (start, start + changes[0], start + changes[0] + changes[1])
    sizes = (1.0, ratios[0], ratios[0] * ratios[1])
    found = gci(values=values, sizes=sizes, formal_order=2.0)
    numbers = (found.observed_order, found.extrapolated, found.index, found.uncertainty)
    assert np.all(np.isfinite(numbers))
    assert found.uncertainty >= 0


@given(scale=st.floats(1e-9, 1e9), order=st.floats(0.6, 3.9))
def test_scaling_the_number_scales_the_half_width(scale: float, order: float) -> None:
    sizes = (1.0, 2.0, 4.0)
    plain = gci(values=sequence(order, sizes), sizes=sizes, formal_order=4.0)
    scaled = gci(values=[scale * v for v in sequence(order, sizes)], sizes=sizes, formal_order=4.0)
    assert scaled.uncertainty == pytest.approx(scale * plain.uncertainty, rel=1e-9)
    assert scaled.verdict is plain.verdict
