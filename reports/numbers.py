"""Numbers as a reader should meet them: no more digits than the uncertainty leaves standing."""

from __future__ import annotations

import math
from decimal import ROUND_HALF_EVEN, Decimal

THIN_SPACE = "\u202f"
MINUS = "\u2212"
PLUS_MINUS = "\u00a0±\u00a0"
MISSING = "–"

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_MOST_DIGITS = 6
_SMALLEST_PLAIN = -4
_LARGEST_PLAIN = 6


def power_of_ten(exponent: int) -> str:
    """Power of ten in plain text, such as 10⁻³."""
    return f"10{str(exponent).translate(_SUPERSCRIPTS)}"


def _leading_exponent(value: Decimal) -> int:
    return value.adjusted() if value else 0


def _plain(value: Decimal, decimals: int) -> str:
    """Fixed-point text with a true minus sign and thin spaces between thousands (from five digits up)."""
    rounded = value.quantize(Decimal(1).scaleb(-decimals), rounding=ROUND_HALF_EVEN)
    whole, _, fraction = f"{abs(rounded):f}".partition(".")
    if decimals < 0:
        whole = f"{int(rounded.copy_abs())}"
    grouped = f"{int(whole):,}".replace(",", THIN_SPACE) if len(whole) > 4 else whole
    sign = MINUS if rounded < 0 else ""
    return f"{sign}{grouped}.{fraction}" if fraction else f"{sign}{grouped}"


def _exact(value: float) -> Decimal:
    if not math.isfinite(value):
        raise ValueError(f"only finite numbers can be shown, not {value}")
    return Decimal(repr(float(value)))


def number(value: float | None, *, digits: int = 4) -> str:
    """A number to a count of significant digits; scientific when it is very large or very small.

    Args: `value`: the number; None where there is none. `digits`: significant digits, at least 1.
    Returns: Text, with a dash for None.
    Raises: ValueError: a value that is not finite.
    """
    if value is None:
        return MISSING
    exact = _exact(value)
    if not exact:
        return "0"
    rounded = exact.quantize(
        Decimal(1).scaleb(_leading_exponent(exact) - digits + 1), rounding=ROUND_HALF_EVEN
    )
    exponent = _leading_exponent(rounded)
    if _SMALLEST_PLAIN < exponent < _LARGEST_PLAIN:
        return _plain(rounded, max(digits - 1 - exponent, 0))
    mantissa = _plain(rounded.scaleb(-exponent), digits - 1)
    return f"{mantissa}{THIN_SPACE}×{THIN_SPACE}{power_of_ten(exponent)}"


def short(value: float | None, *, digits: int = 6) -> str:
    """A number that was set rather than found: no trailing zeros.

    Args: `value`: the number; None where there is none. `digits`: most significant digits.
    Returns: Text, with a dash for None.
    Raises: ValueError: a value that is not finite.
    """
    body, times, power = number(value, digits=digits).partition(f"{THIN_SPACE}×")
    trimmed = body.rstrip("0").rstrip(".") if "." in body else body
    return f"{trimmed}{times}{power}"


def fixed(value: float, decimals: int) -> str:
    """A number to a count of decimals, for a column that shares them.

    Args: `decimals`: at least zero.
    Returns: Text.
    Raises: ValueError: a value that is not finite.
    """
    return _plain(_exact(value), decimals)


def half_width_exponent(half_width: float) -> int:
    """Decimal place to which a half-width is shown: two digits when it begins with 1 or 2, else one.

    Args: `half_width`: positive, finite.
    Returns: Exponent of ten of the last digit shown.
    Raises: ValueError: a half-width that is not positive and finite.
    Source: at most two digits, as the GUM (JCGM 100:2008, 7.2.6) asks.
    """
    if not half_width > 0:
        raise ValueError("a half-width must be positive")
    exact = _exact(half_width)
    leading = _leading_exponent(exact)
    place = leading - 1 if exact.scaleb(-leading) < 3 else leading
    rounded = exact.quantize(Decimal(1).scaleb(place), rounding=ROUND_HALF_EVEN)
    # 0.0297 becomes 0.030 and 0.96 becomes 1.0: the rounded half-width decides.
    leading = _leading_exponent(rounded)
    return leading - 1 if rounded.scaleb(-leading) < 3 else leading


def measured(value: float | None, half_width: float | None, *, digits: int = 4) -> str:
    """Value ± half-width, both to the digits that the half-width leaves standing.

    Args: `value`: the value; None where there is none. `half_width`: at 95 %, in the value's unit; None or
        zero where there is none. `digits`: significant digits of the value when there is no half-width.
    Returns: Text without unit, such as 72.04 ± 0.03 or (1.20 ± 0.05) × 10⁻⁶.
    Raises: ValueError: a value or half-width that is not finite, or a negative half-width.
    """
    if value is None or not half_width:
        return number(value, digits=digits)
    exact, width = _exact(value), _exact(half_width)
    if width < 0:
        raise ValueError("a half-width must not be negative")
    place = half_width_exponent(half_width)
    top = max(_leading_exponent(exact), place)
    if top - place + 1 > _MOST_DIGITS:
        return f"{number(value, digits=_MOST_DIGITS)}{PLUS_MINUS}{number(half_width, digits=1)}"
    if _SMALLEST_PLAIN < top < _LARGEST_PLAIN and place <= 0:
        return f"{_plain(exact, -place)}{PLUS_MINUS}{_plain(width, -place)}"
    if place > 0 and top < _LARGEST_PLAIN:
        return f"{_plain(exact, -place)}{PLUS_MINUS}{_plain(width, -place)}"
    body = f"{_plain(exact.scaleb(-top), top - place)}{PLUS_MINUS}{_plain(width.scaleb(-top), top - place)}"
    return f"({body}){THIN_SPACE}×{THIN_SPACE}{power_of_ten(top)}"


def percent(fraction: float | None, *, digits: int = 2, signed: bool = False) -> str:
    """A fraction as a percentage.

    Args: `fraction`: dimensionless; None where there is none. `digits`: significant digits. `signed`: whether
        a positive one gets its plus sign.
    Returns: Text with the percent sign.
    Raises: ValueError: a fraction that is not finite.
    """
    if fraction is None:
        return MISSING
    sign = "+" if signed and fraction > 0 else ""
    return f"{sign}{number(100 * fraction, digits=digits)}{THIN_SPACE}%"


def with_unit(text: str, unit: str) -> str:
    """A number's text with its unit, which never breaks onto the next line.

    Args: `unit`: as it is shown; empty or "1" where there is none.
    """
    return text if unit in {"", "1"} or text == MISSING else f"{text}{THIN_SPACE}{unit}"
