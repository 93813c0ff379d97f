"""How a run is asked to end: SIGTERM is an interrupt like Ctrl-C, and a repeated one is the same request."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

_REQUESTS: Final = (signal.SIGINT, signal.SIGTERM)
_USUAL: Final = (signal.default_int_handler, signal.SIG_DFL)
_SAME: Final = 1.0
"""s within which another signal is taken for the same request: `timeout` sends two."""
_AGAIN: Final = 0.01
"""s after which a request that was lost, or would be, is made again."""
_WHOLE: Final = ("importlib._bootstrap", "multiprocessing.popen_")
"""How the modules begin in which Python loads a module or starts a process."""


class _Interrupt:
    """A signal handler that raises KeyboardInterrupt, but not in the midst of tidying up after one.

    Python drops an exception that is raised in a finaliser or in a weak reference's callback, and with it an
    interrupt that happens to arrive there; `unraisable` is called instead, and sends the signal again.
    A module that is being loaded may catch whatever is raised, and a process that is being started complains
    when its parent falls silent: there the signal waits until that is done. To block it would not do, since
    another thread may take it, and Python raises in the main one all the same.
    """

    def __init__(self) -> None:
        self._last = -_SAME
        self._number = int(signal.SIGINT)
        self._usual_hook = sys.unraisablehook

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if _is_amid(_WHOLE, frame):
            self._repeat(number)
            return
        now = time.monotonic()
        if now - self._last >= _SAME:
            self._last, self._number = now, number
            signal.default_int_handler(number, frame)

    def unraisable(self, dropped: sys.UnraisableHookArgs) -> None:
        """Take the place of `sys.unraisablehook`."""
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            self._usual_hook(dropped)
            return
        self._last = -_SAME
        self._repeat(self._number)

    def _repeat(self, number: int) -> None:
        again = threading.Timer(_AGAIN, os.kill, (os.getpid(), number))
        again.daemon = True
        again.start()


def _is_amid(modules: tuple[str, ...], frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith(modules):
            return True
        frame = frame.f_back
    return False


@contextmanager
def interrupts() -> Iterator[None]:
    """While this lasts, SIGTERM raises KeyboardInterrupt as SIGINT does, and none is lost.

    A signal that is ignored stays so, as SIGINT is in a shell's background job; outside the main thread,
    where Python takes no handlers, nothing changes.
    """
    handler = _Interrupt()
    taken = []
    if threading.current_thread() is threading.main_thread():
        taken = [number for number in _REQUESTS if signal.getsignal(number) in _USUAL]
    before = {number: signal.signal(number, handler) for number in taken}
    usual_hook = sys.unraisablehook
    if taken:
        sys.unraisablehook = handler.unraisable
    try:
        yield
    finally:
        sys.unraisablehook = usual_hook
        for number, usual in before.items():
            signal.signal(number, usual)
