"""The comparison of V&V 20 by hand-worked numbers, and what it refuses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.verification.evidence import compare, from_rounding

SMALL = st.floats(min_value=0, max_value=1e6)
ANY = st.floats(min_value=-1e6, max_value=1e6)


def test_three_four_twelve_thirteen() -> None:
    found = compare(found=10.0, reference=4.0, numerical=3.0, input_=4.0, reference_uncertainty=12.0)
    assert found.error == 6.0
    assert found.validation_uncertainty == pytest.approx(13.0)
    assert found.half_width == pytest.approx(26.0)
    assert found.consistent


def test_an_error_just_outside_is_seen() -> None:
    assert compare(found=1.0, reference=0.0, numerical=0.5).consistent
    assert not compare(found=1.0, reference=0.0, numerical=0.4999).consistent


def test_round_off_is_no_difference() -> None:
    assert compare(found=0.1 + 0.2, reference=0.3).consistent
    assert not compare(found=1.0 + 1e-13, reference=1.0).consistent


def test_a_printed_number_covers_its_rounding_interval() -> None:
    # Rectangular: standard uncertainty a / sqrt(3) with a half a digit; 67.7 may be 67.65 to 67.75.
    assert from_rounding(0.1) == pytest.approx(0.05 / math.sqrt(3))
    assert compare(found=67.75, reference=67.7, reference_uncertainty=from_rounding(0.1)).consistent
    assert not compare(found=67.77, reference=67.7, reference_uncertainty=from_rounding(0.1)).consistent


@pytest.mark.parametrize(
    "bad", [{"found": math.nan}, {"reference": math.inf}, {"numerical": -1.0}, {"input_": math.nan}]
)
def test_what_is_not_a_number_is_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="finite"):
        compare(**({"found": 1.0, "reference": 1.0} | bad))


@given(ANY, ANY, SMALL, SMALL, SMALL)
def test_more_uncertainty_never_turns_agreement_into_difference(
    found: float, reference: float, numerical: float, input_: float, more: float
) -> None:
    before = compare(found=found, reference=reference, numerical=numerical, input_=input_)
    after = compare(found=found, reference=reference, numerical=numerical, input_=input_ + more)
    assert after.consistent or not before.consistent
