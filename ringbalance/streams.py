"""Standard streams of the process: in any encoding, closed, full, or with a reader that goes away."""

from __future__ import annotations

import codecs
import io
import os
import re
import sys
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, BinaryIO, Final, TextIO, cast

from ringbalance import plain_text

if TYPE_CHECKING:
    from typing_extensions import Buffer

LAST_STANDARD: Final = 2
WITHOUT_DOCSTRINGS: Final = 2
NARROWEST: Final = 20
WIDEST: Final = 10_000


class _NamedFile(io.FileIO):
    """A standard stream whose errors name it, as those of any other file do."""

    def __init__(self, descriptor: int, title: str) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self.title = title

    def write(self, data: Buffer) -> int:
        """Write bytes.

        Returns: How many were written.
        Raises: OSError: the stream cannot be written; its `filename` is the stream's title.
        """
        try:
            return super().write(data)
        except OSError as error:
            error.filename = self.title
            raise


def prepare_streams() -> str:
    """Make standard output and error safe to write to, whatever the shell made of them.

    Returns: Why results could not be written; empty when they can.
    """
    closed = sys.stdout is None
    _occupy_closed_descriptors()
    codecs.register_error(plain_text.ERRORS, plain_text.replace)
    sys.stdout = _tolerant(sys.stdout, "standard output")
    sys.stderr = _tolerant(sys.stderr, "standard error")
    return "standard output is closed; nothing was computed" if closed else ""


def interpreter_error() -> str:
    """Why this interpreter cannot run the commands. Returns: One sentence; empty when it can."""
    if sys.flags.optimize < WITHOUT_DOCSTRINGS:
        return ""
    return "needs docstrings, which PYTHONOPTIMIZE=2 (python -OO) removes: unset it or set it to 1"


def drop_unusable_size(environment: MutableMapping[str, str]) -> None:
    """Remove a terminal size that no table fits into: the actual size, or 80 columns, is then used.

    Args: `environment`: of the process; COLUMNS below 20 and LINES below 1 are removed, and what is no
        number.
    """
    for name, least in (("COLUMNS", NARROWEST), ("LINES", 1)):
        value = environment.get(name, "")
        if not (re.fullmatch("[0-9]{1,6}", value) and least <= int(value) <= WIDEST):
            environment.pop(name, None)


def discard_unwritten() -> None:
    """Discard what a stream could not take: the interpreter would flush it again at its end, and complain."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _redirect_to_nowhere(stream)


def _occupy_closed_descriptors() -> None:
    """Put the null device where a standard stream is closed: no file opened later takes its number."""
    descriptor = os.open(os.devnull, os.O_RDWR)
    while descriptor <= LAST_STANDARD:
        os.set_inheritable(descriptor, True)
        descriptor = os.open(os.devnull, os.O_RDWR)
    os.close(descriptor)


def _tolerant(stream: TextIO | None, title: str) -> TextIO:
    """The stream in any encoding, its errors naming it; the null device in place of a closed one."""
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors=plain_text.ERRORS)
        # With PYTHONUNBUFFERED there is no buffer in between.
        if type(getattr(stream.buffer, "raw", stream.buffer)) is io.FileIO:
            return _over_named_file(stream, title)
    return stream


def _over_named_file(stream: io.TextIOWrapper, title: str) -> TextIO:
    named = _NamedFile(stream.fileno(), title)
    return io.TextIOWrapper(
        cast(BinaryIO, named if isinstance(stream.buffer, io.FileIO) else io.BufferedWriter(named)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _redirect_to_nowhere(stream: TextIO) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
