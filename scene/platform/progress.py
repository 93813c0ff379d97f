"""Progress of a command on standard error: a bar on a terminal, elsewhere a line now and then.

A run shorter than ten seconds that writes to no terminal says nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
from time import monotonic
from typing import Final

from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn

from ringbalance.scene.platform.terminal import messages_console

FIRST_LINE: Final = 10.0
"""Seconds without a terminal before the first line."""
NEXT_LINE: Final = 30.0
"""Seconds from one line to the next."""


class Activity:
    """What a command is doing at present; lives inside one `activity`.

    Args: `text`: what it does first. `bar`: the display on a terminal.
    """

    def __init__(self, text: str, bar: Progress) -> None:
        self.text = text
        self._bar = bar
        self._task: TaskID = bar.add_task(escape(text), total=None)

    def show(self, text: str, *, done: float | None = None, total: float | None = None) -> None:
        """Replace what is shown.

        Args: `text`: the activity, with its numbers. `done`: amount of work that is done. `total`: amount of
            work altogether, in the same unit; None where it is not known.
        """
        self.text = text
        self._bar.update(self._task, description=escape(text), completed=done, total=total)


@contextmanager
def activity(command: str, text: str) -> Iterator[Activity]:
    """Show what a command is doing while a block runs.

    Args: `command`: its name, which begins each line. `text`: what it does first.
    Yields: The activity, to be kept up to date.
    """
    console = messages_console()
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        shown, ended = Activity(text, bar), Event()
        lines = Thread(target=_write_lines, args=(command, shown, ended), daemon=True)
        if not console.is_terminal:
            lines.start()
        try:
            yield shown
        finally:
            ended.set()


def _write_lines(command: str, shown: Activity, ended: Event) -> None:
    start, wait = monotonic(), FIRST_LINE
    while not ended.wait(wait):
        try:
            sys.stderr.write(f"{command}: {shown.text} ({monotonic() - start:.0f} s)\n")
            sys.stderr.flush()
        except (AttributeError, OSError, ValueError):  # closed, or none at all: nobody reads it
            return
        wait = NEXT_LINE
