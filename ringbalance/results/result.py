"""Results as rows, written for a terminal, a notebook, a CSV file and JSON."""

from __future__ import annotations

import csv
import math
import re
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import StringIO
from itertools import islice
from os import PathLike
from typing import Any, Final, Literal

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from ringbalance.results.numbers import MISSING, percent, plain
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.origins import summary_text
from ringbalance.scene.platform.display import display
from ringbalance.scene.platform.terminal import results_console
from ringbalance.scene.registry import registered

Cells = Sequence[str]
Facts = Sequence[tuple[str, str]]
"""Names and texts."""

_STYLES: Final = {"info": "green", "warning": "yellow", "error": "red"}
_UNBROKEN_NAME_CHARACTERS: Final = 28
_MAIN_QUANTITIES: Final = 3
_NOTEBOOK_QUANTITIES: Final = 10
_LIMITED: Final = {"ok": "", "out_of_range": " (beyond the validity of its models, as a warning says)"}
"""Limit of a number in words, by its status, where the status does not say it."""
_COLUMNS: Final = ("name", "symbol", "value", "lower", "upper", "unit", "origin", "status")
_EXTRA: Final = "this needs the package {0}: pip install {0}, or ringbalance[sweep-tables] with all of them"
_NUMBER: Final = re.compile(r"(?:<[^>]*>)*[(+−-]?\d")
"""Beginning of a number, after any tags."""
_FORMULA: Final = re.compile(r"(?![+-]?[\d.]+(?:e[+-]?\d+)?\Z)[=+\-@\t\r]")
"""Beginning of a formula in a spreadsheet, unless the whole text is a number."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """Texts in rows and columns, for any output."""

    caption: str = ""
    heads: Cells
    """Heads of the columns; a line break divides a head into lines."""
    rows: Sequence[Cells]
    note: str = ""
    """Text below the table."""
    style: str = "narrow"
    """Class of the report's style sheet: "narrow", "dense", "words", "whole" or none."""

    @property
    def numeric(self) -> list[bool]:
        """True for each column that is set as numbers: most of its cells begin like one."""
        columns = zip(*self.rows, strict=True) if self.rows else [()] * len(self.heads)
        filled = ([cell for cell in column if cell.strip(MISSING)] for column in columns)
        return [2 * sum(bool(_NUMBER.match(cell)) for cell in cells) > len(cells) for cells in filled]


_MIN_CONTRIBUTION: Final = 0.1
"""Contribution of a term over the tolerance below which the printed table omits it."""


def models_table(models_used: Iterable[Any], *, tolerance: float) -> Table:
    """Physical terms of a result with their models, without those far below the tolerance.

    Args: `models_used`: records with `term`, `model`, `why`, and `estimated_contribution`, relative to the
        result, None where it is unknown; their `why`, half of a printed calibration, is left to documents.
    """
    rows = [
        (each.term, each.model, percent(each.estimated_contribution, digits=3))
        for each in models_used
        if each.estimated_contribution is None or each.estimated_contribution >= _MIN_CONTRIBUTION * tolerance
    ]
    caption = "Models used; --json and the report say why"
    return Table(caption=caption, heads=("term", "model", "contribution"), rows=rows)


def csv_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """Columns of one length as comma-separated values below a line of their names; None is an empty cell.

    An apostrophe precedes a text that a spreadsheet would take for a formula, numbers excepted; a carriage
    return, which would end the line, becomes a line feed.
    """

    def escaped(cell: Any) -> Any:
        if not isinstance(cell, str):
            return cell
        return (f"'{cell}" if _FORMULA.match(cell) else cell).replace("\r", "\n")

    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    rows: tuple[Iterable[Any], ...] = (columns, *zip(*columns.values(), strict=True))
    for row in rows:
        writer.writerow([escaped(cell) for cell in row])
    return text.getvalue()


def _findings_text(findings: Iterable[Finding], *, headline: bool) -> Group:
    """One sentence per finding; the first may be a headline."""
    texts = []
    for number, each in enumerate(findings):
        first = headline and number == 0
        colour = "" if each.severity == "info" and not first else _STYLES[each.severity]
        texts.append(Text(each.text, style=f"{'bold ' if first else ''}{colour}"))
    return Group(*texts)


def _two_columns(rows: Iterable[tuple[str, str]]) -> RichTable:
    """Names and texts, without head or frame."""
    table = RichTable(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    for name, text in rows:
        table.add_row(Text(name), Text(text))
    return table


def _terminal_table(table: Table) -> Group:
    """A table for a rich console, in keyboard characters; its texts may be wider than its columns."""
    shown = RichTable(header_style="bold", box=SIMPLE_HEAD, padding=0, pad_edge=False)
    for number, (head, numeric) in enumerate(zip(table.heads, table.numeric, strict=True)):
        # A name up to this length stays on one line; all other cells wrap.
        name = (
            number == 0 and max((len(row[0]) for row in table.rows), default=0) <= _UNBROKEN_NAME_CHARACTERS
        )
        side: Literal["right", "left"] = "right" if numeric else "left"
        shown.add_column(Text(plain(head)), justify=side, no_wrap=name, overflow="fold")
    for row in table.rows:
        shown.add_row(*(Text(plain(cell)) for cell in row))
    above, below = Text(plain(table.caption), style="bold"), Text(plain(table.note), style="italic dim")
    return Group(*([above] if table.caption else []), shown, *([below] if table.note else []))


@dataclass(frozen=True, kw_only=True)
class Rows:
    """A result as every output shows it."""

    title: str
    """Name of the computation and of the scene."""
    quantities: tuple[Quantity, ...]
    """Quantities with different keys, the main ones first."""
    findings: tuple[Finding, ...] = ()
    """Findings, the verdict first."""
    facts: Facts = ()
    """Names and texts other than quantities, for a terminal."""
    tables: tuple[Table, ...] = ()
    """Tables for a terminal; those without rows are left out."""
    main: int = _MAIN_QUANTITIES
    """Number of quantities in a short text."""
    listed: int | None = None
    """Number of quantities that a terminal lists, where its tables have the others; None: all."""

    def document(self) -> dict[str, Any]:
        """Part of the JSON that all commands have in common."""
        return {
            "quantities": [each.document() for each in self.quantities],
            "findings": [each.document() for each in self.findings],
        }

    def view(self, *more: RenderableType, headline: bool = True) -> RenderableType:
        """Text for a terminal: findings as sentences, quantities, then `more`, then the tables.

        Args: `headline`: True to begin with the first finding; else with the title, findings later.
        """
        facts = list(self.facts)
        for each in self.quantities[: self.listed]:
            limited = _LIMITED.get(each.status, f" ({each.status.replace('_', ' ')})")
            facts.append((each.name, plain(each.text) + limited))
        numbers = _two_columns(facts)
        tables = iter([_terminal_table(table) for table in self.tables if table.rows])
        if headline:
            return Group(_findings_text(self.findings, headline=True), numbers, *more, *tables)
        # Without a list of quantities the first table shows them.
        first = [*islice(tables, 1), _two_columns(self.facts)] if self.listed == 0 else [numbers]
        sentences = _findings_text(self.findings, headline=False)
        return Group(Text(self.title, style="bold"), *first, *more, sentences, *tables)

    def lines(self) -> Iterator[str]:
        """About five lines: title, main numbers with units, verdict, and a warning behind it."""
        yield self.title
        for each in self.quantities[: self.main]:
            yield f"{each.name} {plain(each.text)}"
        warnings = [each for each in self.findings[1:] if each.severity == "warning"]
        for finding in (*self.findings[:1], *warnings[:1]):
            yield finding.text

    def html(self) -> str:
        """Element for a notebook."""
        sentences = "".join(f"<p>{escape(each.sentence())}</p>" for each in self.findings)
        quantities = self.quantities[:_NOTEBOOK_QUANTITIES]
        table = Table(
            heads=("quantity", "symbol", "value (95 %)"),
            rows=[(each.name, each.symbol, each.text) for each in quantities],
        )
        sides = ["right" if numeric else "left" for numeric in table.numeric]
        heads = "".join(f"<th>{escape(head)}</th>" for head in table.heads)
        body = ""
        for row in table.rows:
            cells = zip(sides, row, strict=True)
            texts = (f'<td style="text-align:{side}">{escape(cell)}</td>' for side, cell in cells)
            body += f"<tr>{''.join(texts)}</tr>"
        html = f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        return f"<div><strong>{escape(self.title)}</strong>{sentences}{html}</div>"


def print_rows(rows: Rows, *, headline: bool = True) -> None:
    """Write a result to standard output, about five lines of it where the command line asks for that.

    Args: `headline`: see `Rows.view`.
    """
    console = results_console()
    if display().brief:
        console.print(summary_text(rows.lines()), markup=False, highlight=False)
    else:
        console.print(rows.view(headline=headline))


def extra(package: str, name: str) -> Any:
    """A registered function of an optional package. Raises: ModuleNotFoundError: it is not installed."""
    try:
        return registered("function", name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(_EXTRA.format(package)) from error


class Result:
    """Base of the results of the commands and of the functions of the same names."""

    @abstractmethod
    def rows(self) -> Rows:
        """Quantities, findings and tables."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The document that the command of the result prints with `--json`."""

    def __repr__(self) -> str:
        """About five lines."""
        return summary_text(self.rows().lines())

    def _repr_html_(self) -> str:
        """Element for a notebook."""
        return self.rows().html()

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the result in the report's style.

        Args: `path`: an SVG file to write; None: no file.
        Returns: Figures that a notebook shows; `svg()` has them as text.
        Raises: TypeError: a result of this type has no figure. OSError: the file cannot be written.
        """
        figures = registered("function", "figures_of_result")(self)
        if path is not None:
            figures.save(path)
        return figures

    def _history(self) -> Mapping[str, Sequence[Any]]:
        """Histories of a run by the name of their column; empty for other results."""
        return {}

    def to_pandas(self) -> Any:
        """The quantities as a DataFrame by key, a line each; SI, the unit in its column.

        Raises: ModuleNotFoundError: without pandas.
        """
        documents = [each.document() for each in self.rows().quantities]
        columns = {name: [each[name] for each in documents] for name in _COLUMNS}
        return extra("pandas", "pandas_frame")(columns, index=[each["key"] for each in documents])

    def to_xarray(self) -> Any:
        """The quantities as a Dataset, with names, units and ends of the 95 % interval as CF has attributes.

        Of a run also its histories over "time_s", as `ringbalance simulate --csv` writes them.

        Raises: ModuleNotFoundError: without xarray.
        """
        array, dataset = extra("xarray", "xarray_array"), extra("xarray", "xarray_dataset")
        names = {"name": "long_name", "unit": "units", "lower": "lower", "upper": "upper"}
        variables = {
            each["key"]: array(
                math.nan if each["value"] is None else each["value"],
                attrs={names[key]: each[key] for key in names if each[key] is not None},
            )
            for each in (quantity.document() for quantity in self.rows().quantities)
        }
        for name, values in self._history().items():
            numbers = [math.nan if value is None else value for value in values]
            variables[name] = array(numbers, dims=("time_s",))
        return dataset(variables, attrs={"title": self.rows().title})


@dataclass(frozen=True, kw_only=True)
class Presentation:
    """Functions that lay out a result, passed to the result by the caller, since they import its type."""

    document: Callable[[Any], dict[str, Any]]
    rows: Callable[[Any], Rows]
    history: Callable[[Any], Mapping[str, Sequence[Any]]] | None = None


@dataclass(frozen=True, kw_only=True, repr=False)
class PresentedResult(Result):
    """A result that was made together with its presentation."""

    presentation: Presentation

    def to_dict(self) -> dict[str, Any]:
        """The document that the command of the result prints with `--json`."""
        return self.presentation.document(self)

    def rows(self) -> Rows:
        """Quantities, findings and tables."""
        return self.presentation.rows(self)

    def _history(self) -> Mapping[str, Sequence[Any]]:
        return self.presentation.history(self) if self.presentation.history else {}
