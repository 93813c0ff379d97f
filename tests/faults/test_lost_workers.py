"""Commands whose worker the system ends, as for lack of memory: they go on, and say so once."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.scene.changes import file_text

pytestmark = [
    pytest.mark.faults,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see every process"),
]

PAPER = str(rb.bundled_scene("liquid_ring_paper"))
AT_WORK = 1.5
"""s of processor time, from which on a worker has started, and works."""
RESULTS: Any = {
    "sweep": ("runs", "verdicts", "best", "left_out"),
    "design": ("designs", "changes", "settings", "fraction", "effects", "front"),
    "verify": (),
}
"""Keys of the JSON document that do not depend on who computed; of `verify` the exit code says it."""


def lost_worker(parent: int) -> bool:
    """Whether a worker of a process was at work, and was ended."""
    for process in Path("/proc").iterdir():
        try:
            fields = (process / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            is_worker = int(fields[1]) == parent and b"spawn_main" in (process / "cmdline").read_bytes()
        except (OSError, IndexError):
            continue
        if is_worker and (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > AT_WORK:
            os.kill(int(process.name), signal.SIGKILL)
            return True
    return False


def words_of(command: str, folder: Path) -> list[str]:
    """A command line without the number of workers."""
    if command == "sweep":
        axes = ["tube.bore=0.8mm:2mm:10", "gas.pressure=0.4MPa:0.8MPa:6"]
        options = ["--runs", "16", "--check", "0", "--no-figures", "--no-intervals"]
        return [PAPER, "--vary", *axes, "--out", str(folder / "sweep"), *options]
    if command == "verify":
        flows = ["rotating_section", "manufactured_flow", "developing_flow"]
        return ["measured_smooth_tubes", "manufactured_2d", "manufactured_3d", "gravity_circle_2d", *flows]
    scene = rb.load_scene(rb.bundled_scene("spindle_design"))
    space = {"outer_radius": None, "axial_width": None, "pressure": None, "valves": None}
    widths = ["disc.axial_width=14mm,26mm,38mm", "tube.bore=0.9mm", "gas.pressure=0.4MPa"]
    changes = {f"design.{key}": value for key, value in {**space, "vary": widths}.items()}
    small = scene.with_values({**changes, "requirement.fraction": 0.7, "gas.conductance": "1.5 l/(s*bar)"})
    (folder / "small.toml").write_bytes(file_text(small, to=folder))
    return [str(folder / "small.toml")]


@pytest.mark.parametrize("command", RESULTS)
def test_a_command_goes_on_without_a_worker(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [command, *words_of(command, tmp_path), "--json", "--workers"]
    launch = [sys.executable, "-m", "ringbalance", *words, "2"]
    with subprocess.Popen(launch, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        while not lost_worker(child.pid):
            assert child.poll() is None, "ended before a worker was at work"
            time.sleep(0.05)
        printed, told = child.communicate(timeout=1200)
    assert told.count("a worker process was ended by the system") == 1
    assert "Traceback" not in told
    if command == "sweep":
        # Answers that are kept would be those of the run before.
        (tmp_path / "sweep").rename(tmp_path / "disturbed")
    assert child.returncode == main([*words, "1"])
    document, undisturbed = json.loads(printed), json.loads(capsys.readouterr().out)
    assert all(document[key] == undisturbed[key] for key in RESULTS[command])
