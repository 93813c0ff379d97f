"""Files of measurements as tables of text: TOML in the first lines, marked #, then rows below column heads.

Changes by a spreadsheet are undone if they are unambiguous: a byte order mark, Windows line ends, a line
"sep=;", semicolons or tabs between cells, first lines in quotation marks or followed by empty cells. So are
UTF-16, units in round brackets or in a row below the names, and decimal commas. A comma that may separate
thousands as well is refused.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray, StringArray
from ringbalance.scene.faults import Fault, did_you_mean
from ringbalance.scene.platform.files import read_bounded
from ringbalance.scene.toml import read_toml, toml_text
from ringbalance.scene.units import DIMENSIONS, FieldError, parse_number, parse_quantity

LARGEST_FILE: Final = 8 * 2**20
MOST_ROWS: Final = 2000
"""Largest number of rows, each a measurement; a longer recording must be averaged or thinned out first.

A fit stores the covariance of every pair of rows, which for more rows would take gigabytes.
"""
_WHAT: Final = "file of measurements"
_SERIES: Final = "series"
_MARK: Final = "#"
_SEPARATORS: Final = ";\t,"
_SETS_A_KEY: Final = re.compile(r'"?#\s*\w+\s*=')
_NAMED_SEPARATOR: Final = re.compile(r'"?sep=.{0,2}"?[,;\t]*', re.IGNORECASE)
_LINE: Final = re.compile(r"line (\d+)")
_WORKBOOKS: Final = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""First bytes of .xlsx or .ods, and of .xls."""
_UTF_16: Final = (b"\xff\xfe", b"\xfe\xff")
WINDOWS: Final = "cp1252"
_DECIMAL_COMMA: Final = re.compile(r"([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)")
_THOUSANDS: Final = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_POINT: Final = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
_HEAD: Final = re.compile(r"([A-Za-z][A-Za-z0-9_ ]*?)(?: ?\[([^][]+)\])?")
_SIZES: Final = (1e-15, 1e15)
"""Smallest and largest magnitude of a number other than zero in a cell."""
_NO_UNIT: Final = "1"
_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class CsvTable:
    """Header and cells of a file as text; `lines` and `rows` have equal length."""

    file: str
    header: Mapping[str, object]
    head_line: int
    heads: tuple[str, ...]
    lines: tuple[int, ...]
    """Line of each row in the file, from 1."""
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()
    """Changes of its text, a sentence each."""

    def fault(self, line: int, head: str, cell: str, problem: str, allowed: str = "") -> Fault:
        """Error of a cell."""
        return data_fault(
            self.file, f'line {line}, column "{head}"', problem, value=toml_text(cell), allowed=allowed
        )

    def name_faults(self, suggestions: Collection[str] = ()) -> Iterator[Fault]:
        """Yield errors for heads that are no name with a unit, and for repeated names.

        Args: `suggestions`: columns that the kind of data may have.
        """
        names = [split_head(head) for head in self.heads]
        for head, name in zip(self.heads, names, strict=True):
            if name is None or not _NAME.fullmatch(name[0]):
                problem = 'it is not a name with its unit in brackets, such as "pressure [kPa]"'
                yield self.head_fault(head, problem + did_you_mean(name[0] if name else head, suggestions))
        once = [name[0] for name in names if name is not None]
        for twice in sorted({each for each in once if once.count(each) > 1}):
            yield data_fault(self.file, f"line {self.head_line}", f'the column "{twice}" stands twice')

    def head_fault(self, head: str, problem: str, allowed: str = "") -> Fault:
        """Error of the name or the unit of a column."""
        position = f"line {self.head_line}, column {toml_text(head)}"
        return data_fault(self.file, position, problem, allowed=allowed)

    def values(self, head: str, unit: str, dimension: str | None) -> tuple[FloatArray, list[Fault]]:
        """Numbers of a column, SI, and the errors of its cells; 0 replaces a cell with an error."""
        values, faults = np.zeros(len(self.rows)), []
        for row, (line, cell) in enumerate(zip(self.lines, self.texts(head), strict=True)):
            try:
                if not cell:
                    raise FieldError("the cell is empty", "a number in every row, or no such column")
                value = parse_number(cell)
                if value and not _SIZES[0] <= abs(value) <= _SIZES[1]:
                    raise FieldError("no measurement has a number of this size", "0, or 1e-15 to 1e15")
                values[row] = value if dimension is None else parse_quantity(f"{cell} {unit}", dimension)
            except FieldError as error:
                faults.append(self.fault(line, head, cell, error.problem, error.allowed))
        return values, faults

    @property
    def series(self) -> StringArray:
        """Series of each row; one series for all rows without such a column."""
        return np.array(self.texts(_SERIES) if _SERIES in self.heads else ("one",) * len(self.rows))

    def texts(self, head: str) -> tuple[str, ...]:
        """Cells of a column of text."""
        at = self.heads.index(head)
        return tuple(cells[at] for cells in self.rows)


def data_fault(file: str, position: str, problem: str, *, value: str = "", allowed: str = "") -> Fault:
    """Error of a file of measurements. Args: `position`: such as 'line 3' or 'kind'; may be empty."""
    return Fault(file=file, key=position, value=value, problem=problem, allowed=allowed)


def file_name(path: Path) -> str:
    """Path in messages, printable and on one line."""
    name = str(path)
    return name if name.isprintable() else toml_text(name)


def read_content(path: Path, *, what: str = _WHAT) -> tuple[bytes, tuple[Fault, ...]]:
    """Bytes of a file, limited in number, or errors if it cannot be read."""
    content, problem = read_bounded(path, what=what, most=LARGEST_FILE)
    # A file that is too large is refused together with other errors of its bytes.
    return content, () if content or not problem else (data_fault(file_name(path), "", problem),)


def decoded(content: bytes, *, file: str) -> tuple[str, tuple[Fault, ...]]:
    """Text of the bytes of a file, or errors if they are no text."""
    if len(content) > LARGEST_FILE:
        problem = f"the file is larger than any {_WHAT}; average or thin out a recording"
        return "", (data_fault(file, "", problem, allowed=f"up to {LARGEST_FILE // 2**20} MiB"),)
    if content.startswith(_WORKBOOKS):
        problem = 'this is a workbook, not text; save the sheet as "CSV UTF-8"'
        return "", (data_fault(file, "", problem),)
    problem, at = "", -1
    try:
        text = content.decode(encoding_of(content))
        if "\0" in text:
            problem, at = "this is not text but binary data", content.index(b"\0")
    except UnicodeDecodeError as error:
        problem, at = "this is neither UTF-8 nor Windows-1252 text", error.start
    if not problem:
        return text, ()
    before = content[:at]
    line, start = before.count(b"\n") + 1, before.rfind(b"\n") + 1
    position = f"line {line}, character {len(before[start:].decode('utf-8-sig', 'replace')) + 1}"
    return "", (data_fault(file, position, f'{problem}; save the file as "CSV UTF-8"'),)


def encoding_of(content: bytes) -> str:
    """Encoding of a text: UTF-16 by its mark, UTF-8, or what a western spreadsheet on Windows writes."""
    if content.startswith(_UTF_16):
        return "utf-16"
    try:
        content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return WINDOWS
    return "utf-8-sig"


def parse_table(text: str, *, file: str, most: int = MOST_ROWS) -> tuple[CsvTable | None, tuple[Fault, ...]]:
    """Table of a text, or None, and all errors of its form. Args: `most`: largest number of rows."""
    numbered = list(enumerate(re.split(r"\r\n|\r|\n", text), 1))
    head_at = next((at for at, line in numbered if _is_data(line)), len(numbered) + 1)
    header: Mapping[str, object] | None = None
    faults: list[Fault] = []
    try:
        # The mark becomes a space, so that errors have the positions in the file.
        header = read_toml("\n".join(_unmarked(line) for _, line in numbered[: head_at - 1]))
    except (ValueError, csv.Error, RecursionError) as error:
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
        problem = f"the first lines, marked #, are not TOML: {' '.join(reason.split())}"
        faults.append(data_fault(file, "", problem))
    for at, line in numbered[head_at:]:
        # As in concatenated files: such a line would apply to no row.
        if _SETS_A_KEY.match(line):
            problem = "this stands below the names of the columns; a file has one kind of data and one header"
            faults.append(data_fault(file, f"line {at}", problem))
    data = [(at, line) for at, line in numbered[head_at - 1 :] if _is_data(line)]
    if len(data) < 2:
        below = "there is no row of data below the names of the columns"
        problem = below if data else "the file has no line with the names of the columns"
        return None, (*faults, data_fault(file, "", problem))
    if len(data) - 1 > most:
        problem = f"{len(data) - 1} rows; a row is one measurement, so average or thin out a recording"
        return None, (*faults, data_fault(file, "", problem, allowed=f"up to {most} rows"))
    if header is None:
        return None, tuple(faults)
    separator = _separator(data[0][1])
    try:
        names = list(_cells(data[0][1], separator))
    except csv.Error as error:
        return None, (*faults, _cell_fault(head_at, error, file))
    # A spreadsheet may add empty cells after the names.
    while len(names) > 1 and not names[-1]:
        names.pop()
    rows, bad_rows = _rows(data[1:], len(names), separator, file)
    written = rows
    rows = rows if separator == "," else _with_points(rows)
    remarks = [] if rows == written else ["commas in numbers are decimal"]
    names = [re.sub(r" ?\(([^[]+)\)$", r" [\1]", name) for name in names]
    first = next(iter(rows), 0)
    if len(rows) > 1 and "[" not in "".join(names) and _are_units(rows[first]):
        remarks.append(f"units stand in line {first}")
        units = [cell.strip("[]()-") for cell in rows.pop(first)]
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
    # Spreadsheets capitalise names; in units capitals have a meaning.
    parts = [name.partition("[") for name in names]
    table = CsvTable(
        file=file,
        header=header,
        head_line=head_at,
        heads=tuple(name.lower() + bracket + unit for name, bracket, unit in parts),
        lines=tuple(rows),
        rows=tuple(rows.values()),
        remarks=tuple(remarks),
    )
    return table, (*faults, *bad_rows)


def _is_data(line: str) -> bool:
    """Return False for a line that is empty, marked #, or names the separator."""
    start = line.lstrip(f'" {_SEPARATORS}')
    return bool(start) and not start.startswith(_MARK) and not _NAMED_SEPARATOR.fullmatch(line.strip())


def _rows(
    data: Sequence[tuple[int, str]], length: int, separator: str, file: str
) -> tuple[dict[int, tuple[str, ...]], list[Fault]]:
    """Rows of the right length by line, and errors for the others."""
    rows, faults = {}, []
    for at, line in data:
        try:
            cells = _cells(line, separator)
        except csv.Error as error:
            faults.append(_cell_fault(at, error, file))
            continue
        if len(cells) < length or any(cells[length:]):
            problem = f"{len(cells)} values, and the columns are {length}"
            if len(cells) > length and separator == ",":
                problem += "; a decimal comma would do this: write points"
            faults.append(data_fault(file, f"line {at}", problem))
        else:
            rows[at] = cells[:length]
    return rows, faults


def _with_points(rows: dict[int, tuple[str, ...]]) -> dict[int, tuple[str, ...]]:
    """Rows with decimal points for commas, where no cell has a point and the commas part no thousands."""
    commas = [cell for row in rows.values() for cell in row if _DECIMAL_COMMA.fullmatch(cell)]
    points = any(_POINT.fullmatch(cell) for row in rows.values() for cell in row)
    if points or all(_THOUSANDS.fullmatch(cell) for cell in commas):
        return rows
    return {
        at: tuple(_DECIMAL_COMMA.sub(r"\1.\2", c) if _DECIMAL_COMMA.fullmatch(c) else c for c in row)
        for at, row in rows.items()
    }


def _are_units(cells: Sequence[str]) -> bool:
    """True for a row of units below the names of columns."""
    units = [cell.strip("[]()-").split(" ")[0] for cell in cells]
    return any(units) and all(unit in ("", _NO_UNIT, "g") or dimension_of(unit) for unit in units)


def _unmarked(line: str) -> str:
    line = line.strip()
    if line.startswith(f'"{_MARK}'):
        separator = line[-1] if line[-1] in _SEPARATORS else _separator(line)
        line = separator.join(next(csv.reader([line], delimiter=separator), []))
    return " " + line[1:].rstrip(f" {_SEPARATORS}") if line.startswith(_MARK) else ""


def _separator(head: str) -> str:
    """Separator: the first of semicolon, tab and comma in the line of names, which contain none of these."""
    return next((each for each in _SEPARATORS if each in head), ",")


def _cells(line: str, separator: str) -> tuple[str, ...]:
    return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=separator, strict=True)))


def _cell_fault(line: int, error: csv.Error, file: str) -> Fault:
    too_long = "field limit" in str(error)
    marks = f"the quotation marks are wrong ({error})"
    return data_fault(file, f"line {line}", "a cell is longer than any number or name" if too_long else marks)


def in_order(faults: Iterable[Fault]) -> list[Fault]:
    """Errors of one file in the order of its lines, those of the whole file first."""
    return sorted(faults, key=lambda fault: int(match[1]) if (match := _LINE.match(fault.key)) else 0)


def split_head(head: str) -> tuple[str, str] | None:
    """Name and unit of a column head, the unit empty if there is none; None for an invalid head."""
    match = _HEAD.fullmatch(head)
    if match is None:
        return None
    unit = (match[2] or "").strip()
    return match[1].strip(), "" if unit == _NO_UNIT else unit


def dimension_of(unit: str) -> str | None:
    """First dimension with this unit; None if there is none."""
    for dimension in DIMENSIONS:
        try:
            parse_quantity(f"1 {unit}", dimension)
        except FieldError:
            continue
        return dimension
    return None
