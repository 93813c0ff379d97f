"""The pool of workers: one thread each, ended at once, and none missed when the system ends it."""

from __future__ import annotations

import os
import signal
import time

import pytest

from ringbalance.scene.platform.processes import Workers


def test_the_work_of_an_ended_worker_is_done_again(caplog: pytest.LogCaptureFixture) -> None:
    with Workers(1) as pool:
        threads = pool.submit(os.getenv, "OMP_NUM_THREADS")
        assert pool.result(threads, lambda: None) == "1"
        killed, pending = pool.submit(signal.raise_signal, signal.SIGKILL), pool.submit(os.getpid)
        assert pool.result(killed, lambda: None) is None
        assert pool.result(pending, os.getpid) == os.getpid()
        assert pool.result(pool.submit(os.getpid), os.getpid) == os.getpid()
    (told,) = caplog.messages
    assert "lack of memory" in told
    assert "run again" in told


def test_leaving_waits_for_nobody() -> None:
    with Workers(1) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
        pool.submit(time.sleep, 60)
        start = time.perf_counter()
    assert time.perf_counter() - start < 5
