"""Data sets of measurements: the numbers, where they come from, and what they support.

A file is CSV in long form, one row a measurement. Its first lines, marked #, are TOML and fill `Source`. A
column is a name with its unit in brackets, such as "pressure [kPa]", or a name alone for a number without
unit; `series` holds text. docs/measurements.md says which columns each kind of data has.
"""

from __future__ import annotations

import csv
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray
from ringbalance.scene.dimensions import DIMENSIONS, Unit

SERIES: Final = "series"
_COLUMN: Final = re.compile(r"([a-z][a-z0-9_]*)(?: ?\[([^][]+)\])?")
_UNITS: Final[Mapping[str, Unit]] = {
    name: unit for kind in DIMENSIONS.values() for name, unit in kind.units.items()
}
_MOST_SHOWN: Final = 20
_SIZES: Final = (1e-15, 1e15)
_ENOUGH: Final = {"kind", "source", "uncertainty"}


class MeasurementsError(ValueError):
    """A file of measurements that cannot be used; the text has all errors, each with row and column."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where a data set comes from."""

    kind: str
    """Kind of data, a key of `KINDS`."""
    source: str
    uncertainty: float
    """U_D, expanded (95 %), relative to the measured value."""
    uncertainty_from: str = ""
    where: str = ""
    doi: str = ""
    """Empty where there is none."""
    licence: str = ""
    """Of the numbers as they stand in the file."""
    read: str = ""
    """Tables of the publication, somebody else's copy of them (a transcription), or points read from a
    figure."""
    conditions: str = ""
    supports: str = ""
    does_not_support: str = ""


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """One data set, one row a point."""

    source: Source
    series: StringArray
    """Tube, run or rig that a point belongs to: its points share their systematic errors."""
    columns: Mapping[str, FloatArray]
    """SI, by name."""

    def __len__(self) -> int:
        return int(self.series.size)

    @property
    def uncertainty(self) -> FloatArray:
        """U_D of each point, expanded (95 %), relative: a column of that name, or the source's."""
        return self.columns.get("uncertainty", np.full(len(self), self.source.uncertainty))

    def where(self, chosen: BoolArray) -> Measurements:
        """Some of the points."""
        return Measurements(
            source=self.source,
            series=self.series[chosen],
            columns={name: column[chosen] for name, column in self.columns.items()},
        )


def measurements(name: str) -> Measurements:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    return parse_measurements(path.read_text(encoding="utf-8"), file=f"{name}.csv")


def read_measurements(path: Path) -> Measurements:
    """The data set of a file. Raises: MeasurementsError: no such file, or not a data set."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MeasurementsError(f"{path}: it cannot be read as text ({error})") from error
    return parse_measurements(text, file=str(path))


def parse_measurements(text: str, *, file: str) -> Measurements:
    """The data set of a text. Args: `file`: its name in messages. Raises: MeasurementsError: all errors."""
    lines = text.splitlines()
    source, faults = _source("\n".join(line[1:].strip() for line in lines if line.startswith("#")))
    numbered = [(at, line) for at, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    rows = [next(csv.reader([line])) for _, line in numbered]
    heads = [head.strip() for head in rows[0]] if rows else []
    faults += _head_faults(heads)
    if len(rows) < 2:
        faults.append("there is no row of data below the names of the columns")
    places = [at for at, _ in numbered[1:]]
    faults += [] if faults else _row_faults(heads, rows[1:], places)
    if faults or source is None:
        more = len(faults) - _MOST_SHOWN
        shown = faults[:_MOST_SHOWN] + ([f"and {more} more; correct these first"] if more > 0 else [])
        raise MeasurementsError("\n".join(f"{file}: {fault}" for fault in shown))
    columns = dict(zip(heads, zip(*rows[1:], strict=True), strict=True))
    return Measurements(
        source=source,
        series=np.array(columns.pop(SERIES, ("one",) * len(places)), dtype=np.str_),
        columns=dict(_in_si(head, column) for head, column in columns.items()),
    )


def _source(head: str) -> tuple[Source | None, list[str]]:
    try:
        given = tomllib.loads(head)
    except tomllib.TOMLDecodeError as error:
        return None, [f"the lines marked # are not TOML: {error}"]
    known = [field.name for field in fields(Source)]
    faults = [
        f'the key "{key}" is not known; allowed: {", ".join(known)}' for key in given if key not in known
    ]
    faults += [f'the key "{key}" is missing in the lines marked #' for key in sorted(_ENOUGH - given.keys())]
    faults += [
        f'the key "{key}" must be text'
        for key, value in given.items()
        if key in known and key != "uncertainty" and not isinstance(value, str)
    ]
    width = given.get("uncertainty", 0.0)
    if isinstance(width, bool) or not isinstance(width, int | float) or not 0 <= width < 1:
        faults.append("uncertainty must be a number from 0 to below 1: 95 %, relative to the measured value")
    return (None, faults) if faults else (Source(**given), [])


def _head_faults(heads: Sequence[str]) -> list[str]:
    faults = []
    for head in heads:
        match = _COLUMN.fullmatch(head)
        if match is None:
            faults.append(f'the column "{head}" is not a name with its unit, such as "pressure [kPa]"')
        elif (unit := match[2]) not in (None, "1") and (unit not in _UNITS or _UNITS[unit].offset):
            faults.append(f'the column "{head}" has a unit that is not known; docs/scene-file.md has them')
    names = [head.split("[")[0].strip() for head in heads]
    return faults + [f'the column "{name}" stands twice' for name in set(names) if names.count(name) > 1]


def _row_faults(heads: Sequence[str], rows: Iterable[Sequence[str]], places: Sequence[int]) -> list[str]:
    faults = []
    for at, row in zip(places, rows, strict=True):
        if len(row) != len(heads):
            faults.append(f"line {at} has {len(row)} values, the columns are {len(heads)}")
            continue
        faults += [
            f'line {at}, column "{head}": "{text}" is no number of a size that is measured'
            for head, text in zip(heads, row, strict=True)
            if head != SERIES and not _is_measured(text)
        ]
    return faults


def _is_measured(text: str) -> bool:
    """Whether it is zero, or a number within `_SIZES` of either sign."""
    try:
        size = abs(float(text))
    except ValueError:
        return False
    return size == 0 or _SIZES[0] <= size <= _SIZES[1]


def _in_si(head: str, column: Sequence[str]) -> tuple[str, FloatArray]:
    match = _COLUMN.fullmatch(head)
    assert match is not None
    unit = _UNITS.get(match[2] or "")
    factor = 1.0 if unit is None else float(unit.factor) * (math.pi if unit.pi else 1.0)
    return match[1], factor * np.array([float(text) for text in column])
