"""Tabulated references of the cases: CSV files whose first lines, marked #, give source and uncertainty."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from importlib.resources import files


def read_rows(case_id: str, name: str) -> tuple[Mapping[str, str], ...]:
    """Rows of a file in the case's data folder, column name to text."""
    path = files("ringbalance.verification.cases") / case_id / "data" / name
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return tuple(csv.DictReader(lines))
