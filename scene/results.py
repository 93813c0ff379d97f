"""What every answer has: the document that its command prints as JSON, and a short text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from operator import attrgetter
from typing import Any, ClassVar


class CommandResult:
    """Base of what the commands, and the functions of the same names, answer with."""

    _document: ClassVar[str]
    """Function that lays the result out as a document, "module:name"; it is loaded when it is first used."""
    _summary: ClassVar[str]
    """Function that gives its main lines, the title first."""

    def to_dict(self) -> dict[str, Any]:
        """The document that the command of the result prints with `--json`."""
        document: dict[str, Any] = _loaded(self._document)(self)
        return document

    def __repr__(self) -> str:
        """About five lines: what it is, its main numbers with units, and the verdict."""
        return summary_text(_loaded(self._summary)(self))


def summary_text(lines: Iterable[str]) -> str:
    """Lines below a title."""
    title, *others = lines
    return "\n".join([title, *(f"  {line}" for line in others)])


def _loaded(place: str) -> Any:
    module, _, name = place.partition(":")
    return attrgetter(name)(import_module(module))
