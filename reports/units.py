"""SI on the way in, the units that engineers of this field read on the way out."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ringbalance.reports.numbers import measured, number, short, with_unit


@dataclass(frozen=True, kw_only=True)
class DisplayUnit:
    """A unit that values are shown in: shown value = SI value * factor."""

    symbol: str
    factor: float
    start: float = 0.0
    """Smallest magnitude, SI, from which this unit is the one to show."""


_DISPLAY_UNITS: dict[str, tuple[DisplayUnit, ...]] = {
    "m": (
        DisplayUnit(symbol="nm", factor=1e9),
        DisplayUnit(symbol="µm", factor=1e6, start=1e-8),
        DisplayUnit(symbol="mm", factor=1e3, start=1e-4),
    ),
    "Pa": (
        DisplayUnit(symbol="Pa", factor=1.0),
        DisplayUnit(symbol="kPa", factor=1e-3, start=1e3),
        DisplayUnit(symbol="MPa", factor=1e-6, start=1e5),
    ),
    "s": (DisplayUnit(symbol="ms", factor=1e3), DisplayUnit(symbol="s", factor=1.0, start=0.1)),
    "kg": (DisplayUnit(symbol="g", factor=1e3), DisplayUnit(symbol="kg", factor=1.0, start=10.0)),
    "m^3": (DisplayUnit(symbol="ml", factor=1e6),),
    "m^2": (DisplayUnit(symbol="mm²", factor=1e6),),
    "kg m": (DisplayUnit(symbol="g\u202fmm", factor=1e6),),
    "m/(kg m)": (DisplayUnit(symbol="µm/(g\u202fmm)", factor=1.0),),
    "s/m": (DisplayUnit(symbol="s/µm", factor=1e-6),),
    "rad": (DisplayUnit(symbol="°", factor=180 / math.pi),),
    "rad/s": (DisplayUnit(symbol="rpm", factor=30 / math.pi),),
    "m/s": (DisplayUnit(symbol="m/s", factor=1.0),),
    "kg/m^3": (DisplayUnit(symbol="kg/m³", factor=1.0),),
    "m^2/s": (DisplayUnit(symbol="mm²/s", factor=1e6),),
    "m/s^2": (DisplayUnit(symbol="m/s²", factor=1.0),),
    "m^3/(s Pa)": (DisplayUnit(symbol="m³/(s\u202fPa)", factor=1.0),),
    "kg/m^2": (DisplayUnit(symbol="kg/m²", factor=1.0),),
    "N": (DisplayUnit(symbol="N", factor=1.0),),
    "N m": (DisplayUnit(symbol="N\u202fm", factor=1.0),),
    "1": (DisplayUnit(symbol="", factor=1.0),),
}


def display_unit(unit: str, *values: float | None) -> DisplayUnit:
    """The display unit that suits the largest of some values.

    Args: `unit`: SI unit, such as "Pa" or "kg m"; one that is not known is kept as it is. `values`: in that
        unit; None is skipped.
    Returns: The unit to show, with its factor.
    """
    units = _DISPLAY_UNITS.get(unit)
    if units is None:
        return DisplayUnit(symbol=unit, factor=1.0)
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    # 0.1 MPa may arrive as 99 999.999 999: the last bits must not choose the unit.
    fitting = [display for display in units if display.start <= largest * (1 + 1e-9)]
    return fitting[-1] if largest else units[-1]


def shown(value: float | None, unit: str, half_width: float | None = None, *, digits: int = 4) -> str:
    """An SI quantity as text in the unit that suits its size, with its half-width if there is one.

    Args: `value`: in `unit`; None where there is none. `half_width`: 95 %, in `unit`. `digits`: significant
        digits when there is no half-width.
    Returns: Text, such as (72.04 ± 0.03) mm.
    Raises: ValueError: a value that is not finite.
    """
    text, symbol = shown_apart(value, unit, half_width, digits=digits)
    wants_brackets = "±" in text and bool(symbol) and not text.startswith("(")
    return with_unit(f"({text})" if wants_brackets else text, symbol)


def shown_apart(
    value: float | None, unit: str, half_width: float | None = None, *, digits: int = 4
) -> tuple[str, str]:
    """As `shown`, with number and unit apart, for a page that sets them in different type.

    Args: `value`: in `unit`; None where there is none. `unit`: SI unit. `half_width`: 95 %, in `unit`.
        `digits`: significant digits when there is no half-width.
    Returns: The number's text, without brackets, and the unit's symbol.
    Raises: ValueError: a value that is not finite.
    """
    display = display_unit(unit, value)
    if value is None:
        return number(None), ""
    width = None if half_width is None else half_width * display.factor
    return measured(value * display.factor, width, digits=digits), display.symbol


def given(value: float | None, unit: str, *, digits: int = 6) -> str:
    """An SI quantity that was set, not found: as short as it may be.

    Args: `value`: in `unit`; None where there is none. `digits`: most significant digits.
    Returns: Text, such as 0.7 MPa or 0.25.
    Raises: ValueError: a value that is not finite.
    """
    display = display_unit(unit, value)
    return with_unit(short(None if value is None else value * display.factor, digits=digits), display.symbol)
