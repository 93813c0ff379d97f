"""Runs that are killed: no process, no half output and no hidden folder stays behind."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ringbalance.scene import bundled_scene

pytestmark = [
    pytest.mark.faults,
    pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc to see every process"),
]

PAPER = str(bundled_scene("liquid_ring_paper"))
# A shell's background job is started with interrupts ignored, and its children inherit that.
READY = """
import signal, sys
from ringbalance.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)
print("ready", flush=True)
sys.exit(main())
"""
BUSY = """
import os, sys, time
from ringbalance.scene.platform.processes import Workers
from ringbalance.signals import interrupts

def work():
    with Workers(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 300).result()

if __name__ == "__main__":
    try:
        with interrupts():
            work()
    except KeyboardInterrupt:
        sys.exit(130)
"""
CODES = {signal.SIGKILL: -signal.SIGKILL, signal.SIGTERM: 130, signal.SIGINT: 130}


def living(mark: str) -> list[str]:
    """Processes that carry a mark in their environment, and are no mere entry of a table."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if mark.encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue
    return [command for command in found if command]


def wait_until(done: Callable[[], bool], *, limit: float) -> bool:
    """Whether something came true within some seconds."""
    end = time.monotonic() + limit
    while not done() and time.monotonic() < end:
        time.sleep(0.05)
    return done()


@pytest.mark.parametrize("group", [False, True])
@pytest.mark.parametrize("ending", CODES)
def test_a_worker_ends_with_its_parent(ending: signal.Signals, group: bool, tmp_path: Path) -> None:
    (tmp_path / "busy.py").write_text(BUSY)
    mark = f"RINGBALANCE_MARK={tmp_path}"
    child = subprocess.Popen(
        [sys.executable, str(tmp_path / "busy.py")],
        env={**os.environ, "RINGBALANCE_MARK": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    with child:
        assert child.stdout is not None
        assert child.stdout.readline().strip().isdigit()
        assert len(living(mark)) >= 2
        (os.killpg if group else os.kill)(child.pid, ending)
        start = time.monotonic()
        _, told = child.communicate(timeout=30)
    assert child.returncode == CODES[ending]
    assert wait_until(lambda: not living(mark), limit=5), living(mark)
    assert told == ""
    if ending is not signal.SIGKILL:
        assert time.monotonic() - start < 10


@pytest.mark.parametrize("number", range(6))
def test_a_killed_run_leaves_nothing(number: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    """At any time, by any signal, to the process or to its group; all of them write to one folder."""
    choose = random.Random(number)
    folder = tmp_path_factory.getbasetemp() / "kills"
    out = folder / "out"
    out.mkdir(parents=True, exist_ok=True)
    (out / "mine").write_text("mine")
    ending = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)[number % 3]
    mark = f"RINGBALANCE_MARK={folder}-{number}"
    child = subprocess.Popen(
        [sys.executable, "-c", READY, "plot", PAPER, "--out", str(out)],
        env={**os.environ, "RINGBALANCE_MARK": f"{folder}-{number}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with child:
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(choose.uniform(0.5, 3.5))
        (os.killpg if number % 2 else os.kill)(child.pid, ending)
        _, told = child.communicate(timeout=30)
    assert child.returncode == CODES[ending], told
    assert "Traceback" not in told
    assert "resource_tracker" not in told
    assert wait_until(lambda: not living(mark), limit=5), living(mark)
    assert [path.name for path in out.iterdir() if not path.name.startswith(".ringbalance-")] == ["mine"]
