"""The pool of workers: one thread each, ended at once, and none missed when the system ends it."""

from __future__ import annotations

import errno
import gc
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from ringbalance.scene.platform.display import displayed
from ringbalance.scene.platform.memory import seldom_collected
from ringbalance.scene.platform.processes import Workers, beside, dealt


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


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize("quiet", [False, True])
def test_a_command_goes_on_without_its_worker_and_says_so_once(
    quiet: bool, log: bool, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """On standard error, also beside a log; the same pool is asked again after its worker was ended."""
    here = os.getpid()
    file = tmp_path / "log" if log else None
    with displayed(brief=False, quiet=quiet, log=file), Workers(1) as pool:
        ended = [partial(_ended_unless, here), partial(_ended_unless, here)]
        assert dict(dealt(pool, ended)) == {0: here, 1: here}
        assert dict(dealt(pool, ended)) == {0: here, 1: here}
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("a worker process was ended by the system") == (not quiet)
    assert file is None or file.read_text().count("WARNING ringbalance: a worker process") == 1


def _ended_unless(process: int) -> int:
    """End this process, unless it is another one."""
    if os.getpid() != process:
        signal.raise_signal(signal.SIGKILL)
    return os.getpid()


def test_without_semaphores_one_process_does_the_work(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """As without a writable /dev/shm: the pool cannot be made."""

    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("multiprocessing.synchronize.SemLock.__init__", refused)
    with beside(3) as pool:
        assert pool is None
    assert "Permission denied" in caplog.messages[0]


def test_a_process_that_cannot_be_started_is_a_lost_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    with Workers(1) as pool:
        monkeypatch.setattr("multiprocessing.context.SpawnProcess.start", refused)
        assert pool.result(pool.submit(os.getpid), lambda: -1) == -1


def test_leaving_waits_for_nobody() -> None:
    with Workers(1) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
        pool.submit(time.sleep, 60)
        start = time.perf_counter()
    assert time.perf_counter() - start < 5


def test_a_worker_collects_garbage_more_seldom() -> None:
    with Workers(1) as pool:
        assert pool.submit(gc.get_threshold).result()[0] > gc.get_threshold()[0]


def test_a_block_leaves_the_collector_as_it_was() -> None:
    before = gc.get_threshold()
    with seldom_collected():
        assert gc.get_threshold()[0] > before[0]
    assert gc.get_threshold() == before


def test_the_time_since_the_start_holds_the_interpreter_s() -> None:
    code = "import time; a = time.perf_counter(); "
    code += "from ringbalance.scene.platform.terminal import since_start; "
    code += "time.sleep(0.3); print(since_start(), time.perf_counter() - a)"
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    whole = time.perf_counter() - start
    told, within = map(float, done.stdout.split())
    assert 0.3 <= within - 0.02 <= told <= whole + 0.02
