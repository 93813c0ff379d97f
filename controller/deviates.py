"""Inputs of drawn devices that are distributed normally; a static sweep draws none and loads no SciPy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import quantiles


def deviates(name: str, numbers: Sequence[int], *, seed: int) -> FloatArray:
    """Where an input lies, of devices by number, as `quantiles`, in standard deviations from its mean."""
    return np.asarray(ndtri(quantiles(name, numbers, seed=seed)))
