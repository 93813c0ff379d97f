"""Numbers keep the digits that their uncertainty leaves standing, and no others."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ringbalance.results.numbers import (
    believed,
    fixed,
    last_place,
    measured,
    number,
    percent,
    plain,
    rounded,
    short,
    shown,
)

VALUES = st.floats(min_value=-1e12, max_value=1e12, allow_nan=False, allow_subnormal=False)
WIDTHS = st.floats(min_value=1e-12, max_value=1e9, allow_nan=False)
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def parsed(text: str) -> Decimal:
    """A number's text read back."""
    plain = text.replace("\u202f", "").replace("−", "-")
    mantissa, _, power = plain.partition("×10")
    return Decimal(mantissa).scaleb(int(power.translate(SUPERSCRIPTS)) if power else 0)


def read(text: str) -> tuple[Decimal, Decimal]:
    """Value and half-width of a text such as (1.200 ± 0.050) × 10⁻⁶."""
    power = "0"
    if text.startswith("("):
        text, _, power = text[1:].partition(")")
        power = power.partition("10")[2].translate(SUPERSCRIPTS)
    value, _, width = text.partition("±")
    return tuple(parsed(part.strip("\u00a0")).scaleb(int(power)) for part in (value, width))  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("value", "half_width", "text"),
    [
        (72.0432, 0.0324, "72.043 ± 0.032"),
        (49.83, 6.2, "49.8 ± 6.2"),
        (0.53712, 0.00097, "0.53712 ± 0.00097"),
        (-12.5, 0.96, "−12.50 ± 0.96"),
        (5.0, 30.0, "5 ± 30"),
        (0.0, 0.3, "0.00 ± 0.30"),
        (1.2e-6, 5e-8, "(1.200 ± 0.050) × 10⁻⁶"),
        (123456.0, 400.0, "123 460 ± 400"),
        # GUM (JCGM 100:2008), 7.2.2: y = 10.057 62 ohm with u = 27 mohm becomes 10.058 ohm and 27 mohm.
        (10.05762, 0.027, "10.058 ± 0.027"),
    ],
)
def test_the_half_width_decides_the_digits(value: float, half_width: float, text: str) -> None:
    shown = measured(value, half_width)
    assert shown.replace("\u202f", " ").replace("\u00a0", " ") == text


@given(value=VALUES, half_width=WIDTHS)
@example(value=1000.0, half_width=0.0742)
@example(value=1000.0, half_width=0.00742)
def test_rounding_stays_well_inside_the_half_width(value: float, half_width: float) -> None:
    shown, width = read(measured(value, half_width))
    slack = Decimal(10) ** last_place(half_width) / 2 + abs(Decimal(value)) * Decimal("6e-6")
    assert abs(shown - Decimal(value)) <= slack
    assert abs(width - Decimal(half_width)) <= Decimal("0.051") * Decimal(half_width)


@given(value=VALUES, half_width=st.floats(min_value=1e-6, max_value=1e6))
def test_value_and_half_width_share_their_last_digit(value: float, half_width: float) -> None:
    left, sign, right = measured(value, half_width).lstrip("(").partition("±")
    right = right.partition(")")[0]
    if sign and "×" not in left + right:
        decimals = [len(part.strip("\u00a0").partition(".")[2]) for part in (left, right)]
        assert decimals[0] == decimals[1] or half_width < 1e-5 * abs(value)


@given(value=VALUES, digits=st.integers(min_value=1, max_value=8))
def test_a_bare_number_keeps_its_significant_digits(value: float, digits: int) -> None:
    shown = parsed(number(value, digits=digits))
    assert abs(shown - Decimal(value)) <= abs(Decimal(value)) * Decimal(5) * Decimal(10) ** -digits


@given(value=VALUES)
def test_a_short_number_is_the_number(value: float) -> None:
    assert parsed(short(value)) == parsed(number(value, digits=6))
    assert not (
        "." in short(value).partition("\u202f×")[0] and short(value).partition("\u202f×")[0].endswith("0")
    )


def test_signs_groups_and_gaps() -> None:
    assert number(-1234567.0, digits=7) == "−1.234567\u202f×\u202f10⁶"
    assert fixed(-12345.678, 1) == "−12\u202f345.7"
    assert number(1234.0) == "1234"
    assert number(0.0) == "0"
    assert number(None) == "–"
    assert measured(None, 0.1) == "–"
    assert measured(0.25, None) == "0.2500"
    assert percent(0.0123, signed=True) == "+1.2\u202f%"
    assert short(0.25) == "0.25"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="only finite numbers"):
        number(bad)
    for value, uncertainty in ((bad, 0.1), (1.0, bad)):
        with pytest.raises(ValueError, match="only finite numbers"):
            measured(value, uncertainty)


def test_a_negative_half_width_is_refused() -> None:
    with pytest.raises(ValueError, match="negative"):
        measured(1.0, -0.1)
    with pytest.raises(ValueError, match="positive"):
        last_place(0.0)


@pytest.mark.parametrize(
    ("value", "total", "text"),
    [
        (73.36127, 0.1312, "73.36"),
        (0.1312, 0.1312, "0.13"),
        (418386.9, 4312.0, "418400"),
        (17.0, 0.0996, "17.00"),
        (0.0996, 0.0996, "0.10"),
        (-0.04, 1.2, "0.0"),
        (-152.2, 57.0, "-152"),
        (3.25, 0.995, "3.2"),
        (1.5, 0.0, "1.5"),
        (67.687660543367, 6.8e-11, "67.6876605"),
        (6.8e-11, 6.8e-11, "6.8e-11"),
    ],
)
def test_a_value_is_printed_to_two_digits_of_its_total(value: float, total: float, text: str) -> None:
    assert rounded(value, total) == text


@pytest.mark.parametrize(
    ("value", "total", "stated", "text"),
    [
        (75.3982237, 7.5e-11, True, "75.40"),
        (75.3982237, 7.6e-5, True, "75.39822 ± 7.6 × 10^-5"),
        (10.75625, 5.7e-14, True, "10.76"),
        (75.3982237, 7.5e-11, False, "75.40"),
        (99.5917, 0.0047, False, "99.59"),
        (99.5917, 0.051, False, "99.592 ± 0.051"),
        (-99.996, 0.0047, False, "-100.0"),
        (0.0, 0.0, False, "0"),
    ],
)
def test_round_off_and_an_interval_finer_than_unstated_inputs_leave_four_digits(
    value: float, total: float, stated: bool, text: str
) -> None:
    assert plain(measured(value, believed(value, total, stated=stated))) == text


@pytest.mark.parametrize(
    ("value", "sides", "text"),
    [
        (418.4e3, (6.4e3, 6.3e3), "(0.4184 ± 0.0064) MPa"),
        (418.4e3, (3e3, 12e3), "(0.418 -0.003/+0.012) MPa"),
        (418.4e3, (0.0, 12e3), "(0.418 -0.000/+0.012) MPa"),
        (418.4e3, (3e3, math.inf), "(0.4184 -0.0030/+∞) MPa"),
        (0.0, (0.0, 1.5e-6), "(0.0 -0.0/+1.5) um"),
        (418.4e3, (0.0, 0.0), "0.4184 MPa"),
    ],
)
def test_a_lopsided_interval_is_printed_as_one(value: float, sides: tuple[float, float], text: str) -> None:
    unit = "m" if value == 0 else "Pa"
    assert plain(shown(value, unit, sides)) == text


@pytest.mark.parametrize(("text", "typed"), [("3 × 10⁻¹³ m³", "3 × 10^-13 m^3"), ("−2 µm²", "-2 um^2")])
def test_powers_are_typed_whole(text: str, typed: str) -> None:
    assert plain(text) == typed
