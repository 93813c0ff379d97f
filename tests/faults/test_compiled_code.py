"""Damaged caches of compiled code, full and read-only disks, and signals during compiled calls."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ringbalance.scene import bundled_scene
from ringbalance.scene.platform.kept_code import code_root

pytestmark = pytest.mark.faults

PROGRAM = """
import sys
from typing import NamedTuple
from ringbalance.scene.platform.compiled import compiled

class Pair(NamedTuple):
    one: float
    two: float

def doubled(x):
    return 2 * x

def paired(x):
    return Pair(x, 2 * x)

fast, pairs = compiled(doubled), compiled(paired)
assert fast(2.0) == 4.0 and fast(3) == 6
assert pairs(2.0).two == 4.0
print(sum(f.stats.cache_misses[s] for f in (fast, pairs) for s in f.stats.cache_misses))
"""
LOOP = (
    PROGRAM
    + """
print("ready", flush=True)
while True:
    pairs(1.0)
"""
)


TIMED = (
    """
import signal, sys

def out_of_time(*_):
    raise TimeoutError

signal.signal(signal.SIGPROF, out_of_time)
"""
    + PROGRAM
    + """
pairs(1.0)
for _ in range(200):
    try:
        signal.setitimer(signal.ITIMER_PROF, 1e-4)
        while True:
            pairs(1.0)
    except TimeoutError:
        pass
print("survived")
"""
)


FUNCTIONS = ("doubled", "paired")


def _kept(path: Path) -> list[Path]:
    return sorted(p for p in path.rglob("*") if p.suffix == ".nbc")


def _program(tmp_path: Path, text: str = PROGRAM) -> list[str]:
    script = tmp_path / "program.py"
    script.write_text(text)
    return [sys.executable, str(script)]


def _misses(tmp_path: Path, cache: Path, processes: int = 1) -> int:
    """Signatures that had to be compiled, by processes side by side."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command, pipe = _program(tmp_path), subprocess.PIPE
    started = [
        subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True)
        for _ in range(processes)
    ]
    count = 0
    for process in started:
        out, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
        assert "Traceback" not in errors
        count += int(out.split()[-1])
    return count


@pytest.mark.skipif(os.name == "nt", reason="without locks that another process sees")
def test_one_process_compiles_while_the_others_wait(tmp_path: Path) -> None:
    assert _misses(tmp_path, tmp_path / "cache", processes=3) == 3


DAMAGE = (
    PROGRAM
    + """
import random, shutil
from pathlib import Path
from ringbalance.scene.platform.kept_code import code_root

def flip(path):
    content = bytearray(path.read_bytes())
    content[number.randrange(len(content))] ^= 1 << number.randrange(8)
    path.write_bytes(content)

def folder(path):
    path.unlink()
    path.mkdir()
    (path / "inside").write_text("something")

def misses():
    one, two = compiled(doubled), compiled(paired)
    assert one(2.0) == 4.0 and one(3) == 6 and two(2.0).two == 4.0
    return sum(sum(f.stats.cache_misses.values()) for f in (one, two))

damages = {
    "empty": lambda path: path.write_bytes(b""),
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "garbage": lambda path: path.write_bytes(number.randbytes(5000)),
    "flipped": flip,
    "folder": folder,
    "pickled number": lambda path: path.write_bytes(b"\\x80\\x04K\\x01."),
    "gone": lambda path: path.unlink(),
    "not to be read": lambda path: path.chmod(0),
    "longer": lambda path: path.write_bytes(path.read_bytes() + b"x"),
    "text": lambda path: path.write_text("not a cache"),
    "link to nothing": lambda path: (path.unlink(), path.symlink_to("nothing for " + path.stem)),
    "no checksum": lambda path: path.write_bytes(path.read_bytes()[32:]),
}
number = random.Random(12)
assert misses() == 0
for name, damage in damages.items():
    damage(number.choice(sorted(p for p in code_root().rglob("*.nbc") if p.is_file())))
    misses()
    assert misses() == 0, name
shutil.rmtree(code_root())
assert misses() == 3 and misses() == 0
"""
)


def test_whatever_is_damaged_is_compiled_again_once(tmp_path: Path) -> None:
    done = subprocess.run(
        _program(tmp_path, DAMAGE),
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def _exchange(one: Path, other: Path) -> None:
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)


def test_code_under_another_function_s_name_is_not_run(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    _misses(tmp_path, cache)
    doubled, paired = (next(p for p in _kept(cache) if p.match(f"*.{name}-*.nbc")) for name in FUNCTIONS)
    _exchange(doubled, paired)
    assert _misses(tmp_path, cache) == 2
    assert _misses(tmp_path, cache) == 0


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners here")
def test_what_others_may_have_written_is_not_run(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    _misses(tmp_path, cache)
    assert not any(path.stat().st_mode & 0o077 for path in (cache / "ringbalance").rglob("*"))
    for path in _kept(cache):
        path.chmod(0o666)
    assert _misses(tmp_path, cache) == 3
    assert _misses(tmp_path, cache) == 0
    # A folder of one's own that others may write becomes private.
    (cache / "ringbalance").chmod(0o777)
    assert _misses(tmp_path, cache) == 0
    assert (cache / "ringbalance").stat().st_mode & 0o077 == 0


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="only the superuser gives files away")
def test_a_folder_of_another_user_is_not_used(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    _misses(tmp_path, cache)
    os.chown(cache / "ringbalance", 12345, 12345)
    before = {path: path.read_bytes() for path in _kept(cache)}
    assert _misses(tmp_path, cache) == 3
    assert {path: path.read_bytes() for path in _kept(cache)} == before


def test_two_programs_share_a_damaged_cache(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    _misses(tmp_path, cache)
    for path in _kept(cache):
        path.write_bytes(b"")
    command, environment = _program(tmp_path), {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    both = [subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [one.wait(timeout=120) for one in both] == [0, 0]
    _misses(tmp_path, cache)
    assert _misses(tmp_path, cache) == 0


def test_a_full_disk_is_no_obstacle(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=8k", "none", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting is not permitted here")
    try:
        assert _misses(tmp_path, disk) == 3
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def _interruptible() -> None:
    """A shell's background job is started with interrupts ignored, and its children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_ctrl_c_between_compiled_calls_is_an_interruption(tmp_path: Path) -> None:
    for attempt in range(3):
        with subprocess.Popen(
            _program(tmp_path, LOOP),
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            preexec_fn=_interruptible,
        ) as running:
            assert running.stdout is not None
            while running.stdout.readline() not in {"ready\n", ""}:
                pass
            time.sleep(0.05 * attempt)
            running.send_signal(signal.SIGINT)
            # Python's own end after a KeyboardInterrupt; a segmentation fault would be SIGSEGV.
            assert running.wait(timeout=60) == -signal.SIGINT


def test_a_limit_of_processor_time_is_an_ordinary_error(tmp_path: Path) -> None:
    done = subprocess.run(
        _program(tmp_path, TIMED),
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert (done.returncode, done.stdout.splitlines()[-1:]) == (0, ["survived"])


def test_a_real_run_survives_a_damaged_cache_and_ctrl_c(tmp_path: Path) -> None:
    text = bundled_scene("driven_masses_small").read_text()
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace('time_limit = "30 s"', 'time_limit = "2 s"'))
    command = [sys.executable, "-c", "import ringbalance.cli as c; raise SystemExit(c.main())", "simulate"]
    done = subprocess.run([*command, str(scene), "--json"], capture_output=True, timeout=900, check=False)
    assert done.returncode == 1
    assert json.loads(done.stdout)["outcome"] == "time_limit"
    # A copy of what that run found or left: to compile everything once more would take a minute.
    folder = tmp_path / "cache"
    shutil.copytree(code_root(), folder / "ringbalance")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    damaged = list(folder.rglob("run.measure*.nbc"))
    assert damaged
    for path in damaged:
        path.write_bytes(b"")
    again = subprocess.run(
        [*command, str(scene), "--json"], env=environment, capture_output=True, timeout=900, check=False
    )
    assert again.returncode == 1
    assert again.stdout == done.stdout
    # Without friction nothing ever rests, and every instant has to be integrated: some 15 s of computing.
    slow = text.replace('time_limit = "30 s"', 'time_limit = "200 s"')
    scene.write_text(slow.replace('friction_arm = ["60 um", "60 um"]', 'friction_arm = ["0 um", "0 um"]'))
    running = subprocess.Popen(
        [*command, str(scene)], env=environment, stderr=subprocess.DEVNULL, preexec_fn=_interruptible
    )
    time.sleep(5)
    running.send_signal(signal.SIGINT)
    assert running.wait(timeout=60) == 130


def test_what_takes_too_much_room_goes_the_oldest_first(tmp_path: Path) -> None:
    """Half a gigabyte on paper: the files have holes."""
    cache = tmp_path / "cache" / "ringbalance"
    cache.mkdir(parents=True, mode=0o700)
    for age in (3, 2, 1):
        path = cache / f"{age}.nbc"
        with path.open("wb") as file:
            file.truncate(300_000_000)
        os.utime(path, (time.time() - age * 3600,) * 2)
    _misses(tmp_path, tmp_path / "cache")
    assert (cache / "1.nbc").exists()
    assert not [age for age in (2, 3) if (cache / f"{age}.nbc").exists()]
