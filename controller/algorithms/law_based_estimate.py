"""The influence coefficient as the responses to operations show it, one recursive step at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

MAGNITUDE_RANGE: Final = 10.0
"""Factor around the assumed magnitude that the estimate keeps to: no response proves no coefficient."""


@dataclass(frozen=True, kw_only=True)
class InfluenceEstimate:
    """Estimate of K in V1 = V0 + K U."""

    value: complex
    """K, m/(kg m)."""
    variance: float
    """Mean square of its error, both components together, (m/(kg m))^2."""


def updated(
    estimate: InfluenceEstimate,
    *,
    moment_change: complex,
    vibration_change: complex,
    noise_variance: float,
    law_standard_deviation: float,
    assumed_magnitude: float,
) -> InfluenceEstimate:
    """Learn from one operation, dV = K dU + noise, by a Kalman filter of one complex number.

    gain = P dU* / (P |dU|^2 + R), K <- K + gain (dV - K dU), P <- P R/(P |dU|^2 + R), with R =
    `noise_variance` + (s |K dU|)^2, s = `law_standard_deviation` (relative): a response that noise could have
    made moves K little, and no moment counts as better known than by s. P never falls below (s |K|)^2, so the
    estimate keeps following. All SI; variances are of both components together.
    Source: Kalman, "A New Approach to Linear Filtering and Prediction Problems", J. Basic Eng. 82 (1960).
    """
    k, p = estimate.value, estimate.variance
    expected = abs(moment_change) ** 2 * p
    if expected == 0:
        return estimate
    rest = noise_variance + abs(law_standard_deviation * k * moment_change) ** 2
    gain = p * moment_change.conjugate() / (expected + rest)
    value = _held(k + gain * (vibration_change - k * moment_change), k, assumed_magnitude)
    left = p * rest / (expected + rest)
    return InfluenceEstimate(value=value, variance=max(left, abs(law_standard_deviation * value) ** 2))


def _held(value: complex, before: complex, assumed: float) -> complex:
    magnitude = abs(value)
    if magnitude == 0:
        return before / abs(before) * assumed / MAGNITUDE_RANGE
    bounded = min(max(magnitude, assumed / MAGNITUDE_RANGE), assumed * MAGNITUDE_RANGE)
    return value * (bounded / magnitude)
