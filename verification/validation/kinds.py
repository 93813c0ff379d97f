"""Measurements by others that come with the program, and what a kind of them is compared with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.resources import files

from ringbalance.identification.data.measurements import Measurements
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What the program says of each point, SI."""

    value: FloatArray
    stated: FloatArray
    """Expanded uncertainty (95 %) that it states."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of data."""

    title: str
    measured: str
    """Column that is predicted."""
    columns: Mapping[str, str]
    """Columns that the prediction needs, with what they hold."""
    optional: Mapping[str, str] = field(default_factory=dict)
    """Columns that it uses where they are there."""
    predict: Callable[[Measurements], Prediction]


def measurements(name: str) -> Measurements:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    return Measurements.parsed(path.read_text(encoding="utf-8"), file=f"{name}.csv")
