"""Numbers into prose: the placeholders of a case's text, filled from its evidence alone.

A placeholder is {name}, {name:unit} or {name:unit:format}, such as {stall:MPa}, {low:%:.1f} or {count:1:d}.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

_UNITS = {
    "": (1.0, ""),
    "1": (1.0, ""),
    "%": (100.0, " %"),
    "MPa": (1e-6, " MPa"),
    "kPa": (1e-3, " kPa"),
    "Pa": (1.0, " Pa"),
    "m": (1.0, " m"),
    "mm": (1e3, " mm"),
    "um": (1e6, " µm"),
    "ml": (1e6, " ml"),
    "g mm": (1e6, " g mm"),
    "m/s": (1.0, " m/s"),
    "s": (1.0, " s"),
    "ms": (1e3, " ms"),
    "g": (1e3, " g"),
    "kg/m^3": (1.0, " kg/m³"),
    "rpm": (30 / math.pi, " rpm"),
    "deg": (180 / math.pi, "°"),
    "N": (1.0, " N"),
    "cSt": (1e6, " mm²/s"),
    "um/(g*mm)": (1.0, " µm/(g mm)"),
}
_PLACEHOLDER = re.compile(r"\{([a-z][a-z0-9_]*)(?::([^:{}]*))?(?::([^{}]*))?\}")


def placeholders(text: str) -> tuple[str, ...]:
    """Names of the numbers that a text asks for, in order of appearance.

    Raises: ValueError: a unit that is not known, or braces that are not a placeholder.
    """
    for match in _PLACEHOLDER.finditer(text):
        if (match[2] or "") not in _UNITS:
            raise ValueError(f"placeholder {match[0]} has an unknown unit; known: {', '.join(_UNITS)}")
    rest = _PLACEHOLDER.sub("", text)
    if "{" in rest or "}" in rest:
        raise ValueError(f"braces that are no placeholder in: {text}")
    return tuple(match[1] for match in _PLACEHOLDER.finditer(text))


def fill(text: str, numbers: Mapping[str, float]) -> str:
    """A text with SI values put in by name.

    Each is written in the unit that its placeholder names, to four significant digits unless that has a
    format, and held to its unit by a no-break space.
    Raises: ValueError: a number that is missing or not finite.
    """

    def number(match: re.Match[str]) -> str:
        name, unit, style = match[1], match[2] or "", match[3] or "#.4g"
        if name not in numbers:
            raise ValueError(f'the evidence holds no number "{name}"')
        if not math.isfinite(numbers[name]):
            raise ValueError(f'the number "{name}" is not finite')
        factor, symbol = _UNITS[unit]
        value = numbers[name] * factor
        return _shown(round(value) if style.endswith("d") else value, style) + symbol.replace(" ", "\u00a0")

    return _PLACEHOLDER.sub(number, text)


def _shown(value: float, style: str) -> str:
    shown = format(value, style)
    if style.startswith("#"):
        shown = shown.rstrip(".")
    return shown.replace("-", "\u2212") if "e" not in shown else shown
