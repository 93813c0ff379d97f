"""What every answer has: the document that its command prints as JSON, and a short text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar


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


def summary_text(lines: Iterable[str]) -> str:
    """Lines below a title."""
    title, *others = lines
    return "\n".join([title, *(f"  {line}" for line in others)])
