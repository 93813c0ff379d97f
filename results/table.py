"""Texts in rows and columns, whatever they are written to."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ringbalance.results.numbers import MISSING

Cells = Sequence[str]


@dataclass(frozen=True, kw_only=True)
class Table:
    """A column is set as numbers when most of its cells begin like one."""

    caption: str = ""
    heads: Cells
    """A line break divides a head."""
    rows: Sequence[Cells]
    note: str = ""
    """Below the table."""

    @property
    def numeric(self) -> list[bool]:
        """By column."""
        columns = zip(*self.rows, strict=True) if self.rows else [()] * len(self.heads)
        return [_numeric([cell for cell in column if cell.strip(MISSING)]) for column in columns]


def _numeric(cells: Cells) -> bool:
    return 2 * sum(bool(re.match(r"[(+−-]?\d", cell)) for cell in cells) > len(cells)
