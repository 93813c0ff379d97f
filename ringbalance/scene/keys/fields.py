"""Readers of a key's value: conversion of a TOML value to SI, or an error with the accepted values.

A reader is part of the annotation of a record's field, see `declaration`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Any, get_args

from ringbalance.scene.faults import did_you_mean
from ringbalance.scene.units import DIMENSIONS, FieldError, counted_pressure, parse_quantity

_LARGEST_NUMBER = 1e9
_LINE_CHARACTERS = 200
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
LEAST_CHAMBERS = 4
"""Least number of chambers, two pairs: one pair corrects along a single line only."""


@dataclass(frozen=True, kw_only=True)
class ValueReader:
    """Reader of the values of one key."""

    read: Callable[[object], Any]
    """TOML value to SI; raises FieldError."""
    allowed: str
    """Accepted values, for messages."""
    summary: str
    """Form of the value, for the reference of the scene file."""
    dimension: str | None = None
    """A key of `DIMENSIONS`; None without unit."""
    one_for_all: bool = False
    """True if a list of one value is written as that value."""


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Interval of accepted values, as numbers and as users write it."""

    above: float | None = None
    """Exclusive."""
    at_least: float | None = None
    at_most: float | None = None
    below: float | None = None
    """Exclusive."""

    def holds(self, value: float) -> bool:
        """True for a value inside the interval, in the unit of the bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.at_most is None or value <= self.at_most)
            and (self.below is None or value < self.below)
        )

    def __str__(self) -> str:
        """The interval in words, such as "above 0 and at most 1"."""
        named = {"above": self.above, "at least": self.at_least, "at most": self.at_most, "below": self.below}
        return " and ".join(f"{words} {bound:g}" for words, bound in named.items() if bound is not None)


POSITIVE = Bounds(above=0)
NOT_NEGATIVE = Bounds(at_least=0)


def quantity(dimension: str, bounds: Bounds | None = None) -> ValueReader:
    """Reader of text such as "44.5 mm", of a key of `DIMENSIONS`; bounds in SI, None for any sign."""
    kind = DIMENSIONS[dimension]
    limits = bounds or Bounds()
    interval = f" {limits}".replace(" at least", " of at least") if bounds else ""
    allowed = f'{kind.name}{interval}, such as "{kind.example}", in {kind.unit_names}'

    def read(value: object) -> float:
        number = parse_quantity(value, dimension)
        if not limits.holds(number):
            raise FieldError(f"it must be {limits}", allowed)
        if limits.above == 0 and number < kind.smallest:
            raise FieldError(
                f"it must be at least {kind.smallest:g} {kind.si_unit} to mean anything", allowed
            )
        return number

    return ValueReader(read=read, allowed=allowed, summary=f"{kind.name}{interval}", dimension=dimension)


def _pressure(bounds: Bounds, *, gauge: bool) -> ValueReader:
    """Reader of a gauge or an absolute pressure, whose unit may have that mark: "7 barg", "1 bara"."""
    plain = quantity("pressure", bounds)
    return replace(plain, read=lambda value: plain.read(counted_pressure(value, gauge=gauge)))


def _balance_grade() -> ValueReader:
    """Reader of a balance quality grade of ISO 21940-11, m/s: "G 2.5", or its velocity."""
    plain = quantity("velocity", POSITIVE)
    allowed = f'a grade such as "G 2.5", or {plain.allowed}'

    def read(value: object) -> float:
        grade = re.fullmatch(r"\s*G\s*([0-9.,]+)\s*", value) if isinstance(value, str) else None
        try:
            return float(plain.read(f"{grade[1]} mm/s" if grade else value))
        except FieldError as error:
            raise FieldError(error.problem, allowed) from None

    return ValueReader(
        read=read, allowed=allowed, summary='a grade such as "G 2.5" or "2.5 mm/s"', dimension="velocity"
    )


def angle_of_turn() -> ValueReader:
    """Reader of a phase or lag, rad; beyond a full turn either way it is wrapped to within half a turn."""
    allowed = f'an angle such as "{DIMENSIONS["angle"].example}", in {DIMENSIONS["angle"].unit_names}'

    def read(value: object) -> float:
        angle = parse_quantity(value, "angle")
        # A rounded 360 deg is a full turn.
        return angle if abs(angle) <= 2 * math.pi * (1 + 1e-12) else math.remainder(angle, 2 * math.pi)

    return ValueReader(read=read, allowed=allowed, summary="an angle", dimension="angle")


def share(bounds: Bounds, *, example: float) -> ValueReader:
    """Reader of a fraction: a plain number or a percentage."""
    allowed = f'a share {bounds}, such as {example:g} or "{100 * example:g} %"'

    def read(value: object) -> float:
        number = parse_quantity(value, "share") if isinstance(value, str) else _number(value, allowed)
        if not bounds.holds(number):
            raise FieldError(f"it must be {bounds}", allowed)
        return number

    return ValueReader(read=read, allowed=allowed, summary=f"a share {bounds}, bare or in %")


def number(bounds: Bounds) -> ValueReader:
    """Reader of a plain number without unit."""
    allowed = f"a bare number {bounds}".replace("number at", "number of at").strip()

    def read(value: object) -> float:
        plain = _number(value, allowed)
        if not bounds.holds(plain):
            raise FieldError(f"it must be {bounds}", allowed)
        return plain

    return ValueReader(read=read, allowed=allowed, summary=allowed)


def _number(value: object, allowed: str) -> float:
    if isinstance(value, str):
        raise FieldError("it is text, where a bare number stands", allowed)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FieldError("it is not a number", allowed)
    if isinstance(value, float) and not math.isfinite(value):
        raise FieldError("it is not a finite number", allowed)
    if abs(value) > _LARGEST_NUMBER:
        raise FieldError(f"its magnitude is above {_LARGEST_NUMBER:g}", allowed)
    return float(value)


def _whole(value: object, allowed: str) -> int:
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise FieldError("it is not a whole number", allowed)
    return value


def chamber_count() -> ValueReader:
    """Reader of the number of chambers: even, at least two pairs, and at most the number of letters."""
    allowed = f"an even whole number from {LEAST_CHAMBERS} to {len(LETTERS)}"

    def read(value: object) -> int:
        count = _whole(value, allowed)
        if count % 2:
            raise FieldError("it must be even: each chamber needs its opposite", allowed)
        if count == 2:
            raise FieldError("two chambers correct along one line only", allowed)
        if not LEAST_CHAMBERS <= count <= len(LETTERS):
            raise FieldError(f"it must lie from {LEAST_CHAMBERS} to {len(LETTERS)}", allowed)
        return count

    return ValueReader(read=read, allowed=allowed, summary=allowed)


def whole(lowest: int, highest: int, *, highest_text: str = "") -> ValueReader:
    """Reader of a whole number; `highest_text` is the highest as users write it."""
    interval = f"from {lowest} to {highest_text or highest}"
    allowed = f"a whole number {interval}"

    def read(value: object) -> int:
        count = _whole(value, allowed)
        if not lowest <= count <= highest:
            raise FieldError(f"it must lie {interval}", allowed)
        return count

    return ValueReader(read=read, allowed=allowed, summary=allowed)


def each_of(reader: ValueReader, *, example: str, count: int = 0) -> ValueReader:
    """Reader of a list of values of one kind, `count` of them unless that is zero; its values are tuples."""
    size = f"a list of {count}" if count else "a list"
    allowed = f"{size} such as {example}; each {reader.allowed}"

    def read(value: object) -> tuple[Any, ...]:
        if not isinstance(value, list) or count not in (0, len(value)):
            raise FieldError(f"it is not {size}", allowed)
        values = []
        for number_in_list, item in enumerate(value, start=1):
            try:
                values.append(reader.read(item))
            except FieldError as error:
                raise FieldError(f"entry {number_in_list}: {error.problem}", error.allowed) from error
        return tuple(values)

    summary = f"{size}, each {reader.summary}"
    return ValueReader(read=read, allowed=allowed, summary=summary, dimension=reader.dimension)


def _one_or_each(reader: ValueReader, *, example: str) -> ValueReader:
    """Reader of one value, or of a list of one for each chamber; its values are tuples."""
    listed, more = each_of(reader, example=example), "or a list of one for each chamber"

    def read(value: object) -> tuple[Any, ...]:
        values: tuple[Any, ...] = listed.read(value) if isinstance(value, list) else (reader.read(value),)
        return values

    return replace(
        listed,
        read=read,
        allowed=f"{reader.allowed}; {more}, such as {example}",
        summary=f"{reader.summary}, {more}",
        one_for_all=True,
    )


def choice(words: Any) -> ValueReader:
    """Reader of one of a few words, which a `Literal` lists."""
    return one_of(lambda: get_args(words))


def one_of(words: Callable[[], tuple[str, ...]]) -> ValueReader:
    """Reader of one of the words that a function returns at the time of reading."""

    def quoted() -> str:
        return " or ".join(f'"{option}"' for option in words())

    def read(value: object) -> str:
        options = words()
        if not isinstance(value, str):
            raise FieldError("it is not text", quoted())
        if value not in options:
            raise FieldError(f"it is not one of the known words{did_you_mean(value, options)}", quoted())
        return value

    return ValueReader(read=read, allowed=quoted(), summary=quoted())


def text() -> ValueReader:
    """Reader of text on one line."""
    allowed = f"text on one line, up to {_LINE_CHARACTERS} characters"

    def read(value: object) -> str:
        if not isinstance(value, str):
            raise FieldError("it is not text", allowed)
        if not value.strip() or not value.isprintable() or len(value) > _LINE_CHARACTERS:
            raise FieldError("it is empty, too long or not printable", allowed)
        return value

    return ValueReader(read=read, allowed=allowed, summary=allowed)


def chamber_letters() -> ValueReader:
    """Reader of the order in which chambers are tried: different capital letters."""
    allowed = 'a list of chamber letters, each once, such as ["A", "C", "B", "D"]'

    def read(value: object) -> tuple[str, ...]:
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise FieldError("it is not a list of letters", allowed)
        letters: Iterable[str] = value
        if any(len(letter) != 1 or letter not in LETTERS for letter in letters):
            raise FieldError("a chamber is named by one capital letter", allowed)
        if len(set(letters)) != len(value):
            raise FieldError("a chamber stands in it more than once", allowed)
        return tuple(letters)

    return ValueReader(read=read, allowed=allowed, summary=allowed)


def half_width(dimension: str | None) -> ValueReader:
    """Reader of an expanded uncertainty (95 %): a percentage, or in the unit of the quantity's dimension.

    Its values are (half-width, whether it is relative); SI when it is not.
    """
    name = DIMENSIONS[dimension].name if dimension else "a bare number"
    units = f" in {DIMENSIONS[dimension].unit_names}" if dimension else ""
    allowed = f'a percentage of the quantity such as "5 %", or {name}{units}'

    def read(value: object) -> tuple[float, bool]:
        relative = isinstance(value, str) and value.rstrip().endswith("%")
        kind = "share" if relative else dimension
        try:
            width = parse_quantity(value, kind) if kind else _number(value, allowed)
        except FieldError as error:
            raise FieldError(error.problem, allowed) from error
        if width < 0 or (relative and width >= 1):
            raise FieldError("an uncertainty must be at least 0 and below 100 %", allowed)
        return width, relative

    return ValueReader(read=read, allowed=allowed, summary=f"a percentage, or {name}")


OneLine = Annotated[str, text()]
PositiveLength = Annotated[float, quantity("length", POSITIVE)]
Length = Annotated[float, quantity("length", NOT_NEGATIVE)]
PositiveAngle = Annotated[float, quantity("angle", POSITIVE)]
Angle = Annotated[float, quantity("angle", NOT_NEGATIVE)]
Turn = Annotated[float, angle_of_turn()]
PositiveTime = Annotated[float, quantity("time", POSITIVE)]
Time = Annotated[float, quantity("time", NOT_NEGATIVE)]
GaugePressure = Annotated[float, _pressure(NOT_NEGATIVE, gauge=True)]
AbsolutePressure = Annotated[float, _pressure(NOT_NEGATIVE, gauge=False)]
TimePerChamber = Annotated[
    tuple[float, ...], _one_or_each(quantity("time", NOT_NEGATIVE), example='["50 ms", "30 ms"]')
]
PositiveGaugePressure = Annotated[float, _pressure(POSITIVE, gauge=True)]
PositiveAbsolutePressure = Annotated[float, _pressure(POSITIVE, gauge=False)]
Temperature = Annotated[float, quantity("temperature")]
Influence = Annotated[float, quantity("influence_coefficient", POSITIVE)]
PositiveMass = Annotated[float, quantity("mass", POSITIVE)]
Mass = Annotated[float, quantity("mass", NOT_NEGATIVE)]
Stiffness = Annotated[float, quantity("stiffness", POSITIVE)]
Damping = Annotated[float, quantity("damping", NOT_NEGATIVE)]
PositiveVelocity = Annotated[float, quantity("velocity", POSITIVE)]
BalanceGrade = Annotated[float, _balance_grade()]
Velocity = Annotated[float, quantity("velocity", NOT_NEGATIVE)]
PositiveUnbalance = Annotated[float, quantity("unbalance", POSITIVE)]
Unbalance = Annotated[float, quantity("unbalance", NOT_NEGATIVE)]
PositiveRate = Annotated[float, quantity("speed", POSITIVE)]
Rate = Annotated[float, quantity("speed", NOT_NEGATIVE)]
Inertia = Annotated[float, quantity("inertia", NOT_NEGATIVE)]
Weight = Annotated[float, number(POSITIVE)]
FillRatio = Annotated[float, share(Bounds(above=0, at_most=1), example=0.5)]
PositiveShare = Annotated[float, share(POSITIVE, example=0.5)]
ProperFraction = Annotated[float, share(Bounds(above=0, below=1), example=0.5)]
Gate = Annotated[float, share(Bounds(above=0, at_most=1), example=0.01)]
Angles = Annotated[tuple[float, float], each_of(angle_of_turn(), count=2, example='["0 deg", "180 deg"]')]
Arms = Annotated[
    tuple[float, float], each_of(quantity("length", NOT_NEGATIVE), count=2, example='["10 mm", "10 mm"]')
]
Teeth = Annotated[tuple[int, int, int], each_of(whole(1, 100000), count=3, example="[10, 40, 400]")]
