"""A sweep that is killed again and again while its store loses files ends with the serial sweep's table."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import ringbalance as rb
from ringbalance.cli import main

POINTS = ("--vary", "tube.bore=0.8mm:2mm:10", "gas.pressure=0.4MPa:0.8MPa:6")
SCENE = str(rb.bundled_scene("liquid_ring_paper"))
KILLS = 8

pytestmark = [
    pytest.mark.faults,
    pytest.mark.skipif(os.name != "posix", reason="kills a session with all its processes"),
]


def command(out: Path) -> list[str]:
    options = ["--runs", "1", "--check", "0", "--no-figures", "--workers", "2"]
    return [SCENE, *POINTS, "--out", str(out), *options]


def entries(out: Path) -> dict[Path, int]:
    """Whole entries, with the time at which each was written."""
    return {path: path.stat().st_mtime_ns for path in (out / "store").glob("??/*") if len(path.name) == 64}


def test_a_killed_sweep_ends_with_the_serial_table(tmp_path: Path) -> None:
    chance = random.Random(3)
    assert main(["sweep", *command(tmp_path / "serial")[:-2], "--workers", "1"]) == 0
    out = tmp_path / "killed"
    kept: dict[Path, int] = {}
    damaged: dict[Path, int] = {}
    for kill in range(KILLS):
        words = [sys.executable, "-m", "ringbalance", "sweep", *command(out)]
        child = subprocess.Popen(words, start_new_session=True)
        deadline = time.monotonic() + 60
        more = chance.randint(1, 8)
        while child.poll() is None and len(entries(out)) < len(kept) + more and time.monotonic() < deadline:
            time.sleep(0.05 * chance.random())
        # Workers that outlive it would go on writing what the next one computes.
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()
        # A damaged entry stands there until the sweep comes to it.
        now = {path: at for path, at in entries(out).items() if damaged.get(path) != at}
        # What was whole is not written again.
        assert {path: now.get(path) for path in kept} == kept
        lost = [path for path in now if chance.random() < 0.05]
        for path in lost:
            path.unlink() if kill % 2 else path.write_bytes(path.read_bytes()[:-1] + b"0")
        damaged |= {path: path.stat().st_mtime_ns for path in lost if path.exists()}
        kept = {path: at for path, at in now.items() if path not in lost}
    assert main(["sweep", *command(out)]) == 0
    whole = entries(out)
    assert {path: whole[path] for path in kept} == kept
    assert (out / "table.csv").read_bytes() == (tmp_path / "serial" / "table.csv").read_bytes()
