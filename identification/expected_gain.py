"""What a further measurement would do to an interval, from Fisher information: no data needed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray

_RANK: Final = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A measurement that could be made."""

    text: str
    derivatives: FloatArray
    """Of its predictions by the parameters, each row over its standard deviation, shape (m, p)."""


@dataclass(frozen=True, kw_only=True)
class Gain:
    """What a candidate does to one parameter."""

    candidate: str
    before: float
    """Standard deviation; infinite where nothing is known."""
    after: float

    @property
    def ratio(self) -> float:
        """Width of the interval after over before; zero where it was infinite and is no longer."""
        return 1.0 if self.after == self.before else self.after / self.before


def expected_gains(
    information: FloatArray, *, parameter: int, candidates: Iterable[Candidate]
) -> tuple[Gain, ...]:
    """Gains of all candidates, largest first.

    sigma'^2 = [(F + J^T J)^-1]_ii against sigma^2 = [F^-1]_ii.
    Args: `information`: F of the fit with its priors, shape (p, p); may be singular. `parameter`: i.
    Source: linear propagation; exact for predictions that are linear in the parameters.
    """
    before = _deviation(information, parameter)
    gains = [
        Gain(
            candidate=each.text,
            before=before,
            after=_deviation(information + each.derivatives.T @ each.derivatives, parameter),
        )
        for each in candidates
    ]
    return tuple(sorted(gains, key=lambda gain: (gain.after, gain.candidate)))


def _deviation(information: FloatArray, parameter: int) -> float:
    """Standard deviation of one parameter; infinite where a direction with it in is not determined."""
    scale = np.sqrt(np.diag(information))
    if not scale[parameter] > 0:
        return float("inf")
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    part = vectors[parameter] ** 2
    lost = values <= _RANK * values[-1]
    if float(np.sum(part[lost])) > 1e-8:
        return float("inf")
    return float(np.sqrt(np.sum(part[~lost] / values[~lost])) / scale[parameter])
