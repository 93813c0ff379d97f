"""The paper's disc, and published measurements."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pytest

from ringbalance.scene.models import Disc, Scene

DATA = Path(__file__).parent / "data"
Rows = Callable[[str], list[dict[str, float]]]


@pytest.fixture(scope="session")
def disc(paper_scene: Scene) -> Disc:
    """With plates."""
    return paper_scene.disc


@pytest.fixture(scope="session")
def rows() -> Rows:
    """The rows of a file of `data`, whose comments begin with #."""

    def read(name: str) -> list[dict[str, float]]:
        lines = [line for line in (DATA / name).read_text().splitlines() if not line.startswith("#")]
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]

    return read
