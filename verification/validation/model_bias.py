"""Bias and standard deviation of a model over measurements, and the share that its band holds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy import special

from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray

_FEWEST_SERIES: Final = 3
_PROMISED: Final = 0.95
MUTATIONS: Final[Mapping[str | None, float]] = MappingProxyType(
    {None: 1.0, "ten_per_cent_high": 1.1, "ten_per_cent_low": 0.9}
)
"""Factors on what is predicted; every comparison with measurements must notice the last two."""


@dataclass(frozen=True, kw_only=True)
class ModelStatistics:
    """How a model stands to measurements, relative to the measured values."""

    points: int
    series: int
    bias: float
    """Geometric mean of predicted over measured, less one: above zero where the model reads high."""
    bias_uncertainty: float
    """Expanded (95 %)."""
    standard_deviation: float
    """Of the model alone: the scatter less the measurements' own."""
    share_within: float
    """Of the points whose deviation lies within both 95 % uncertainties, the model's stated one and U_D."""
    width_needed: float
    """Factor on both uncertainties at which they hold 95 % of the points."""

    @classmethod
    def of(
        cls,
        *,
        predicted: FloatArray,
        measured: FloatArray,
        series: StringArray,
        stated: FloatArray,
        measurement_uncertainty: FloatArray,
    ) -> ModelStatistics:
        """Statistics of ln(predicted/measured) over a data set.

        bias = exp(mean) - 1; s_model^2 = s^2 - (U_D/2)^2, zero where the measurements alone explain the
        scatter.  The points of a series share their systematic errors, so the bias is known to t s/sqrt(n) of
        the n means of the series; from fewer than three series to U_D.
        Args: `stated`: expanded uncertainty (95 %) of the predicted values, in their unit.
            `measurement_uncertainty`: U_D, relative.
        Source: McGrattan and Toman, Metrologia 48 (2011) 173, for the split of the scatter.
        """
        ratio = np.log(predicted / measured)
        used = _used(predicted, measured, stated, measurement_uncertainty)
        names = np.unique(series)
        means = np.array([np.mean(ratio[series == name]) for name in names])
        unexplained = float(np.var(ratio, ddof=1) - np.mean((measurement_uncertainty / 2) ** 2))
        return cls(
            points=ratio.size,
            series=names.size,
            bias=bias(predicted, measured),
            bias_uncertainty=_mean_uncertainty(means, float(np.mean(measurement_uncertainty))),
            standard_deviation=math.sqrt(max(unexplained, 0.0)),
            share_within=float(np.mean(used <= 1)),
            width_needed=float(np.quantile(used, _PROMISED)),
        )

    def numbers(self) -> dict[str, float]:
        """Numbers for a case's text, by the names of `ModelStatistics`."""
        return {key: float(value) for key, value in vars(self).items()}


def bias(predicted: FloatArray, measured: FloatArray) -> float:
    """Geometric mean of predicted over measured, less one."""
    return math.expm1(float(np.mean(np.log(predicted / measured))))


def within(
    predicted: FloatArray, measured: FloatArray, stated: FloatArray, measurement_uncertainty: FloatArray
) -> BoolArray:
    """Whether each deviation lies within both 95 % uncertainties; the last is relative."""
    return np.asarray(_used(predicted, measured, stated, measurement_uncertainty) <= 1)


def _used(
    predicted: FloatArray, measured: FloatArray, stated: FloatArray, measurement_uncertainty: FloatArray
) -> FloatArray:
    """Size of each deviation over what both uncertainties allow."""
    return np.asarray(np.abs(predicted - measured) / np.hypot(stated, measurement_uncertainty * measured))


def _mean_uncertainty(means: FloatArray, measurement_uncertainty: float) -> float:
    if means.size < _FEWEST_SERIES:
        return measurement_uncertainty
    factor = float(special.stdtrit(means.size - 1, 0.975))
    return factor * float(np.std(means, ddof=1)) / math.sqrt(means.size)
