"""Set-up where something is missing, the search for further Pythons, rooms imported by a wrong name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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
