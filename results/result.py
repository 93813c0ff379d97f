"""What every answer is: rows, and the document that its command prints as JSON."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from html import escape
from itertools import islice
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.text import Text

from ringbalance.results.findings import Finding
from ringbalance.results.numbers import plain
from ringbalance.results.render import (
    Facts,
    findings_text,
    html_table,
    quantity_rows,
    terminal_table,
    two_columns,
)
from ringbalance.results.rows import Quantity
from ringbalance.results.table import Table
from ringbalance.scene.origins import summary_text

_MAIN: Final = 3
"""Quantities in a short text."""
_MOST: Final = 10
"""In a notebook."""


@dataclass(frozen=True, kw_only=True)
class Rows:
    """A result as every output shows it."""

    title: str
    """What was computed for which scene."""
    quantities: tuple[Quantity, ...]
    """The main ones first, each key once."""
    findings: tuple[Finding, ...] = ()
    """The verdict first."""
    facts: Facts = ()
    """Names and texts that are no quantities, for a terminal."""
    tables: tuple[Table, ...] = ()
    """For a terminal; those without rows are left out."""
    listed: int | None = None
    """How many quantities a terminal lists, where its tables have the others; None: all."""

    def document(self) -> dict[str, Any]:
        """What the JSON of every command has of them."""
        return {
            "quantities": [each.document() for each in self.quantities],
            "findings": [each.document() for each in self.findings],
        }

    def view(self, *more: RenderableType, headline: bool = True) -> RenderableType:
        """What a command prints: findings as sentences, quantities, then `more`, then the tables.

        Args: `headline`: whether the first finding is one; otherwise the title is, and findings come later.
        """
        numbers = two_columns([*self.facts, *quantity_rows(self.quantities[: self.listed])])
        tables = iter([terminal_table(table) for table in self.tables if table.rows])
        if headline:
            return Group(findings_text(self.findings), numbers, *more, *tables)
        # Where nothing is listed, the first table has the quantities.
        first = [*islice(tables, 1), two_columns(self.facts)] if self.listed == 0 else [numbers]
        sentences = findings_text(self.findings, headline=False)
        return Group(Text(self.title, style="bold"), *first, *more, sentences, *tables)

    def lines(self) -> Iterator[str]:
        """About five lines: what it is, its main numbers with units, and the verdict."""
        yield self.title
        for each in self.quantities[:_MAIN]:
            yield f"{each.name} {plain(each.text)}"
        for finding in self.findings[:1]:
            yield finding.text

    def html(self) -> str:
        """For a notebook."""
        sentences = "".join(f"<p>{escape(each.sentence())}</p>" for each in self.findings)
        rows = [(each.name, each.symbol, each.text) for each in self.quantities[:_MOST]]
        table = Table(heads=("quantity", "symbol", "value (95 %)"), rows=rows)
        return f"<div><strong>{escape(self.title)}</strong>{sentences}{html_table(table)}</div>"


class Result:
    """Base of what the commands, and the functions of the same names, answer with."""

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
        """For a notebook."""
        return self.rows().html()


@dataclass(frozen=True, kw_only=True)
class Presentation:
    """Functions that lay a result out; they import what they describe, so who makes a result gives them."""

    document: Callable[[Any], dict[str, Any]]
    rows: Callable[[Any], Rows]


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
