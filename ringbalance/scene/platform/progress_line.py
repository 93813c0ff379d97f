"""Line with the progress of a Python function, updated in place where possible."""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import monotonic
from typing import Any, Final

_UPDATE_INTERVAL_S: Final = 0.05
"""Time between texts that replace each other."""
_LINE_INTERVAL_S: Final = 30.0
"""Time between lines in a file or a pipe, and until the first."""


class ProgressLine:
    """Line with the progress of a function, for the argument `progress` of any function.

    A notebook and a terminal keep one line up to date; elsewhere a line is written every half minute, so that
    a short call writes nothing. All of it goes to standard error, or into the cell's output.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> run = rb.simulate(scene, progress=rb.ProgressLine())
    """

    def __init__(self) -> None:
        ipython = sys.modules.get("IPython")
        self._update: Callable[..., Any] | None = None
        if ipython is not None and hasattr(ipython.get_ipython(), "kernel"):
            # Line that replaces the previous one in the output of a notebook cell.
            handle = ipython.display.display({"text/plain": ""}, raw=True, display_id=True)
            self._update = handle.update
        in_place = self._update is not None or sys.stderr.isatty()
        self._wait = _UPDATE_INTERVAL_S if in_place else _LINE_INTERVAL_S
        self._next = monotonic() + (0.0 if in_place else _LINE_INTERVAL_S)
        self._end = "" if in_place else "\n"

    def __call__(self, *how_far: object) -> None:
        """Show the progress that a function reports: a text, amounts done and in total, or both."""
        if monotonic() < self._next:
            return
        self._next = monotonic() + self._wait
        words = [getattr(each, "text", str(each)) for each in how_far if not isinstance(each, int | float)]
        amounts = [f"{each:.4g}" for each in how_far if isinstance(each, int | float)]
        text = ": ".join([*words, *([" of ".join(amounts)] if amounts else [])])
        if self._update is not None:
            self._update({"text/plain": text}, raw=True)
        else:
            sys.stderr.write(f"{text}{self._end}" if self._end else f"\r\x1b[K{text}")
            sys.stderr.flush()
