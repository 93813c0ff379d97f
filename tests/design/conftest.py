"""A file of valves, as spreadsheets write it."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def valves(tmp_path: Path) -> Path:
    file = tmp_path / "valves.csv"
    rows = "slow;0.5;0.3;5 ms\nfast;2;30 %;2 ms\n"
    heads = "name;conductance [l/(s*bar)];critical_ratio;valve_lag"
    file.write_text(f"# from their data sheets\n{heads}\n{rows}", encoding="utf-8-sig")
    return file
