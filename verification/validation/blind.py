"""A user's own measurements beside the program's predictions, judged as the bundled ones are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.identification.data.measurements import MeasurementsError, read_measurements
from ringbalance.verification.validation.comparison import PROMISED, Comparison, compare, kind_of
from ringbalance.verification.validation.model_bias import bias, within

_FEWEST: Final = 2
"""Points from which a scatter can be had."""


def data_document(path: Path) -> dict[str, Any]:
    """Judgement of a file of measurements, as `ringbalance verify --data FILE --json` prints it.

    Raises: MeasurementsError: not such a file, or too few points; with the file's name in every line.
    """
    data = read_measurements(path)
    try:
        kind, comparison = kind_of(data), compare(data)
        if len(data) < _FEWEST:
            raise MeasurementsError(f"{len(data)} point, and {_FEWEST} are the fewest that can be judged")
    except MeasurementsError as error:
        raise MeasurementsError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from error
    return {
        "file": str(path),
        "kind": data.source.kind,
        "title": kind.title,
        "source": data.source.source,
        "measured": kind.measured,
        "limit": PROMISED,
        "verdict": comparison.verdict.value,
        "statistics": vars(comparison.statistics),
        "series": {name: _of_series(comparison, name) for name in np.unique(comparison.series).tolist()},
        "points": [
            dict(zip(("series", "measured", "predicted", "stated", "U_D"), row, strict=True))
            for row in zip(
                comparison.series.tolist(),
                comparison.measured.tolist(),
                comparison.predicted.tolist(),
                comparison.stated.tolist(),
                comparison.uncertainty.tolist(),
                strict=True,
            )
        ],
    }


def _of_series(comparison: Comparison, name: str) -> Mapping[str, float]:
    one = comparison.where(comparison.series == name)
    held = within(one.predicted, one.measured, one.stated, one.uncertainty)
    return {
        "points": one.measured.size,
        "bias": bias(one.predicted, one.measured),
        "share_within": float(np.mean(held)),
    }
