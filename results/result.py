"""What every answer is: a title, quantities, findings, and the document that its command prints as JSON."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, Final

from ringbalance.results.findings import Finding
from ringbalance.results.numbers import plain
from ringbalance.results.render import html
from ringbalance.results.rows import Quantity
from ringbalance.scene.origins import summary_text

_MAIN: Final = 3
"""Quantities in a short text."""
_MOST: Final = 10
"""In a notebook."""


class Result:
    """Base of what the commands, and the functions of the same names, answer with."""

    @property
    @abstractmethod
    def title(self) -> str:
        """What was computed for which scene."""

    @property
    @abstractmethod
    def quantities(self) -> tuple[Quantity, ...]:
        """The main ones first."""

    @property
    @abstractmethod
    def findings(self) -> tuple[Finding, ...]:
        """The verdict first."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The document that the command of the result prints with `--json`."""

    def rows(self) -> dict[str, Any]:
        """Quantities and findings as every such document has them."""
        return {
            "quantities": [each.document() for each in self.quantities],
            "findings": [each.document() for each in self.findings],
        }

    def lines(self) -> Iterator[str]:
        """About five lines: what it is, its main numbers with units, and the verdict."""
        yield self.title
        for each in self.quantities[:_MAIN]:
            yield f"{each.name} {plain(each.text)}"
        for finding in self.findings[:1]:
            yield finding.text

    def __repr__(self) -> str:
        """The same as one text."""
        return summary_text(self.lines())

    def _repr_html_(self) -> str:
        """For a notebook."""
        return html(self.title, findings=self.findings, quantities=self.quantities[:_MOST])


class CommandResult:
    """Base of what the commands, and the functions of the same names, answer with."""

    _deferred: ClassVar[Any]
    """Module that loads the functions below when they are first used."""
    _document: ClassVar[str]
    """Name of the one that lays the result out as a document."""
    _summary: ClassVar[str]
    """Name of the one that gives its main lines, the title first."""

    def to_dict(self) -> dict[str, Any]:
        """The document that the command of the result prints with `--json`."""
        document: dict[str, Any] = getattr(self._deferred, self._document)(self)
        return document

    def lines(self) -> Iterable[str]:
        """About five lines: what it is, its main numbers with units, and the verdict."""
        lines: Iterable[str] = getattr(self._deferred, self._summary)(self)
        return lines

    def __repr__(self) -> str:
        """The same as one text."""
        return summary_text(self.lines())
