"""Output of a command: a console for its results, a console for messages, progress and the time taken.

Progress goes to standard error: a bar on a terminal, elsewhere a line from time to time; a run shorter than
ten seconds without a terminal writes none.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Any, Final

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn
from rich.text import Text

from ringbalance.scene.platform.display import LOG, display, shown_by

FIRST_LINE_S: Final = 10.0
"""Time before the first line without a terminal."""
NEXT_LINE_S: Final = 30.0
_LOG_INTERVAL_S: Final = 1.0
_UNBROKEN: Final = 10_000
"""Columns of an output that is no terminal: wider than any table."""
_LOADED: Final = time.perf_counter()
_STAT: Final = Path("/proc/self/stat")
_START_FIELD: Final = 19
"""Index of the start time, ticks since the machine's start, among the fields after the bracketed name."""


class _Terminal(Console):
    """A rich console over standard output (results) or standard error (messages)."""

    def on_broken_pipe(self) -> None:
        """Stop printing messages without a reader; rich would discard the results too.

        Raises: BrokenPipeError: the reader of the results went away.
        """
        self.quiet = True
        if not self.stderr:
            raise BrokenPipeError

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; results in a file or a pipe without the blanks at the ends of a table's lines."""
        if self.is_terminal or self.stderr:
            super().print(*objects, **options)
            return
        with self.capture() as captured:
            super().print(*objects, **options)
        self.file.write("\n".join(line.rstrip(" ") for line in captured.get().split("\n")))
        self.file.flush()

    def render_str(self, text: str, **options: Any) -> Text:
        """Text as the stream writes it, so that columns are as wide as their texts."""
        errors = getattr(self.file, "errors", None) or "strict"
        if not text.isascii() and errors not in {"strict", "surrogateescape"}:
            text = text.encode(self.encoding, errors).decode(self.encoding, "surrogateescape")
        return super().render_str(text, **options)


def results_console() -> Console:
    """Standard output, for results; in a file or a pipe nothing is broken into lines, unless COLUMNS says how
    wide they are.
    """
    console = _Terminal()
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _UNBROKEN
    return console


def _messages_console() -> Console:
    """Standard error, for progress and messages; silent where the command line asks for quiet."""
    return _Terminal(stderr=True, quiet=display().quiet)


def print_message(text: str) -> None:
    """Write to standard error, unless the command line asks for quiet, and to the log."""
    LOG.info("%s", text)
    _messages_console().print(text, markup=False, highlight=False, soft_wrap=True)


def print_error(text: str) -> None:
    """Write to standard error and to the log."""
    LOG.error("%s", text)
    _Terminal(stderr=True).print(text, markup=False, highlight=False, soft_wrap=True)


class Activity:
    """Present activity of a command, within a block of `activity`.

    Args: `text`: first activity. `bar`: display on a terminal.
    """

    def __init__(self, text: str, bar: Progress) -> None:
        self.text = text
        self._logged = monotonic()
        self._bar = bar
        self._task: TaskID = bar.add_task(escape(text), total=None)

    def show(self, text: str, *, done: float | None = None, total: float | None = None) -> None:
        """Replace the displayed activity.

        Args: `text`: the activity, with its numbers. `done`: amount of work that is done. `total`: amount of
            work altogether, in the same unit; None where it is not known.
        """
        self.text = text
        if monotonic() > self._logged + _LOG_INTERVAL_S:
            LOG.info("%s", text)
            self._logged = monotonic()
        self._bar.update(self._task, description=escape(text), completed=done, total=total)


@contextmanager
def activity(command: str, text: str) -> Iterator[Activity]:
    """Show what a command is doing while a block runs.

    Args: `command`: name that begins each line. `text`: first activity.
    Yields: The activity, to be updated by the block.
    """
    LOG.info("%s: %s", command, text)
    console, quiet = _messages_console(), display().quiet
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        shown, ended = Activity(text, bar), Event()
        lines = Thread(target=_write_lines, args=(command, shown, ended), daemon=True)
        if not (quiet or console.is_terminal):
            lines.start()
        try:
            with shown_by(shown):
                yield shown
        finally:
            ended.set()


def _write_lines(command: str, shown: Activity, ended: Event) -> None:
    start, wait = monotonic(), FIRST_LINE_S
    while not ended.wait(wait):
        try:
            sys.stderr.write(f"{command}: {shown.text} ({monotonic() - start:.0f} s)\n")
            sys.stderr.flush()
        except (AttributeError, OSError, ValueError):  # closed, or none at all: no output
            return
        wait = NEXT_LINE_S


def since_start() -> float:
    """Wall time since this process began, s, or, if unknown, since this module was loaded."""
    try:
        fields = _STAT.read_text(encoding="utf-8").rpartition(")")[2].split()
        begun = int(fields[_START_FIELD]) / os.sysconf("SC_CLK_TCK")
        return time.clock_gettime(time.CLOCK_BOOTTIME) - begun
    except (OSError, ValueError, IndexError, AttributeError):
        return time.perf_counter() - _LOADED
