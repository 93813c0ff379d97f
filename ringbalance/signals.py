"""Requests to end a run: SIGTERM is an interrupt like Ctrl-C, and a repeated signal is the same request."""

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
_SAME_REQUEST_S: Final = 1.0
"""Time within which another signal is the same request: `timeout` sends two."""
_RETRY_S: Final = 0.01
"""Time after which a request that was lost, or would be, is repeated."""
_UNINTERRUPTED_MODULES: Final = ("importlib._bootstrap", "multiprocessing.popen_")
"""Prefixes of the modules in which Python loads a module or starts a process."""


class _Interrupt:
    """A signal handler that raises KeyboardInterrupt, but not in the midst of tidying up after one.

    Python drops an exception that is raised in a finaliser or in a weak reference's callback, and with it an
    interrupt that happens to arrive there; `unraisable` is called instead, and sends the signal again.
    A module that is being loaded may catch whatever is raised, and a process that is being started complains
    when its parent falls silent: in both cases the signal is sent again later. Blocking it does not help:
    another thread may take it, and Python raises in the main thread all the same.
    """

    def __init__(self) -> None:
        self._last = -_SAME_REQUEST_S
        self._number = int(signal.SIGINT)
        self._usual_hook = sys.unraisablehook

    def __call__(self, number: int, frame: FrameType | None) -> None:
        caller = frame
        while caller is not None:
            if caller.f_globals.get("__name__", "").startswith(_UNINTERRUPTED_MODULES):
                self._repeat(number)
                return
            caller = caller.f_back
        now = time.monotonic()
        if now - self._last >= _SAME_REQUEST_S:
            self._last, self._number = now, number
            signal.default_int_handler(number, frame)

    def unraisable(self, dropped: sys.UnraisableHookArgs) -> None:
        """Take the place of `sys.unraisablehook`."""
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            self._usual_hook(dropped)
            return
        self._last = -_SAME_REQUEST_S
        self._repeat(self._number)

    def _repeat(self, number: int) -> None:
        again = threading.Timer(_RETRY_S, os.kill, (os.getpid(), number))
        again.daemon = True
        again.start()


@contextmanager
def interrupts() -> Iterator[None]:
    """Let SIGTERM raise KeyboardInterrupt as SIGINT does, and lose neither, within a `with` block.

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
