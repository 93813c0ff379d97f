"""The data sets of measurements by others that come with the program."""

from __future__ import annotations

from importlib.resources import files

from ringbalance.identification.data.measurements import Measurements, parse_measurements


def measurements(name: str) -> Measurements:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    return parse_measurements(path.read_text(encoding="utf-8"), file=f"{name}.csv")
