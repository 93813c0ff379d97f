"""Which input moves a result: first-order indices from the points that a sample has anyway."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.uncertain import NORMAL_95

LEAST_ROWS: Final = 64
"""Below this an interval says nothing."""
_WAVES: Final = 8
"""Cosines along an input: of a step in its middle they hold 95 % of the variance."""
_HALVES: Final = 200
"""Random halves of the rows from which the interval is estimated."""


def first_order(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of a result's variance that each input explains by itself, and its half-width (95 %).

    The variance of a cosine series of the result over the input's rank, less what noise alone would put into
    it.  Inputs are independent; where they act together, the shares add up to less than 1.
    Args: `inputs`: shape (n, k). `result`: shape (n,).
    Returns: Both of shape (k,); NaN for a result that does not vary, or below `LEAST_ROWS` rows.
    Source: Plischke, Reliab. Eng. Syst. Saf. 95 (2010) 354; half-widths by the jackknife that leaves half of
        the rows out, Shao and Wu, Ann. Statist. 17 (1989) 1176: of Sobol's points, too wide.
    """
    rows, count = inputs.shape
    if rows < LEAST_ROWS or np.ptp(result) <= 1e-12 * np.max(np.abs(result)):
        return np.full(count, np.nan), np.full(count, np.nan)
    random = np.random.default_rng(0)
    # Rows with equal inputs come in any order, not in that of the sample.
    mixed = random.permutation(rows)
    x, y = inputs[mixed], result[mixed]
    halves = (np.sort(random.permutation(rows)[: rows // 2]) for _ in range(_HALVES))
    spread = np.std([_shares(x[half], y[half]) for half in halves], axis=0)
    return _shares(x, y), NORMAL_95 * spread


def _shares(inputs: FloatArray, result: FloatArray) -> FloatArray:
    rows, y = result.size, result - np.mean(result)
    along = np.pi * (np.arange(rows) + 0.5) / rows
    waves = np.cos(np.arange(1, _WAVES + 1)[:, None] * along)
    parts = waves @ y[np.argsort(inputs, axis=0, kind="stable")] / rows
    raw, noise = 2 * np.sum(parts**2, axis=0) / np.mean(y**2), _WAVES / rows
    return np.asarray((raw - noise) / (1 - noise))
