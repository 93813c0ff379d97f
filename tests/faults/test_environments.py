"""Odd environments: no traceback ever, and exit codes as documented."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from ringbalance.scene import bundled_scene

pytestmark = pytest.mark.faults

PAPER = bundled_scene("liquid_ring_paper")
RINGBALANCE = [sys.executable, "-m", "ringbalance"]
# Cheap, and between them: text with every odd character, JSON, files read and a verified case.
HELP = ["--help"]
LIST = ["verify", "--list"]
CALIBRATE = ["calibrate", str(PAPER)]
JSON = ["calibrate", str(PAPER), "--json"]
SIMULATE = ["simulate", str(PAPER), "--law", "paper"]
CLAIM = ["verify", "claim_11_lambda"]
POSIX = os.name == "posix"

Finished = subprocess.CompletedProcess[bytes]


def run(
    words: Sequence[str | bytes],
    *,
    environment: Mapping[str, str | None] | None = None,
    cwd: Path | None = None,
) -> Finished:
    """One command line under an environment; None unsets a variable."""
    changed = environment or {}
    variables = {**os.environ, "PYTHONUNBUFFERED": ""} | {k: v for k, v in changed.items() if v is not None}
    for name in [name for name, value in changed.items() if value is None]:
        variables.pop(name, None)
    return subprocess.run(
        [*RINGBALANCE, *words], env=variables, cwd=cwd, capture_output=True, check=False, timeout=120
    )


def shell(script: str, words: Sequence[str]) -> Finished:
    """One command line under a shell script, in which "$@" stands for it."""
    command = ["/bin/sh", "-c", script, "sh", *RINGBALANCE, *words]
    return subprocess.run(command, capture_output=True, check=False, timeout=120)


def assert_ended(found: Finished, *codes: int) -> None:
    """An exit code that is allowed, and neither a traceback nor a complaint of the interpreter."""
    assert found.returncode in codes, (found.returncode, found.stderr[-2000:])
    for word in (b"Traceback", b"Exception ignored", b"Error:"):
        assert word not in found.stderr, found.stderr[-2000:]


@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({"HOME": None}, CALIBRATE),
        ({"HOME": "/nonexistent", "XDG_CACHE_HOME": None}, SIMULATE),
        ({"HOME": "/proc"}, LIST),
        ({"XDG_CACHE_HOME": "/proc/1"}, CALIBRATE),
        ({"XDG_CACHE_HOME": "/dev/null"}, SIMULATE),
        ({"TMPDIR": "/nonexistent"}, CALIBRATE),
        ({"TMPDIR": "/proc"}, SIMULATE),
        ({"LANG": "C", "LC_ALL": None}, SIMULATE),
        ({"LC_ALL": "POSIX"}, CLAIM),
        ({"LC_ALL": "de_DE"}, CALIBRATE),
        ({"LC_ALL": "no_such_locale"}, CALIBRATE),
        ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, SIMULATE),
        ({"PYTHONUTF8": "1"}, SIMULATE),
        ({"PYTHONIOENCODING": "cp1252"}, CLAIM),
        ({"PYTHONIOENCODING": "ascii:strict"}, SIMULATE),
        ({"PYTHONIOENCODING": "latin-1"}, HELP),
        ({"PYTHONIOENCODING": "utf-16"}, SIMULATE),
        ({"PYTHONWARNINGS": "error"}, SIMULATE),
        ({"PYTHONWARNINGS": "nonsense"}, LIST),
        ({"PYTHONOPTIMIZE": "1"}, CALIBRATE),
        ({"PYTHONDONTWRITEBYTECODE": "1", "PYTHONHASHSEED": "0"}, LIST),
        ({"PYTHONUNBUFFERED": "1"}, JSON),
        ({"TZ": "Mars/Olympus"}, LIST),
        ({"TERM": "dumb"}, CALIBRATE),
        ({"TERM": None}, LIST),
        ({"TERM": "no-such-terminal", "FORCE_COLOR": "1"}, SIMULATE),
        ({"NO_COLOR": "1", "TTY_INTERACTIVE": "1"}, LIST),
        ({"OMP_NUM_THREADS": "abc", "OPENBLAS_NUM_THREADS": "-1"}, CALIBRATE),
        ({"MPLBACKEND": "no_such_backend", "DISPLAY": ":99"}, LIST),
        ({"PATH": ""}, CALIBRATE),
    ],
)
def test_variables(environment: dict[str, str | None], words: list[str]) -> None:
    found = run(words, environment=environment)
    assert_ended(found, 0)
    assert found.stdout


def test_an_interpreter_without_docstrings_is_refused_in_one_sentence() -> None:
    found = run(CALIBRATE, environment={"PYTHONOPTIMIZE": "2"})
    assert_ended(found, 2)
    assert b"PYTHONOPTIMIZE" in found.stderr


@pytest.mark.parametrize("size", ["0", "1", "-5", "abc", "\N{SUPERSCRIPT TWO}", "100000", "9" * 5000])
def test_a_terminal_size_that_cannot_be_is_ignored(size: str) -> None:
    found = run(HELP, environment={"COLUMNS": size, "LINES": size})
    assert_ended(found, 0)
    assert b"calibrate" in found.stdout
    assert max(map(len, found.stdout.decode().splitlines())) <= 80


@pytest.mark.skipif(not POSIX, reason="needs a POSIX shell")
@pytest.mark.parametrize(
    ("script", "words", "code"),
    [
        ('"$@" <&-', SIMULATE, 0),
        ('"$@" >&-', CALIBRATE, 2),
        ('"$@" >&-', HELP, 2),
        ('"$@" 2>&-', JSON, 0),
        ('"$@" <&- >&- 2>&-', CALIBRATE, 2),
        ('"$@" >/dev/full', CALIBRATE, 2),
        ('"$@" >/dev/full', JSON, 2),
        ('"$@" >/dev/full', ["--version"], 2),
        ('"$@" >/dev/full 2>&1', SIMULATE, 2),
        ('"$@" 1</dev/null', LIST, 2),
        ('umask 077; "$@"', LIST, 0),
        ('ulimit -n 64; "$@"', SIMULATE, 0),
        ('d=$(mktemp -d); cd "$d"; rmdir "$d"; "$@"', CALIBRATE, 0),
        ('d=$(mktemp -d); cd "$d"; chmod 0 "$d"; "$@"', LIST, 0),
    ],
)
def test_streams_and_limits(script: str, words: list[str], code: int) -> None:
    found = shell(script, words)
    assert_ended(found, code)
    if code and "2>" not in script:
        assert found.stderr.startswith(b"ringbalance: standard output")
        assert len(found.stderr.splitlines()) == 1


@pytest.mark.skipif(not POSIX, reason="needs a POSIX shell")
@pytest.mark.parametrize("words", [HELP, SIMULATE, ["verify", "--list", "--json"]])
@pytest.mark.parametrize("script", ['{ "$@"; echo $? >&3; } | :', '{ "$@" 2>&1; echo $? >&3; } | :'])
def test_a_reader_that_goes_away_gives_141(script: str, words: list[str]) -> None:
    found = shell(f"exec 3>&1; {script}", words)
    assert found.stdout == b"141\n"
    assert found.stderr.strip() == b""


@pytest.mark.skipif(not POSIX, reason="needs a POSIX shell")
def test_a_reader_of_messages_that_goes_away_stops_nothing() -> None:
    found = shell('exec 3>&1; { FORCE_COLOR=1 "$@" 2>&1 >&3; } | :', JSON)
    # The exit code is that of `:`; nothing but the command writes to this stream.
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout)["quantities"]


@pytest.mark.skipif(not POSIX, reason="file names are bytes only there")
def test_a_file_name_that_is_not_utf_8(tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff.toml"
    Path(os.fsdecode(path)).write_bytes(PAPER.read_bytes())
    for words in ([b"calibrate", path], [b"compare", path, path, b"--law", b"paper"]):
        assert_ended(run(words), 0, 1)


def test_the_same_bits_whatever_the_number_of_threads() -> None:
    counts = ("1", "2")
    one, two = (
        run(JSON, environment={"OMP_NUM_THREADS": n, "OPENBLAS_NUM_THREADS": n, "MKL_NUM_THREADS": n})
        for n in counts
    )
    assert one.returncode == 0
    assert one.stdout == two.stdout
