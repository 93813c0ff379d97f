"""An interrupt ends a run wherever it arrives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

DROPPED = """
import os, signal, sys, time, weakref
from ringbalance.signals import interrupts

class Thing:
    def __del__(self):
        if {in_finaliser}:
            os.kill(os.getpid(), signal.{name})
            for _ in range(1000): pass

def ends():
    thing = Thing()
    def gone(_):
        if not {in_finaliser}:
            os.kill(os.getpid(), signal.{name})
            for _ in range(1000): pass
    kept = weakref.ref(thing, gone)
    del thing
    time.sleep(20)

signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    with interrupts():
        ends()
except KeyboardInterrupt:
    sys.exit(130)
"""


def ended(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=15)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("in_finaliser", [True, False])
def test_an_interrupt_that_python_drops_is_made_again(name: str, in_finaliser: bool) -> None:
    program = DROPPED.format(name=name, in_finaliser=in_finaliser)
    run = ended(program)
    assert (run.returncode, run.stderr) == (130, "")


def test_other_dropped_errors_are_shown_as_ever() -> None:
    program = """
from ringbalance.signals import interrupts
class Thing:
    def __del__(self):
        raise ValueError("of the finaliser")
with interrupts():
    Thing()
"""
    assert "of the finaliser" in ended(program).stderr


def test_an_interrupt_waits_for_a_module_that_would_catch_it(tmp_path: Path) -> None:
    (tmp_path / "catching.py").write_text(
        "import os, signal\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\n    for _ in range(1000): pass\n"
        "except:\n    pass\n"
    )
    program = """
import signal, sys, time
from ringbalance.signals import interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, sys.argv[1])
try:
    with interrupts():
        import catching
        time.sleep(20)
except KeyboardInterrupt:
    sys.exit(130)
"""
    run = ended(program, str(tmp_path))
    assert (run.returncode, run.stderr) == (130, "")


def test_an_interrupt_waits_for_a_process_that_is_being_started() -> None:
    """Another thread takes the signal, as the timer's or a library's does."""
    program = """
import os, signal, sys, time
from multiprocessing import util
from threading import Event, Thread
from ringbalance.scene.platform.processes import Workers
from ringbalance.signals import interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)
start, begun = util.spawnv_passfds, Event()
def send():
    begun.wait()
    os.kill(os.getpid(), signal.SIGINT)
sender = Thread(target=send, daemon=True)
sender.start()
def interrupted(*given):
    made = start(*given)
    begun.set()
    sender.join()
    return made
try:
    with interrupts(), Workers(1) as pool:
        util.spawnv_passfds = interrupted
        pool.submit(time.sleep, 20).result()
except KeyboardInterrupt:
    sys.exit(130)
"""
    run = ended(program)
    assert (run.returncode, run.stderr) == (130, "")
