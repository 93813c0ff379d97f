"""The comparison of V&V 20 by hand-worked numbers, and what it refuses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.verification.evidence import Deviation, Found, Reference, printed

SMALL = st.floats(min_value=0, max_value=1e6)
ANY = st.floats(min_value=-1e6, max_value=1e6)


def compare(number: Found, reference: float, uncertainty: float = 0.0) -> Deviation:
    return number.compared(Reference(value=reference, uncertainty=uncertainty))


def test_three_four_twelve_thirteen() -> None:
    number = compare(Found(value=10.0, numerical=3.0, input=4.0), 4.0, 12.0)
    assert number.error == 6.0
    assert number.half_width == pytest.approx(26.0)
    assert number.consistent


def test_an_error_just_outside_is_seen() -> None:
    assert compare(Found(value=1.0, numerical=0.5), 0.0).consistent
    assert not compare(Found(value=1.0, numerical=0.4999), 0.0).consistent


def test_round_off_is_no_difference() -> None:
    assert compare(Found(value=0.1 + 0.2), 0.3).consistent
    assert not compare(Found(value=1.0 + 1e-13), 1.0).consistent


def test_a_printed_number_covers_its_rounding_interval() -> None:
    # Rectangular: standard uncertainty a / sqrt(3) with half a digit; 67.7 may be 67.65 to 67.75.
    reference = printed(67.7, last_digit=0.1)
    assert reference.uncertainty == pytest.approx(0.05 / math.sqrt(3))
    assert Found(value=67.75).compared(reference).consistent
    assert not Found(value=67.77).compared(reference).consistent


@pytest.mark.parametrize(
    ("value", "numerical", "input_"),
    [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (1.0, -1.0, 0.0), (1.0, 0.0, math.nan)],
)
def test_what_is_not_a_number_is_refused(value: float, numerical: float, input_: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Found(value=value, numerical=numerical, input=input_)


@given(ANY, ANY, SMALL, SMALL, SMALL)
def test_more_uncertainty_never_turns_agreement_into_difference(
    number: float, reference: float, numerical: float, input_: float, more: float
) -> None:
    before = compare(Found(value=number, numerical=numerical, input=input_), reference)
    after = compare(Found(value=number, numerical=numerical, input=input_ + more), reference)
    assert after.consistent or not before.consistent
