"""SI values come out in the units that the field reads."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.results.numbers import display_unit, shown
from ringbalance.results.numbers import format_given as as_given


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0720, "m", "72 mm"),
        (10e-6, "m", "10 µm"),
        (0.54e6, "Pa", "0.54 MPa"),
        (2339.0, "Pa", "2.339 kPa"),
        (1333e-6, "kg m", "1333 g mm"),
        (67.7e-6, "m^3", "67.7 ml"),
        (10000 * math.pi / 30, "rad/s", "10 000 rpm"),
        (math.pi / 2, "rad", "90°"),
        (0.0108, "m/(kg m)", "0.0108 µm/(g mm)"),
        (0.08e6, "s/m", "0.08 s/µm"),
        (0.25, "1", "0.25"),
        (3.0, "furlong", "3 furlong"),
        (None, "Pa", "–"),
    ],
)
def test_quantities_as_given(value: float | None, unit: str, text: str) -> None:
    assert as_given(value, unit).replace("\u202f", " ") == text


def test_a_half_width_goes_into_brackets_with_the_unit() -> None:
    assert (
        shown(0.5417e6, "Pa", 3.2e3).replace("\u202f", " ").replace("\u00a0", " ") == "(0.5417 ± 0.0032) MPa"
    )
    assert shown(0.07204, "m", 3e-5) == "(72.040\u00a0±\u00a00.030)\u202fmm"
    assert shown(3.5, "1", 0.4) == "3.50\u00a0±\u00a00.40"


@given(value=st.floats(min_value=1e-9, max_value=1e9), unit=st.sampled_from(["m", "Pa", "s", "kg", "m^3"]))
def test_the_unit_does_not_hang_on_the_last_bits(value: float, unit: str) -> None:
    near = [
        display_unit(unit, v).symbol
        for v in (value, math.nextafter(value, 0), math.nextafter(value, math.inf))
    ]
    assert len(set(near)) == 1 or any(
        abs(value / fidelity - 1) < 2e-9 for fidelity in (1e-8, 1e-4, 1e3, 1e5, 0.1, 10.0)
    )
