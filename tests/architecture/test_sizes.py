"""No function beyond 80 lines, no file beyond 450; the limits themselves are shown to bite."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def tool(root: Path) -> Path:
    return root / "tools" / "long_functions.py"


def run(tool: Path, *paths: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(tool), *map(str, paths)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_nothing_is_far_too_long(tool: Path, root: Path, room_order: tuple[str, ...]) -> None:
    folders = [*room_order, "ringbalance/cli.py", "ringbalance/__init__.py", "tools", "tests", "benchmarks"]
    found = run(tool, *(root / folder for folder in folders))
    assert found.returncode == 0, found.stdout


@pytest.mark.parametrize(
    ("lines", "code", "told"), [(35, 0, False), (36, 0, True), (80, 0, True), (81, 1, True)]
)
def test_long_functions_are_seen(tool: Path, tmp_path: Path, lines: int, code: int, told: bool) -> None:
    path = tmp_path / "long.py"
    path.write_text("def f():\n" + '    """Doc\n    string."""\n' + "    x = 1\n" * lines)
    found = run(tool, path)
    assert found.returncode == code
    assert ("could it be two" in found.stdout) == told


def test_long_files_are_seen(tool: Path, tmp_path: Path) -> None:
    path = tmp_path / "long.py"
    path.write_text("x = 1\n" * 451)
    assert run(tool, tmp_path).returncode == 1
