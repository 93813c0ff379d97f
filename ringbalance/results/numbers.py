"""Numbers and quantities as text: from SI to the units that engineers of this field read, with no more digits
than the uncertainty supports.

Texts are typographic (thin spaces, a true minus sign, µm); `plain` writes them for a terminal or a CSV file.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Final

THIN_SPACE: Final = "\u202f"
MINUS: Final = "\u2212"
PLUS_MINUS: Final = "\u00a0±\u00a0"
MISSING: Final = "–"

SUPERSCRIPTS: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_MAX_DIGITS: Final = 7
_TABLE_DIGITS: Final = 9
_UNSTATED_DIGITS: Final = 4
_INPUT_ROUNDING: Final = 5e-4
"""Relative half-width of an input of three digits, the fewest that scene files have."""
_ROUND_OFF: Final = 1e-6
"""Relative half-width up to which it is round-off, or that of a closed form of exact inputs."""
_LOPSIDED_FRACTION: Final = 0.1
"""Difference of the two sides of an interval, over the larger, from which both are printed."""
_TYPEWRITER: Final = str.maketrans({"\u202f": " ", "\u00a0": " ", "\u2212": "-", "µ": "u"})
_POWER: Final = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
_TYPED_POWER: Final = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_MIN_PLAIN_EXPONENT: Final = -4
_MAX_PLAIN_EXPONENT: Final = 6


def power_of_ten(exponent: int) -> str:
    """Power of ten in plain text, such as 10⁻³."""
    return f"10{str(exponent).translate(SUPERSCRIPTS)}"


def last_place(total: float) -> int:
    """Decimal exponent of the second digit of a total uncertainty, the last digit printed of its value.

    Source: at most two digits, as the GUM (JCGM 100:2008, 7.2.6) asks.
    Raises: ValueError: an uncertainty that is not positive.
    """
    if not total > 0:
        raise ValueError("an uncertainty must be positive")
    width = Decimal(repr(float(total)))
    # Rounded twice: 0.0996 becomes 0.10, whose second digit has another exponent.
    return width.quantize(Decimal(1).scaleb(width.adjusted() - 1)).adjusted() - 1


def believed(value: float | None, total: float | None, *, stated: bool) -> float | None:
    """A value's total uncertainty; None without a value, for round-off, and below the rounding of inputs
    whose uncertainty is not stated.

    Args: `stated`: True if the scene states the uncertainty of any input.
    """
    if value is None or total is None:
        return None
    fine = 0.0 < total <= (_ROUND_OFF if stated else _INPUT_ROUNDING) * abs(value)
    return None if fine else total


def rounded(value: float, total: float | None) -> str:
    """A value, or its uncertainty, to the place of the second digit of the total uncertainty.

    The value has at most nine significant digits, nine where the uncertainty is zero, and four where it is
    None (see `believed`); an exact zero is 0.
    """
    if total is None:
        total = 10.0 ** (Decimal(f"{value:.{_UNSTATED_DIGITS - 1}e}").adjusted() + 2 - _UNSTATED_DIGITS)
    if not total > 0 or value == 0:
        return f"{value + 0.0:.{_TABLE_DIGITS}g}"
    exact = Decimal(repr(float(value)))
    exponent = max(last_place(total), exact.adjusted() - _TABLE_DIGITS + 1)
    shown = exact.quantize(Decimal(1).scaleb(exponent), rounding=ROUND_HALF_EVEN)
    plain = shown if shown else abs(shown)
    return f"{plain:f}" if exponent > -_TABLE_DIGITS else f"{plain:e}"


def _leading_exponent(value: Decimal) -> int:
    return value.adjusted() if value else 0


def _quantized(value: Decimal, exponent: int) -> Decimal:
    return value.quantize(Decimal(1).scaleb(exponent), rounding=ROUND_HALF_EVEN)


def _plain(value: Decimal, decimals: int) -> str:
    """Fixed-point text with a true minus sign and thin spaces between thousands (from five digits up)."""
    rounded = _quantized(value, -decimals)
    integer, _, fraction = f"{abs(rounded):f}".partition(".")
    grouped = f"{int(integer):,}".replace(",", THIN_SPACE) if len(integer) > 4 else integer
    sign = MINUS if rounded < 0 else ""
    return f"{sign}{grouped}.{fraction}" if fraction else f"{sign}{grouped}"


def _exact(value: float) -> Decimal:
    if not math.isfinite(value):
        raise ValueError(f"only finite numbers can be shown, not {value}")
    return Decimal(repr(float(value)))


def number(value: float | None, *, digits: int = 4) -> str:
    """A number with `digits` significant digits, in scientific notation when very large or very small.

    Raises: ValueError: a value that is not finite.
    """
    if value is None:
        return MISSING
    exact = _exact(value)
    if not exact:
        return "0"
    rounded = _quantized(exact, _leading_exponent(exact) - digits + 1)
    exponent = _leading_exponent(rounded)
    if _MIN_PLAIN_EXPONENT < exponent < _MAX_PLAIN_EXPONENT:
        return _plain(rounded, max(digits - 1 - exponent, 0))
    mantissa = _plain(rounded.scaleb(-exponent), digits - 1)
    return f"{mantissa}{THIN_SPACE}×{THIN_SPACE}{power_of_ten(exponent)}"


def short(value: float | None, *, digits: int = 6) -> str:
    """A prescribed number with at most `digits` significant digits and no trailing zeros.

    Raises: ValueError: a value that is not finite.
    """
    body, times, power = number(value, digits=digits).partition(f"{THIN_SPACE}×")
    trimmed = body.rstrip("0").rstrip(".") if "." in body else body
    return f"{trimmed}{times}{power}"


def fixed(value: float, decimals: int) -> str:
    """A number with a given count of decimals, for a column in which all numbers have as many.

    Raises: ValueError: a value that is not finite.
    """
    return _plain(_exact(value), decimals)


Width = float | tuple[float, float] | None
"""Expanded uncertainty (95 %) in the value's unit, one or (below, above); None or zero: no uncertainty."""


def measured(value: float | None, width: Width, *, digits: int = 4) -> str:
    """Value with its uncertainty, without unit: 72.043 ± 0.032, (1.20 ± 0.05) × 10⁻⁶ or 0.419 −0.003/+0.012.

    Decimals are those that the (larger) uncertainty supports; without one the value has `digits`. One side of
    the uncertainty may be infinite.
    Raises: ValueError: a value or a symmetric uncertainty that is not finite, or a negative uncertainty.
    """
    below, above = width if isinstance(width, tuple) else (float(_exact(width or 0.0)),) * 2
    if min(below, above) < 0:
        raise ValueError("an uncertainty must not be negative")
    ends = [side for side in (below, above) if math.isfinite(side)]
    widest = max(ends, default=0.0)
    if value is None or not widest:
        return number(value, digits=digits)
    exact, exponent = _exact(value), last_place(widest)
    top = max(_leading_exponent(exact), exponent)
    if top - exponent + 1 > _MAX_DIGITS:
        return f"{number(value, digits=_MAX_DIGITS)}{PLUS_MINUS}{number(widest, digits=2)}"
    plain_power = top < _MAX_PLAIN_EXPONENT and (exponent > 0 or top > _MIN_PLAIN_EXPONENT)
    power, decimals = (0, -exponent) if plain_power else (top, top - exponent)

    def text(part: float) -> str:
        return _plain(_exact(part).scaleb(-power), decimals) if math.isfinite(part) else "∞"

    if len(ends) == 2 and abs(above - below) <= _LOPSIDED_FRACTION * widest:
        body = f"{text(value)}{PLUS_MINUS}{text(widest)}"
    else:
        body = f"{text(value)}\u00a0{MINUS}{text(below)}/+{text(above)}"
    return body if plain_power else f"({body}){THIN_SPACE}×{THIN_SPACE}{power_of_ten(power)}"


def percent(fraction: float | None, *, digits: int = 2, signed: bool = False) -> str:
    """A fraction as a percentage with `digits` significant digits.

    Raises: ValueError: a fraction that is not finite.
    """
    if fraction is None:
        return MISSING
    sign = "+" if signed and fraction > 0 else ""
    return f"{sign}{number(100 * fraction, digits=digits)}{THIN_SPACE}%"


def with_unit(text: str, unit: str) -> str:
    """A number's text with its unit, which never breaks onto the next line."""
    if unit in {"", "1"} or text == MISSING:
        return text
    return f"{text}{'' if unit == '°' else THIN_SPACE}{unit}"


@dataclass(frozen=True, kw_only=True)
class _DisplayUnit:
    """Unit of display: shown value = SI value * factor."""

    symbol: str
    factor: float
    start: float = 0.0
    """Smallest magnitude, SI, that is shown in this unit."""


_Scale = tuple[str, float] | tuple[str, float, float]
SCALES: Final[dict[str, tuple[_Scale, ...]]] = {
    "m": (("nm", 1e9), ("µm", 1e6, 1e-8), ("mm", 1e3, 1e-4)),
    "Pa": (("Pa", 1.0), ("kPa", 1e-3, 1e3), ("MPa", 1e-6, 1e5)),
    "s": (("ms", 1e3), ("s", 1.0, 0.1), ("h", 1 / 3600, 7200.0)),
    "kg": (("g", 1e3), ("kg", 1.0, 10.0)),
    "m^3": (("ml", 1e6), ("l", 1e3, 1e-3)),
    "m^2": (("mm²", 1e6),),
    "kg m": (("g\u202fmm", 1e6), ("kg\u202fm", 1.0, 0.01)),
    "m/(kg m)": (("µm/(g\u202fmm)", 1.0),),
    "s/m": (("s/µm", 1e-6),),
    "rad": (("°", 180 / math.pi),),
    "rad/s": (("rpm", 30 / math.pi),),
    "m/s": (("mm/s", 1e3), ("m/s", 1.0, 0.1)),
    "kg/m^3": (("kg/m³", 1.0),),
    "m^2/s": (("mm²/s", 1e6),),
    "m/s^2": (("m/s²", 1.0),),
    "m^3/(s Pa)": (("l/(s\u202fbar)", 1e8),),
    "kg/m^2": (("kg/m²", 1.0),),
    "N m": (("N\u202fm", 1.0),),
    "1": (("", 1.0),),
}
"""By SI unit: symbol, factor, and the smallest magnitude (SI) from which the symbol is used."""


def display_unit(unit: str, *values: float | None) -> _DisplayUnit:
    """Unit that suits the largest of some SI values; the SI unit for zero and without a known value."""
    scales = SCALES.get(unit, ((unit, 1.0),))
    units = [_DisplayUnit(symbol=s, factor=f, start=start[0] if start else 0.0) for s, f, *start in scales]
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    # 0.1 MPa may be 99 999.999 999 Pa after rounding: the last bits must not decide the unit.
    fitting = [display for display in units if display.start <= largest * (1 + 1e-9)]
    if not largest and len(units) > 1:
        return _DisplayUnit(symbol=unit.replace("^3", "³").replace(" ", THIN_SPACE), factor=1.0)
    return fitting[-1]


def shown(value: float | None, unit: str, width: Width = None, *, digits: int = 4) -> str:
    """An SI quantity in the unit that suits its size, with its uncertainty, such as (72.043 ± 0.032) mm.

    Args: `width`: 95 %, in `unit`; without one the value has `digits` significant digits.
    Raises: ValueError: a value that is not finite.
    """
    sides = width if isinstance(width, tuple) else (width or 0.0, width or 0.0)
    # A value below its uncertainty is shown in the unit of the uncertainty.
    display = display_unit(unit, value, *(side for side in sides if math.isfinite(side)))
    if value is None:
        return MISSING
    below, above = (side * display.factor for side in sides)
    text = measured(value * display.factor, (below, above), digits=digits)
    wants_brackets = ("±" in text or "/+" in text) and bool(display.symbol) and not text.startswith("(")
    return with_unit(f"({text})" if wants_brackets else text, display.symbol)


def format_given(value: float | None, unit: str, *, digits: int = 6) -> str:
    """A prescribed SI quantity without trailing zeros, such as 0.7 MPa or 0.25.

    Raises: ValueError: a value that is not finite.
    """
    display = display_unit(unit, value)
    return with_unit(short(None if value is None else value * display.factor, digits=digits), display.symbol)


def plain(text: str) -> str:
    """A text in keyboard characters: "-" for the minus sign, um for µm, 10^-3 for 10⁻³, one kind of space."""
    powers = _POWER.sub(lambda power: "^" + power[0].translate(_TYPED_POWER), text)
    return powers.translate(_TYPEWRITER)
