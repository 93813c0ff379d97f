"""Data sets of measurements: the numbers, where they come from, and what they support.

A file is CSV in long form, one row a measurement. Its first lines, marked #, are TOML and fill `Source`. A
column is a name with its unit in brackets, such as "pressure [kPa]", or a name alone for a number without
unit; `series` holds text. docs/measurements.md says which columns each kind of data has.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.identification.data.tables import (
    SERIES,
    Table,
    data_fault,
    decoded,
    dimension_of,
    file_name,
    in_order,
    parse_table,
    read_content,
    split_head,
)
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray, StringArray
from ringbalance.scene.faults import Fault
from ringbalance.scene.toml import toml_text
from ringbalance.scene.uncertain import NORMAL_95

_MOST_SHOWN: Final = 20
_ENOUGH: Final = ("kind", "source", "uncertainty")


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


SOURCE_KEYS: Final = tuple(field.name for field in fields(Source))


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

    @classmethod
    def parsed(cls, text: str, *, file: str) -> Measurements:
        """The data set of a text. Args: `file`: for messages. Raises: MeasurementsError: all errors."""
        table, faults = parse_table(text, file=file)
        if table is None:
            raise _error(faults)
        wrong = [*faults, *_source_faults(table), *table.name_faults(), *_unit_faults(table)]
        heads_are_right = len(wrong) == len(faults)
        columns = dict(_columns(table, wrong)) if heads_are_right else {}
        if wrong:
            raise _error(wrong)
        return cls(
            source=Source(**table.header),  # type: ignore[arg-type]
            series=table.series,
            columns=columns,
        )

    @classmethod
    def read(cls, path: Path) -> Measurements:
        """The data set of a file. Raises: MeasurementsError: no such file, or not a data set."""
        content, unreadable = read_content(path)
        text, faults = decoded(content, file=file_name(path))
        if unreadable or faults:
            raise _error(unreadable or faults)
        return Measurements.parsed(text, file=file_name(path))


def _source_faults(table: Table) -> Iterator[Fault]:
    """What is wrong with the first lines of a data set."""
    yield from table.header_faults(known=SOURCE_KEYS, needed=_ENOUGH)
    yield from table.text_faults(key for key in SOURCE_KEYS if key != "uncertainty")
    width = table.header.get("uncertainty", 0.0)
    if isinstance(width, bool) or not isinstance(width, int | float) or not 0 <= width < 1:
        problem = "it is not a number from 0 to below 1: 95 %, relative to the measured value"
        yield data_fault(table.file, "uncertainty", problem, value=toml_text(width))


def _unit_faults(table: Table) -> Iterator[Fault]:
    for head in table.heads:
        _, unit = split_head(head) or ("", "")
        if unit and dimension_of(unit) is None:
            yield table.head_fault(head, "the unit is not known; docs/scene-file.md has them")


def _columns(table: Table, wrong: list[Fault]) -> Iterator[tuple[str, FloatArray]]:
    for head in table.heads:
        name, unit = split_head(head) or ("", "")
        if name != SERIES:
            values, faults = table.values(head, unit, dimension_of(unit) if unit else None)
            wrong += faults
            yield name, values


def _error(faults: Iterable[Fault]) -> MeasurementsError:
    lines = [str(fault) for fault in in_order(faults)]
    more = len(lines) - _MOST_SHOWN
    shown = [*lines[:_MOST_SHOWN], f"and {more} more; correct these first"] if more > 0 else lines
    return MeasurementsError("\n".join(shown))


@dataclass(frozen=True, kw_only=True)
class Observations:
    """The rows of one file of measurements, all of one kind."""

    kind: str
    file: str
    source: str = ""
    """Rig, run and date, as the file's first lines have them."""
    sha256: str = ""
    """Of the file's bytes."""
    lines: IntArray
    """Line of each row in the file, from 1."""
    series: StringArray
    """Run, rig or day that a row belongs to."""
    chamber: StringArray
    """Letter of the driven chamber; empty where the kind has none."""
    columns: Mapping[str, FloatArray]
    """SI, by name; amplitudes zero to peak. An optional column that the file does not have is absent."""
    uncertainty: Mapping[str, FloatArray]
    """Expanded (95 %), absolute, SI, by measured column; where one is absent its noise is estimated."""

    def __len__(self) -> int:
        return int(self.lines.size)

    def rows_of(self, values: FloatArray) -> FloatArray:
        """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
        return np.reshape(values, (-1, len(self))).T

    def vectors(self, *, when: str = "") -> ComplexArray:
        """a exp(j phase) of each row, m zero to peak. Args: `when`: "", "_before" or "_after"."""
        columns = self.columns
        return np.asarray(
            columns[f"amplitude{when}"] * np.exp(1j * columns[f"phase{when}"]), dtype=np.complex128
        )

    def vector_covariance(self, *, when: str = "", given: bool) -> FloatArray:
        """Covariance of each vector's two parts, shape (n, 2, 2): m^2, or unit where noise is not `given`.

        Along the vector sigma_a, across it sigma_a or, where given, a sigma_phase.
        """
        count, widths = len(self), self.uncertainty
        if not given:
            return np.broadcast_to(np.eye(2), (count, 2, 2)).copy()
        along = widths[f"amplitude{when}"] / NORMAL_95
        size, across = self.columns[f"amplitude{when}"], along
        if f"phase{when}" in widths:
            across = np.where(size > 0, size * widths[f"phase{when}"] / NORMAL_95, along)
        angle = self.columns[f"phase{when}"]
        c, s, a, b = np.cos(angle), np.sin(angle), along**2, across**2
        return np.moveaxis(
            np.array([[a * c**2 + b * s**2, (a - b) * c * s], [(a - b) * c * s, a * s**2 + b * c**2]]), -1, 0
        )
