"""How much a command shows, and where it keeps a log: set once for a command line, read where it prints."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

LOG: Final = logging.getLogger("ringbalance")
"""Progress and messages as information, errors as errors; nothing is written unless a handler is added."""
LOG.addHandler(logging.NullHandler())
_FORMAT: Final = "%(asctime)s %(levelname)s %(message)s"


@dataclass(frozen=True, kw_only=True)
class _Display:
    """How much of a result and of the work is shown."""

    brief: bool = False
    """About five lines in place of a result's tables."""
    quiet: bool = False
    """Neither progress nor messages."""


_DISPLAY: Final[ContextVar[_Display]] = ContextVar("display")


def display() -> _Display:
    """What holds for the command line that is running; all is shown outside one."""
    return _DISPLAY.get(_Display())


class Progress(Protocol):
    """What a command does at present, as it is shown."""

    text: str

    def show(self, text: str) -> None:
        """Replace the text."""


_PROGRESS: Final[ContextVar[Progress]] = ContextVar("progress")


@contextmanager
def shown_by(progress: Progress) -> Iterator[None]:
    """Let what a block announces from its depths be shown."""
    token = _PROGRESS.set(progress)
    try:
        yield
    finally:
        _PROGRESS.reset(token)


@contextmanager
def announced(text: str) -> Iterator[None]:
    """Show a text while a block runs, and then what was shown before; nothing outside a command."""
    progress = _PROGRESS.get(None)
    before = progress.text if progress else ""
    if progress:
        progress.show(text)
    try:
        yield
    finally:
        if progress:
            progress.show(before)


@contextmanager
def displayed(*, brief: bool, quiet: bool, log: Path | None) -> Iterator[None]:
    """Let a block show this much, and add what happens in it to a file.

    Raises: OSError: the file cannot be written.
    """
    token = _DISPLAY.set(_Display(brief=brief, quiet=quiet))
    handler = None if log is None else logging.FileHandler(log, encoding="utf-8")
    if handler is not None:
        handler.setFormatter(logging.Formatter(_FORMAT))
        LOG.addHandler(handler)
        LOG.setLevel(logging.INFO)
    try:
        yield
    except Exception as error:
        LOG.error("%s", error)
        raise
    finally:
        _DISPLAY.reset(token)
        if handler is not None:
            LOG.removeHandler(handler)
            LOG.setLevel(logging.NOTSET)
            handler.close()
