"""How one kind of data is predicted, and what kinds have in common: numbers, and vibrations as vectors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringbalance.identification.data.measurements import Observations
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.uncertain import NORMAL_95


def _never(_scene: Any, _observations: Observations) -> str:
    return ""


@dataclass(frozen=True, kw_only=True)
class PredictedKind:
    """How one kind of data is predicted; a vibration counts as its real and its imaginary part."""

    predict: Callable[[Any, Observations, Any], FloatArray]
    """Scene, observations and models to what was measured."""
    measured: Callable[[Observations], FloatArray]
    covariance: Callable[[Observations], FloatArray]
    """Of the errors of `measured`; unit where the noise is to be estimated."""
    noise_given: Callable[[Observations], bool]
    column: Callable[[Observations], str]
    """The measured column whose noise it is."""
    informs: Callable[[Observations], tuple[str, ...]]
    """Parameters that are fitted to such data where the user names none."""
    free: Callable[[Observations], FloatArray] | None = None
    """Effect of unknowns that are no parameters, such as the vibration without trial weight, one column
    each."""
    obstacle: Callable[[Any, Observations], str] = _never
    """Scene and observations to why the one cannot be fitted to the other; empty where it can."""

    @classmethod
    def numbers(cls, column: Callable[[Observations], str], **declared: Any) -> PredictedKind:
        """One measured number a row, its errors independent from row to row."""
        return cls(
            measured=lambda observations: observations.columns[column(observations)],
            covariance=lambda observations: _scalar_covariance(observations, column(observations)),
            noise_given=lambda observations: column(observations) in observations.uncertainty,
            column=column,
            **declared,
        )


def always(*names: str) -> Callable[[Observations], tuple[str, ...]]:
    """The same parameters for all data of a kind."""
    return lambda _: names


def _scalar_covariance(observations: Observations, column: str) -> FloatArray:
    """Of errors that are independent from row to row, shape (n, n); unit where their noise is not given."""
    given = observations.uncertainty.get(column)
    return np.diag(np.ones(len(observations)) if given is None else (given / NORMAL_95) ** 2)


def parts(vector: ComplexArray) -> FloatArray:
    """Real parts, then imaginary parts, shape (2 n,)."""
    return np.concatenate([vector.real, vector.imag])


def spread_out(blocks: FloatArray) -> FloatArray:
    """Covariance of `parts` of vectors that are independent of each other, shape (2 n, 2 n)."""
    count = blocks.shape[0]
    full, i = np.zeros((2 * count, 2 * count)), np.arange(count)
    for row in range(2):
        for column in range(2):
            full[row * count + i, column * count + i] = blocks[:, row, column]
    return full
