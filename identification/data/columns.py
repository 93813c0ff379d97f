"""Columns of a table of measurements: names with units in brackets, cells that become numbers in SI."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from typing import Final

import numpy as np

from ringbalance.identification.data.tables import Table, data_fault
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, did_you_mean, toml_text
from ringbalance.scene.units import DIMENSIONS, FieldError, parse_number, parse_quantity

_HEAD: Final = re.compile(r"([A-Za-z][A-Za-z0-9_ ]*?)(?: ?\[([^][]+)\])?")
_SIZES: Final = (1e-15, 1e15)
"""Of a number as it stands in a cell; zero is allowed too."""
_NO_UNIT: Final = "1"
_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")


def split_head(head: str) -> tuple[str, str] | None:
    """Name and unit of a column, the unit empty where there is none; None for what is no such name."""
    match = _HEAD.fullmatch(head)
    if match is None:
        return None
    unit = (match[2] or "").strip()
    return match[1].strip(), "" if unit == _NO_UNIT else unit


def name_faults(table: Table, known: Collection[str] = ()) -> Iterator[Fault]:
    """Heads that are no name with a unit, and names that stand twice. Args: `known`: names to suggest."""
    names = [split_head(head) for head in table.heads]
    for head, name in zip(table.heads, names, strict=True):
        if name is None or not _NAME.fullmatch(name[0]):
            problem = 'it is not a name with its unit in brackets, such as "pressure [kPa]"'
            yield head_fault(table, head, problem + did_you_mean(name[0] if name else head, known))
    once = [name[0] for name in names if name is not None]
    for twice in sorted({each for each in once if once.count(each) > 1}):
        yield data_fault(table.file, f"line {table.head_line}", f'the column "{twice}" stands twice')


def head_fault(table: Table, head: str, problem: str, allowed: str = "") -> Fault:
    """One error of the name or the unit of a column."""
    place = f"line {table.head_line}, column {toml_text(head)}"
    return data_fault(table.file, place, problem, allowed=allowed)


def check_unit(unit: str, dimension: str) -> None:
    """Raises: FieldError: no unit of that dimension; the error has those that are."""
    parse_quantity(f"1 {unit}", dimension)


def dimension_of(unit: str) -> str | None:
    """The first dimension that has a unit; None where none has it."""
    for dimension in DIMENSIONS:
        try:
            check_unit(unit, dimension)
        except FieldError:
            continue
        return dimension
    return None


def _cell_value(cell: str, unit: str, dimension: str | None) -> float:
    """The number of a cell, SI. Raises: FieldError: no number, or one of a size that nobody measures."""
    if not cell:
        raise FieldError("the cell is empty", "a number in every row, or no such column")
    value = parse_number(cell)
    if value and not _SIZES[0] <= abs(value) <= _SIZES[1]:
        raise FieldError("no measurement has a number of this size", "0, or 1e-15 to 1e15")
    return value if dimension is None else parse_quantity(f"{cell} {unit}", dimension)


def column_values(
    table: Table, head: str, unit: str, dimension: str | None
) -> tuple[FloatArray, list[Fault]]:
    """The numbers of a column, SI, and the errors of its cells; 0 stands for a cell with an error."""
    at, values, faults = table.heads.index(head), np.zeros(len(table.rows)), []
    for row, (line, cells) in enumerate(zip(table.lines, table.rows, strict=True)):
        try:
            values[row] = _cell_value(cells[at], unit, dimension)
        except FieldError as error:
            faults.append(table.fault(line, head, cells[at], error.problem, error.allowed))
    return values, faults


def texts(table: Table, head: str) -> tuple[str, ...]:
    """The cells of a column of text."""
    at = table.heads.index(head)
    return tuple(cells[at] for cells in table.rows)
