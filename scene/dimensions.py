"""The units a scene file may use, with exact factors: the rows of `data/units.csv`."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from importlib import resources
from types import MappingProxyType


@dataclass(frozen=True, kw_only=True)
class Unit:
    """One unit: SI value = (number + offset) * factor, times pi for angles."""

    factor: Fraction
    offset: Fraction
    pi: bool


@dataclass(frozen=True, kw_only=True)
class Dimension:
    """A kind of quantity with its units."""

    name: str
    """With its article, such as "a length"."""
    example: str
    """A quantity as one would write it."""
    units: Mapping[str, Unit] = field(repr=False)
    """By name; the SI unit first."""
    smallest: float
    """SI; a quantity that must not be zero is not smaller than this."""
    largest: float
    """SI; no magnitude above this is meant seriously, and none below it overflows when squared or cubed."""

    @property
    def noun(self) -> str:
        """The name without its article."""
        return self.name.split(" ", 1)[1]


def _dimensions() -> Mapping[str, Dimension]:
    data = resources.files("ringbalance.scene") / "data" / "units.csv"
    lines = data.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return MappingProxyType({row["dimension"]: _dimension(row) for row in rows})


def _dimension(row: Mapping[str, str]) -> Dimension:
    return Dimension(
        name=row["name"],
        example=row["example"],
        units=MappingProxyType(dict(map(_unit, row["units"].split("; ")))),
        smallest=float(row["smallest"]),
        largest=float(row["largest"]),
    )


def _unit(text: str) -> tuple[str, Unit]:
    """Name and unit from "rpm 1/30*pi" or "degC 1 273.15": a factor, and an offset where there is one."""
    name, factor, *offset = text.split(" ")
    above, _, below = factor.removesuffix("*pi").partition("/")
    return name, Unit(
        factor=Fraction(above) / Fraction(below or 1),
        offset=Fraction(offset[0] if offset else 0),
        pi=factor.endswith("*pi"),
    )


DIMENSIONS: Mapping[str, Dimension] = _dimensions()
