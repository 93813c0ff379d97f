"""Extent of a command's output and its log file: set once for a command line, read where it prints."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

LOG: Final = logging.getLogger("ringbalance")
"""Log of progress and messages (info), of warnings and of errors; nothing is written without a handler."""
LOG.addHandler(logging.NullHandler())
_FORMAT: Final = "%(asctime)s %(levelname)s %(message)s"


@dataclass(frozen=True, kw_only=True)
class _Display:
    """Extent to which a result and the work are shown."""

    brief: bool = False
    """About five lines in place of a result's tables."""
    quiet: bool = False
    """Neither progress nor messages."""


class _Warnings(logging.Handler):
    """Shows warnings on standard error; errors are shown where they end the command."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write the text of a warning. Args: `record`: of the log."""
        if record.levelno == logging.WARNING:
            # Closed, or none at all: no output.
            with suppress(AttributeError, OSError, ValueError):
                sys.stderr.write(f"{record.getMessage()}\n")
                sys.stderr.flush()


_DISPLAY: Final[ContextVar[_Display]] = ContextVar("display")


def display() -> _Display:
    """Display of the command line that is running; all is shown outside one."""
    return _DISPLAY.get(_Display())


class Progress(Protocol):
    """Present activity of a command, as it is shown."""

    text: str

    def show(self, text: str) -> None:
        """Replace the text."""


_PROGRESS: Final[ContextVar[Progress]] = ContextVar("progress")


@contextmanager
def shown_by(progress: Progress) -> Iterator[None]:
    """Let texts that functions within a block announce be shown."""
    token = _PROGRESS.set(progress)
    try:
        yield
    finally:
        _PROGRESS.reset(token)


@contextmanager
def announced(text: str) -> Iterator[None]:
    """Show a text while a block runs, then the previous text again; without effect outside a command."""
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
    """Set the display of a block, and add its messages to a log file.

    Raises: OSError: the file cannot be written.
    """
    token = _DISPLAY.set(_Display(brief=brief, quiet=quiet))
    handlers: list[logging.Handler] = [] if quiet else [_Warnings()]
    if log is not None:
        handlers.append(logging.FileHandler(log, encoding="utf-8"))
        handlers[-1].setFormatter(logging.Formatter(_FORMAT))
        LOG.setLevel(logging.INFO)
    for handler in handlers:
        LOG.addHandler(handler)
    try:
        yield
    except Exception as error:
        LOG.error("%s", error)
        raise
    finally:
        _DISPLAY.reset(token)
        LOG.setLevel(logging.NOTSET)
        for handler in handlers:
            LOG.removeHandler(handler)
            handler.close()
