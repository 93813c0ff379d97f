"""Errors of measured numbers that are independent from row to row."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.uncertain import NORMAL_95


def scalar_covariance(observations: Observations, column: str) -> FloatArray:
    """Diagonal, shape (n, n); unit where the noise of the column is not given."""
    given = observations.uncertainty.get(column)
    return np.diag(np.ones(len(observations)) if given is None else (given / NORMAL_95) ** 2)
