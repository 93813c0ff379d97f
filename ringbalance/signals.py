"""How a run is asked to end: SIGTERM is an interrupt like Ctrl-C, and a repeated one is the same request."""

from __future__ import annotations

import signal
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


class _Interrupt:
    """A signal handler that raises KeyboardInterrupt, but not in the midst of tidying up after one."""

    def __init__(self) -> None:
        self._last = -_SAME

    def __call__(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if now - self._last >= _SAME:
            self._last = now
            signal.default_int_handler(number, frame)


@contextmanager
def interrupts() -> Iterator[None]:
    """While this lasts, SIGTERM raises KeyboardInterrupt as SIGINT does.

    A signal that is ignored stays so, as SIGINT is in a shell's background job; outside the main thread,
    where Python takes no handlers, nothing changes.
    """
    handler = _Interrupt()
    taken = []
    if threading.current_thread() is threading.main_thread():
        taken = [number for number in _REQUESTS if signal.getsignal(number) in _USUAL]
    before = {number: signal.signal(number, handler) for number in taken}
    try:
        yield
    finally:
        for number, usual in before.items():
            signal.signal(number, usual)
