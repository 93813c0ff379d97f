"""The benchmark still starts, with or without NGSolve, and one of its sizes solves what it says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


def run(script: str, *words: str) -> str:
    command = [sys.executable, str(FOLDER / script), *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_comparison_starts() -> None:
    assert "NGSolve" in run("pressure_field.py", "--help")


def test_one_size_is_one_json_document() -> None:
    size = json.loads(run("pressure_growth.py", "1", "3", "1"))
    assert size["cells"] == [1, 3, 1]
    assert size["unknowns"] == 4 * 13 * 5  # quartic cells, the free surface left out
    assert size["error"] < 1e-6
    assert size["peak_megabytes"] > 10
