"""Signals kept back while compiled code hands its result to Python.

Numba turns a result that is an array or a named tuple into a Python object by calling Python functions, and
does not look whether such a call failed.  A signal that has arrived during the compiled call is handled in
the first of them: when its handler raises, as that of Ctrl-C does, an array ends in an error of the
interpreter, and a named tuple, with a null pointer in it, the process in a segmentation fault.  Handlers
therefore only take note during the call, and act after it.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Final

Handler = Callable[[int, FrameType | None], Any]

_NAMES: Final = (
    "SIGINT",
    "SIGTERM",
    "SIGHUP",
    "SIGBREAK",
    "SIGALRM",
    "SIGPROF",
    "SIGVTALRM",
    "SIGXCPU",
    "SIGUSR1",
    "SIGUSR2",
)
SIGNALS: Final = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
"""Whose handlers may raise: those that end a program or limit its time."""


class _Deferred:
    """A signal's handler that takes note; the one before it is called later."""

    def __init__(self, before: Handler) -> None:
        self.before = before
        self.arrived = False

    def __call__(self, _number: int, _frame: FrameType | None) -> None:
        """Take note."""
        self.arrived = True


@contextlib.contextmanager
def signals_deferred() -> Iterator[None]:
    """Let Python's signal handlers act at the end of the block, in the main thread; elsewhere none ever run.

    Handlers that are not Python functions, such as the system's own for SIGTERM, act at once as before.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    deferred: dict[int, _Deferred] = {}
    try:
        for number in SIGNALS:
            before = signal.getsignal(number)
            if callable(before) and not isinstance(before, _Deferred):
                deferred[number] = _Deferred(before)
                signal.signal(number, deferred[number])
        yield
    finally:
        _give_back(deferred)


def _give_back(deferred: dict[int, _Deferred]) -> None:
    """Put every handler back into its place, whatever those raise whose signal has arrived."""
    if not deferred:
        return
    number, handler = deferred.popitem()
    try:
        signal.signal(number, handler.before)
        if handler.arrived:
            handler.before(number, None)
    finally:
        _give_back(deferred)


@contextlib.contextmanager
def signals_live() -> Iterator[None]:
    """Within `signals_deferred`: let handlers act at once again, for Python code that takes long."""
    main = threading.current_thread() is threading.main_thread()
    found = {number: signal.getsignal(number) for number in SIGNALS} if main else {}
    deferred = {number: held for number, held in found.items() if isinstance(held, _Deferred)}
    try:
        for number, handler in deferred.items():
            signal.signal(number, handler.before)
        for number, handler in deferred.items():
            if handler.arrived:
                handler.arrived = False
                handler.before(number, None)
        yield
    finally:
        for number, handler in deferred.items():
            signal.signal(number, handler)
