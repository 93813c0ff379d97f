"""Worker processes: reporting is left to this process; workers end when it ends, in whatever way."""

from __future__ import annotations

import gc
import logging
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    InvalidStateError,
    ProcessPoolExecutor,
    as_completed,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from types import TracebackType
from typing import Final, ParamSpec, TypeVar
from weakref import WeakSet

from ringbalance.scene.platform.memory import COLLECTED_AT

_P = ParamSpec("_P")
_R = TypeVar("_R")

_THREADS: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_LOG: Final = logging.getLogger("ringbalance")
_WORKER_ENDED: Final = (
    "ringbalance: a worker process was ended by the system, probably for lack of memory; its work is done "
    "again in this process. Should that be ended too, close other programs and run again"
)
_BROKEN: Final[WeakSet[Executor]] = WeakSet()
"""Executors for which the loss of a worker was already reported."""
_ALONE: Final = "ringbalance: no further process can be used here (%s); one process does all the work"


class _Cancellable(Future[_R]):
    """A future that stays cancelled when the pool breaks, as from Python 3.12 on.

    In earlier versions the error of a lost worker ends the pool's thread at the first cancelled future, with
    a traceback, and waiting for later futures never ends.
    """

    def set_exception(self, exception: BaseException | None) -> None:
        """Set the error of a worker, unless the future was cancelled."""
        try:
            super().set_exception(exception)
        except InvalidStateError:
            if not self.cancelled():
                raise


class Workers(ProcessPoolExecutor):
    """A pool of new processes, one thread each, which are ended at once when the `with` block is left.

    Args: `count`: number of processes, which start when there is work for them.
    """

    def __init__(self, count: int) -> None:
        # When this process is killed, multiprocessing removes its semaphores; its warning is suppressed.
        with _environment({"PYTHONWARNINGS": "ignore::UserWarning:multiprocessing.resource_tracker"}):
            super().__init__(count, mp_context=get_context("spawn"), initializer=_begin)

    def submit(self, fn: Callable[_P, _R], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_R]:
        """Have a worker call a function of an importable module.

        Returns: Its future; where no worker is left, one with the error BrokenProcessPool.
        """
        with _quiet_start():
            try:
                future = super().submit(fn, *args, **kwargs)
            except (BrokenProcessPool, OSError) as error:
                lost: Future[_R] = Future()
                lost.set_exception(BrokenProcessPool(str(error)))
                return lost
        future.__class__ = _Cancellable
        return future

    def result(self, future: Future[_R], again: Callable[[], _R]) -> _R:
        """Result of a worker, or of this process if the system ended the worker.

        A worker that was killed for memory leaves more of it to this process, and one process at a time needs
        less than several in parallel; so a report is not lost.
        Args: `future`: as returned by `submit`. `again`: does the same work in this process.
        Returns: The result; with a note on standard error where the work was repeated.
        """
        return _result(self, future, again)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the workers: unfinished results are no longer needed."""
        # From Python 3.14 on this is `kill_workers`. An interrupt may come between the start of a process and
        # its entry in the pool's list: then those that multiprocessing knows are ended, too.
        started = set((self._processes or {}).values())
        for process in started if error is None else started.union(active_children()):
            process.kill()
        self.shutdown(cancel_futures=True)


def dealt(executor: Executor, calls: Sequence[Callable[[], _R]]) -> Iterator[tuple[int, _R]]:
    """Indices and results of calls as they finish; calls of a lost worker are repeated in this process.

    Args: `executor`: any, its workers may be on other machines. `calls`: can be pickled.
    """
    numbers: dict[Future[_R], int] = {}
    try:
        for number, call in enumerate(calls):
            try:
                future = executor.submit(call)
            except BrokenExecutor as error:
                future = Future()
                future.set_exception(error)
            numbers[future] = number
        for future in as_completed(list(numbers)):
            yield numbers[future], _result(executor, future, calls[numbers[future]])
    finally:
        # The rest is not needed when the caller stops early.
        for future in numbers:
            future.cancel()


def _result(executor: Executor, future: Future[_R], again: Callable[[], _R]) -> _R:
    try:
        return future.result()
    except BrokenExecutor:
        if executor not in _BROKEN:
            _BROKEN.add(executor)
            _LOG.warning(_WORKER_ENDED)
    return again()


@contextmanager
def beside(
    workers: int | Workers | None, *, loading: Callable[[], object] | None = None
) -> Iterator[Workers | None]:
    """Workers beside this process, for so many processes in all; None for one process.

    None, too, with a message on standard error, on a system without semaphores for processes (no writable
    /dev/shm, as in some containers).
    Args: `workers`: existing workers are used and not ended afterwards. `loading`: called by new workers at
    once, while this process continues.
    """
    if workers is None or workers == 1 or isinstance(workers, Workers):
        yield None if isinstance(workers, int) else workers
        return
    try:
        pool = Workers(workers - 1)
    except (OSError, ImportError, NotImplementedError) as error:
        _LOG.warning(_ALONE, error)
        yield None
        return
    with pool as crew:
        if loading is not None:
            for _ in range(workers - 1):
                crew.submit(loading)
        yield crew


def end_with(gone: Callable[[], object]) -> None:
    """End this process as soon as another ends. Args: `gone`: returns when the other process has ended."""

    def watch() -> None:
        gone()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _begin() -> None:
    """Prepare a worker."""
    gc.set_threshold(*COLLECTED_AT)
    parent = parent_process()
    if parent is not None:
        end_with(parent.join)
    # The signal was blocked at the start, see `_quiet_start`; now the pool can end this worker.
    _mask("SIG_UNBLOCK", signal.SIGTERM)


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Let processes that a block starts use one thread and leave a terminal's interrupt to this process."""
    with _environment(dict.fromkeys(_THREADS, "1")):
        _mask("SIG_BLOCK", signal.SIGINT, signal.SIGTERM)
        try:
            yield
        finally:
            _mask("SIG_UNBLOCK", signal.SIGINT, signal.SIGTERM)


@contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for processes that a block starts."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _mask(how: str, *signals: signal.Signals) -> None:
    """Change the signals that this thread and processes started by it block; no effect on Windows."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(getattr(signal, how), signals)
