"""Sobol's sequence, apart from `axes.py` because scipy.stats takes half a second to load."""

from __future__ import annotations

from scipy.stats.qmc import Sobol

from ringbalance.scene.arrays import FloatArray


def sobol(axes: int, count: int, *, seed: int = 0) -> FloatArray:
    """First points of the sequence in the unit cube, scrambled after Owen, shape (count, axes)."""
    points: FloatArray = Sobol(axes, rng=seed).random(1 << max(count - 1, 0).bit_length())
    return points[:count]
