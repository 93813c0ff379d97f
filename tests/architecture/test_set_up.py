"""Set-up where something is missing, the search for further Pythons, rooms imported by a wrong name."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def script(path: Path, text: str) -> None:
    """An executable shell script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.mark.parametrize("sudo", [True, False])
def test_the_line_to_run_says_sudo_only_where_it_exists(root: Path, tmp_path: Path, sudo: bool) -> None:
    script(tmp_path / "id", "echo 1000")
    if sudo:
        script(tmp_path / "sudo", "exit 1")
    command = ["/bin/sh", "-c", ". tools/debian_packages.sh; debian_packages 'a thing' some-package"]
    result = subprocess.run(
        command, cwd=root, env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert result.returncode == 1
    assert "a thing is missing" in result.stdout
    assert ("sudo" in result.stdout) == sudo
    assert ("as root" in result.stdout) != sudo
    assert "apt-get install -y --no-install-recommends some-package" in result.stdout


@pytest.fixture
def other_pythons(root: Path) -> dict[str, Any]:
    """What tools/other_pythons.py defines."""
    return runpy.run_path(str(root / "tools" / "other_pythons.py"))


def test_supported_versions_are_read_from_a_specifier(other_pythons: dict[str, Any]) -> None:
    assert other_pythons["supported"](">=3.11,<3.14") == ["3.11", "3.12", "3.13"]


def test_only_a_python_that_starts_counts(
    other_pythons: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script(tmp_path / "shims/python3.12", "echo no such version >&2; exit 127")
    script(tmp_path / "shims/python3.13", "echo 3.11")
    script(tmp_path / "pyenv/versions/3.12.9/bin/python", "echo 3.12")
    monkeypatch.setenv("PATH", os.pathsep.join([str(tmp_path / "absent"), str(tmp_path / "shims")]))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path / "pyenv"))
    assert other_pythons["interpreters"](["3.12", "3.13"]) == {
        "3.12": tmp_path / "pyenv/versions/3.12.9/bin/python",
        "3.13": None,
    }


@pytest.mark.parametrize("code", [0, 2])
def test_each_further_python_is_tested_and_a_failure_is_a_failure(
    other_pythons: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    code: int,
) -> None:
    commands: list[list[str]] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        return subprocess.CompletedProcess(command, code)

    def interpreters(versions: list[str]) -> dict[str, Path | None]:
        return {"3.98": None} | {version: Path(f"/opt/{version}") for version in versions}

    main: Callable[[], int] = other_pythons["main"]
    monkeypatch.setitem(main.__globals__, "interpreters", interpreters)
    monkeypatch.setattr(subprocess, "run", run)
    assert main() == (1 if code else 0)
    running = f"3.{sys.version_info.minor}"
    versions = [version for version in ("3.11", "3.12", "3.13") if version != running]
    target = {"3.11": "test", "3.12": "test-short", "3.13": "test"}
    expected = [["make", target[one], f"VENV=.venv-{one}", f"PYTHON=/opt/{one}"] for one in versions]
    assert commands == (expected[:1] if code else expected)
    assert "Python 3.98: not on this machine" in capfd.readouterr().out


def test_no_room_is_imported_by_its_folder_s_name(root: Path, room_order: tuple[str, ...]) -> None:
    code = """
import importlib, sys
for room in sys.argv[1:]:
    try:
        importlib.import_module(room)
    except ImportError as error:
        assert f"import ringbalance.{room}, not {room}" in str(error), error
    else:
        raise AssertionError(room)
"""
    rooms = (*room_order, "scenes")
    command = [sys.executable, "-P", "-c", f"import sys; sys.path.insert(0, {str(root)!r})\n{code}", *rooms]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
