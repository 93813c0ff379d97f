"""Texts in rows and columns, whatever they are written to."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ringbalance.results.numbers import MISSING, percent

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


class _ModelUsed(Protocol):
    """A physical term as an answer lists it."""

    @property
    def term(self) -> str:
        """Its name."""

    @property
    def model(self) -> str:
        """What stands for it."""

    @property
    def why(self) -> str:
        """How the contribution was estimated."""

    @property
    def estimated_contribution(self) -> float | None:
        """Relative to the result; None: unknown."""


def models_table(models_used: Iterable[_ModelUsed]) -> Table:
    """The physical terms of an answer with their models."""
    rows = [
        (each.term, each.model, percent(each.estimated_contribution, digits=3), each.why)
        for each in models_used
    ]
    return Table(caption="Models used", heads=("term", "model", "contribution", "why"), rows=rows)
