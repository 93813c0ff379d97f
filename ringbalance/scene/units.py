"""Quantities written with units, read into SI and written back: no guessing, one rounding.

The written decimal times the unit's exact factor is rounded once, so "44.5 mm" and "4.45 cm" are the same
double.  A number that another package wraps is recognised only by its methods: with a unit, as pint has it,
with a standard deviation, as uncertainties has it, or with both.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final

from ringbalance.scene.faults import meant_text
from ringbalance.scene.platform.files import packaged_rows
from ringbalance.scene.toml import toml_text


@dataclass(frozen=True, kw_only=True)
class _Unit:
    """One unit: SI value = (number + offset) * factor, times pi for angles."""

    factor: Fraction
    offset: Fraction
    pi: bool


@dataclass(frozen=True, kw_only=True)
class _Dimension:
    """A kind of quantity with its units."""

    name: str
    """Name with its article, such as "a length"."""
    example: str
    """A quantity as one would write it."""
    units: Mapping[str, _Unit] = field(repr=False)
    """Units by name; the SI unit first."""
    smallest: float
    """Least magnitude of a quantity that must not be zero, SI."""
    largest: float
    """Largest accepted magnitude, SI; none below it overflows when squared or cubed."""

    @property
    def noun(self) -> str:
        """The name without its article."""
        return self.name.split(" ", 1)[1]

    @property
    def si_unit(self) -> str:
        """Its unit in SI."""
        return next(iter(self.units))

    @property
    def unit_names(self) -> str:
        """The units with commas between, as a message shows them."""
        return ", ".join(self.units)


def _dimensions() -> Mapping[str, _Dimension]:
    dimensions = {}
    for row in packaged_rows("ringbalance.scene", "data", "units.csv"):
        units = {}
        # "rpm 1/30*pi" or "degC 1 273.15": name, factor, and an offset where there is one.
        for text in row["units"].split("; "):
            name, factor, *offset = text.split(" ")
            above, _, below = factor.removesuffix("*pi").partition("/")
            units[name] = _Unit(
                factor=Fraction(above) / Fraction(below or 1),
                offset=Fraction(offset[0] if offset else 0),
                pi=factor.endswith("*pi"),
            )
        dimensions[row["dimension"]] = _Dimension(
            name=row["name"],
            example=row["example"],
            units=MappingProxyType(units),
            smallest=float(row["smallest"]),
            largest=float(row["largest"]),
        )
    return MappingProxyType(dimensions)


DIMENSIONS: Mapping[str, _Dimension] = _dimensions()


_TEXT_CHARACTERS = 60
_READS_BACK = 1e-6
"""Relative tolerance of a value that is written and read again."""
_TINY = 0.01
"""Value in the usual unit below which SI reads easier, such as 0.06 s for 0.001 min."""
_PLAIN_SI = (0.1, 1000.0)
"""Values in SI that read easily."""
_SMALL = 0.1
"""Value in the usual unit below which such a value in SI reads easier: 0.714 s for 0.0119 min."""
_SAVED_CHARACTERS = 4
"""Characters that SI must save to replace the usual unit."""
_NUMBER = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)(?![0-9.,])\s*(.*?)\s*", re.DOTALL
)
_NOT_FINITE = re.compile(r"\s*[+-]?(nan|inf)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"\s*[+-]?[0-9]+,[0-9]")
_THOUSANDS = re.compile(r"\s*([+-]?[1-9][0-9]{0,2}(?:[ ,'_’][0-9]{3})+)(\.[0-9]+)?(?![0-9.,])")
_NORMAL_LITRES = re.compile(r"[Nn](l|L|dm\^3|m\^3)/.*")
_STATED_FLOWS = "; a flow from 6 to 5 bar gauge goes to nominal_flow, flow coefficients go to Kv and Cv"
_COUNTED = re.compile(r"(.*[a-z])[ *]?\(?([gGaA])(?:auge|bs|bsolute)?\)?", re.DOTALL)
"""Unit of pressure with a mark for gauge or absolute, as in barg and bar(a)."""
_DYNAMIC_VISCOSITIES = ("Pa*s", "mPa*s", "cP", "P")
_SPELLINGS = MappingProxyType(
    {
        "℃": "degC",
        "°C": "degC",
        "°F": "degF",
        "°": "deg",
        "µ": "u",
        "μ": "u",
        "²": "^2",
        "³": "^3",
        "·": "*",
        "⋅": "*",
        "×": "*",
        "−": "-",
        "Ω": "ohm",
        "\u2126": "ohm",
    }
)


class FieldError(ValueError):
    """A value that a key cannot take.

    Args: `problem`: what is wrong with it. `allowed`: what would be accepted.
    """

    def __init__(self, problem: str, allowed: str) -> None:
        self.problem = problem
        self.allowed = allowed
        super().__init__(f"{problem}; allowed: {allowed}")


def parse_quantity(text: object, dimension: str) -> float:
    """Read a quantity such as "44.5 mm" into SI.

    SI value = (number + offset) factor, rounded once; angles and speeds times pi after that.
    Args: `text`: a number and a unit; the space between may be left out. `dimension`: a key of `DIMENSIONS`.
    Returns: The value in SI, finite.
    Raises: FieldError: not such a quantity; the error says what is wrong and which units exist.
    Range: magnitudes up to `_Dimension.largest`; a temperature above absolute zero.
    """
    if isinstance(text, str):
        return _parsed(text, dimension)
    problem = "a bare number has no unit"
    if isinstance(text, bool) or not isinstance(text, int | float):
        problem = "it is not text with a number and a unit"
    raise FieldError(problem, _allowed(DIMENSIONS[dimension]))


@lru_cache(4096)
def _parsed(text: str, dimension: str) -> float:
    """SI value of a text, cached: scenes of a sweep share most of their texts."""
    kind = DIMENSIONS[dimension]
    number, unit_text = _split(text, kind)
    unit = kind.units.get(_canonical(unit_text))
    if unit is None:
        hint = _STATED_FLOWS if kind is DIMENSIONS["conductance"] and unit_text else ""
        raise FieldError(f"{_wrong_unit(unit_text, kind)}{hint}", _allowed(kind))
    # The double is looked at first: an exponent of a thousand million must not reach the exact arithmetic.
    rough = float(number)
    scale = float(unit.factor) * (math.pi if unit.pi else 1.0)
    if not abs(rough) * scale <= 10 * kind.largest:
        raise FieldError(_too_large(kind), _allowed(kind))
    value = rough + 0.0  # no negative zero
    if unit.factor != 1 or unit.offset != 0:
        top, bottom = Decimal(number).as_integer_ratio() if rough != 0 else (0, 1)
        up, down = unit.offset.numerator, unit.offset.denominator
        # A quotient of integers is rounded once, and computed much faster than one of fractions.
        exact = (top * down + up * bottom) * unit.factor.numerator
        value = exact / (bottom * down * unit.factor.denominator)
    value *= math.pi if unit.pi else 1.0
    if abs(value) > kind.largest:
        raise FieldError(_too_large(kind), _allowed(kind))
    if kind is DIMENSIONS["temperature"] and value <= 0:
        raise FieldError("it lies at or below absolute zero", "a temperature above 0 K (-273.15 degC)")
    return value


def written_like(value: float, like: object, dimension: str) -> str:
    """Text of an SI value to its last bit, in the unit of a similar text, such as "2 mm".

    In SI where there is no such text, where its unit does not return the value, or where SI saves digits.
    """
    kind = DIMENSIONS[dimension]
    plain = repr(value).removesuffix(".0")
    in_si = f"{plain} {kind.si_unit}"
    unit = _unit_of(like, dimension) if isinstance(like, str) else ""
    if not unit or not abs(value) <= kind.largest:
        return in_si
    entry = kind.units[_canonical(unit)]
    number = value / float(entry.factor) / (math.pi if entry.pi else 1.0) - float(entry.offset)
    texts = (f"{number:.{digits}g} {unit}" for digits in (15, 16, 17))
    text = next((each for each in texts if parse_quantity(each, dimension) == value), in_si)
    return in_si if len(plain) + _SAVED_CHARACTERS <= len(text.split(" ")[0]) else text


@lru_cache(1024)
def _unit_of(text: str, dimension: str) -> str:
    """Unit as spelled in a text; empty where the text is no quantity of this dimension."""
    kind = DIMENSIONS[dimension]
    try:
        unit = _split(text, kind)[1]
    except FieldError:
        return ""
    return unit if _canonical(unit) in kind.units else ""


def parse_number(text: str) -> float:
    """Read a number without a unit, such as a cell of a table.

    Returns: Finite. Raises: FieldError: anything else; the error says what to write instead.
    """
    spelled = _respelled(text.strip())
    match = _NUMBER.fullmatch(spelled)
    if match is not None and not match[2] and math.isfinite(value := float(match[1])):
        return value
    if match is not None and match[2]:
        problem = "it is not a number alone"
    elif not spelled:
        problem = "nothing stands there"
    else:
        problem = _not_a_number(spelled).removesuffix(" followed by a unit")
    raise FieldError(problem, "a number with a decimal point, such as 0.25 or 2.5e-1")


def format_quantity(value: float, dimension: str, unit: str, *, digits: int = 6) -> str:
    """Text of an SI value in a unit of its dimension, such as "44.5 mm"."""
    entry = DIMENSIONS[dimension].units[unit]
    number = value / float(entry.factor) / (math.pi if entry.pi else 1.0) - float(entry.offset)
    return f"{number:.{digits}g} {unit}"


def unit_factor(unit: str) -> float:
    """Factor of a unit to SI, without its offset; 1 for "1", a number without unit."""
    if unit == "1":
        return 1.0
    entry = next(units[unit] for units in (kind.units for kind in DIMENSIONS.values()) if unit in units)
    return float(entry.factor) * (math.pi if entry.pi else 1.0)


def shortest(value: float) -> str:
    """Shortest text of a number that reads back within a relative 1e-6."""
    texts = (f"{float(f'{value:.{digits}g}'):.15g}" for digits in range(1, 16))
    return next(text for text in texts if math.isclose(float(text), value, rel_tol=_READS_BACK))


def shortest_quantity(value: float, usual: str) -> str:
    """Text of an SI value to 1e-6, in its usual unit; in SI where it is tiny or SI saves digits."""
    si = next(kind.si_unit for kind in DIMENSIONS.values() if usual in kind.units)
    plain, other = (f"{shortest(value / unit_factor(unit))} {unit}" for unit in (usual, si))
    plain_si = _PLAIN_SI[0] <= abs(value) < _PLAIN_SI[1]
    small = abs(value) < (_SMALL if plain_si else _TINY) * unit_factor(usual)
    tiny = small and len(other) < len(plain)
    return other if value == 0.0 or tiny or len(other) + _SAVED_CHARACTERS <= len(plain) else plain


def unit_of(text: str) -> str:
    """The unit of a quantity such as "44.5 mm", as `DIMENSIONS` names it; empty for any other text."""
    match = _NUMBER.fullmatch(_respelled(text))
    return "" if match is None else _canonical(match[2])


def _split(text: str, kind: _Dimension) -> tuple[str, str]:
    if len(text) > _TEXT_CHARACTERS:
        raise FieldError(f"it is longer than {_TEXT_CHARACTERS} characters", _allowed(kind))
    spelled = _respelled(text)
    match = _NUMBER.fullmatch(spelled)
    if match is None or _THOUSANDS.match(spelled):
        raise FieldError(_not_a_number(spelled), _allowed(kind))
    return match[1], match[2]


def _not_a_number(text: str) -> str:
    if _NOT_FINITE.match(text):
        return "it is not a finite number"
    if thousands := _THOUSANDS.match(text):
        joined = re.sub(r"[ ,'_’]", "", thousands[1]) + (thousands[2] or "")
        single = re.fullmatch(r"[^,]*,[0-9]+", thousands[0].strip())
        decimal = f" or, if the comma is a decimal one, {thousands[1].replace(',', '.')}" if single else ""
        return f"its digits are parted: write {joined}{decimal}"
    if _DECIMAL_COMMA.match(text):
        return "it has a decimal comma; write a point"
    return "it is not a number followed by a unit"


def _respelled(text: str) -> str:
    if text.isascii():
        return text
    for spelling, standard in _SPELLINGS.items():
        text = text.replace(spelling, standard)
    return text


@lru_cache(1024)
def _canonical(unit: str) -> str:
    """Standard spelling of a unit: no space around operators, * between factors, m^2 for m2."""
    tight = re.sub(r"\s*([*/()^])\s*", r"\1", unit)
    product = re.sub(r"\s+", "*", tight)
    return re.sub(r"(?<=m)(?=[23](?![0-9]))", "^", product)


def _too_large(kind: _Dimension) -> str:
    return f"its magnitude is above {kind.largest:g} {kind.si_unit}, more than any balancer has"


def _allowed(kind: _Dimension) -> str:
    return f'{kind.name} such as "{kind.example}", in {kind.unit_names}'


def _wrong_unit(unit_text: str, kind: _Dimension) -> str:
    unit = _canonical(unit_text)
    if not unit:
        return "the unit is missing"
    if unit in _DYNAMIC_VISCOSITIES and kind is DIMENSIONS["kinematic_viscosity"]:
        return f'"{unit}" is a unit of dynamic viscosity; divide by the density'
    for other in DIMENSIONS.values():
        if unit in other.units:
            return f'"{unit}" is a unit of {other.noun}, not of {kind.noun}'
    problem = f"{toml_text(unit)} is not a unit of {kind.noun}"
    if kind.name.endswith(("6358)", "flow")) and (normal := _NORMAL_LITRES.fullmatch(unit)):
        return f"{problem}: it counts gas at 0 degC and 101.325 kPa; 1 N{normal[1]} is 1.087 {normal[1]} ANR"
    # One letter more or less is another unit: only a unit with the same letters and digits is suggested.
    alike = (each for each in kind.units if _letters(each) == _letters(unit))
    return f"{problem}{meant_text(next(alike, ''))}"


def _letters(unit: str) -> str:
    return re.sub(r"[^a-z0-9]", "", unit.lower())


def counted_pressure(value: object, *, gauge: bool) -> object:
    """Text of a pressure without the gauge or absolute mark of its unit, as in barg or psia.

    Raises: FieldError: the mark contradicts `gauge`.
    """
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    marked = _COUNTED.fullmatch(match[2]) if match else None
    if not match or not marked or marked[1] not in DIMENSIONS["pressure"].units:
        return value
    if (marked[2] in "gG") != gauge:
        ways = ("absolute", "over the ambient pressure")
        problem = f"{toml_text(match[2])} is {ways[not gauge]}, and this pressure is {ways[gauge]}"
        raise FieldError(problem, "the same pressure with the ambient pressure taken off or added")
    return f"{match[1]} {marked[1]}"


NO_UNIT: Final = "dimensionless"


def plain_number(value: Any, unit: str) -> tuple[Any, float]:
    """Number in a unit and its standard deviation, zero where it has none; other values unchanged.

    Args: `unit`: as scene files have it.
    Raises: ValueError: a quantity of another dimension.
    """
    if hasattr(value, "magnitude") and hasattr(value, "to"):
        try:
            value = value.to(unit or NO_UNIT).magnitude
        except Exception as error:
            raise ValueError(f"{value} is nothing in {unit or 'numbers without a unit'}: {error}") from error
    if hasattr(value, "nominal_value") and hasattr(value, "std_dev"):
        return value.nominal_value, float(value.std_dev)
    return value, 0.0
