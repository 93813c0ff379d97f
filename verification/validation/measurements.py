"""Data sets of measurements by others: the numbers, where they come from, and what they support."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where a data set comes from."""

    source: str
    where: str
    doi: str
    """Empty where there is none."""
    licence: str
    """Of the numbers as they stand in the file."""
    read: Literal["tables", "transcription", "figure"]
    """Tables of the publication, somebody else's copy of them, or points read from a figure."""
    uncertainty: float
    """U_D, expanded (95 %), relative to the measured value."""
    uncertainty_from: str
    conditions: str
    supports: str
    does_not_support: str


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """One data set, one row a point."""

    source: Source
    series: StringArray
    """Tube, run or rig that a point belongs to: its points share their systematic errors."""
    columns: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return int(self.series.size)

    def where(self, chosen: BoolArray) -> Measurements:
        """Some of the points."""
        return Measurements(
            source=self.source,
            series=self.series[chosen],
            columns={name: column[chosen] for name, column in self.columns.items()},
        )


def measurements(name: str) -> Measurements:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    head = "\n".join(line.removeprefix("# ") for line in lines if line.startswith("#"))
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    numbers = [key for key in rows[0] if key != "series"]
    return Measurements(
        source=Source(**tomllib.loads(head)),
        series=np.array([row["series"] for row in rows], dtype=np.str_),
        columns={key: np.array([float(row[key]) for row in rows]) for key in numbers},
    )
