"""Rows, findings and tables as a terminal, a notebook and a CSV file show them."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from io import StringIO
from typing import Final, Literal

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table as RichTable
from rich.text import Text

from ringbalance.results.findings import Finding
from ringbalance.results.numbers import plain
from ringbalance.results.rows import Quantity
from ringbalance.results.table import Table

_STYLES: Final = {"info": "green", "warning": "yellow", "error": "red"}
_NAME: Final = 28
"""Characters of names that stand in one line."""
Facts = Sequence[tuple[str, str]]
"""Names and texts."""


def findings_text(findings: Iterable[Finding], *, headline: bool = True) -> Group:
    """One sentence a finding; the first may be a headline."""
    texts = []
    for place, each in enumerate(findings):
        first = headline and place == 0
        colour = "" if each.severity == "info" and not first else _STYLES[each.severity]
        texts.append(Text(each.text, style=f"{'bold ' if first else ''}{colour}"))
    return Group(*texts)


def quantity_rows(quantities: Iterable[Quantity]) -> Iterator[tuple[str, str]]:
    """Name and text of each, with its status where it is limited."""
    for each in quantities:
        limited = "" if each.status == "ok" else f" ({each.status.replace('_', ' ')})"
        yield each.name, plain(each.text) + limited


def two_columns(rows: Iterable[tuple[str, str]]) -> RichTable:
    """Names and texts, without head or frame."""
    table = RichTable(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    for name, text in rows:
        table.add_row(Text(name), Text(text))
    return table


def terminal_table(table: Table) -> RichTable:
    """A table for a rich console, in the signs of a typewriter."""
    shown = RichTable(
        title=table.caption or None,
        caption=table.note or None,
        title_justify="left",
        caption_justify="left",
        title_style="bold",
        header_style="bold",
        box=SIMPLE_HEAD,
        padding=0,
        pad_edge=False,
    )
    for place, (head, numeric) in enumerate(zip(table.heads, table.numeric, strict=True)):
        # A name that is cut short is no use; anything else is broken into lines.
        name = place == 0 and max((len(row[0]) for row in table.rows), default=0) <= _NAME
        side: Literal["right", "left"] = "right" if numeric else "left"
        shown.add_column(Text(plain(head)), justify=side, no_wrap=name, overflow="fold")
    for row in table.rows:
        shown.add_row(*(Text(plain(cell)) for cell in row))
    return shown


def csv_text(table: Table) -> str:
    """A table as comma-separated values with a line of heads; numbers as they are printed."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([plain(head).replace("\n", " ") for head in table.heads])
    writer.writerows([plain(cell) for cell in row] for row in table.rows)
    return text.getvalue()


def html_table(table: Table) -> str:
    """A table for a notebook."""
    heads = "".join(f"<th>{escape(head)}</th>" for head in table.heads)
    rows = "".join(f"<tr>{_cells(row, table.numeric)}</tr>" for row in table.rows)
    caption = f"<caption>{escape(table.caption)}</caption>" if table.caption else ""
    return f"<table>{caption}<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def _cells(row: Sequence[str], numeric: Sequence[bool]) -> str:
    aligned = ("right" if number else "left" for number in numeric)
    return "".join(
        f'<td style="text-align:{side}">{escape(cell)}</td>' for side, cell in zip(aligned, row, strict=True)
    )
