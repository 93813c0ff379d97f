"""Numbers reach prose only through placeholders."""

from __future__ import annotations

import pytest

from ringbalance.verification.case import fill, placeholders


@pytest.mark.parametrize(
    ("text", "value", "expected"),
    [
        ("{x}", 1234.5678, "1235"),
        ("{x:MPa}", 381153.8, "0.3812\u00a0MPa"),
        ("{x:%:.1f}", -0.0711, "\u22127.1\u00a0%"),
        ("{x:%:+.1f}", 0.0711, "+7.1\u00a0%"),
        ("{x:1:d}", 12.0, "12"),
        ("{x:mm:.4f}", 0.034888, "34.8880\u00a0mm"),
        ("{x:rpm:.0f}", 104.71975511965977, "1000\u00a0rpm"),
        ("{x:1:.0e}", 3e-14, "3e-14"),
    ],
)
def test_numbers_in_their_units(text: str, value: float, expected: str) -> None:
    assert fill(text, {"x": value}) == expected


def test_names_are_found_in_order() -> None:
    assert placeholders("a {one:mm} and {two} and {one}") == ("one", "two", "one")


@pytest.mark.parametrize("text", ["{x:furlong}", "{X}", "a { b", "{}", "{x:mm:.1f"])
def test_what_is_no_placeholder_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"placeholder|unit"):
        placeholders(text)


@pytest.mark.parametrize(("numbers", "message"), [({}, "no number"), ({"x": float("nan")}, "finite")])
def test_a_missing_number_is_not_papered_over(numbers: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fill("{x}", numbers)
