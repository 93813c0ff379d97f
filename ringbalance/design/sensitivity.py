"""Sensitivity of a result to its inputs: first-order and total Sobol indices from a given sample."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement
from typing import Final

import numpy as np
from numpy.polynomial.legendre import legvander

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.uncertain import NORMAL_95

MIN_ROWS: Final = 64
"""Smallest number of rows for a meaningful interval."""
_WAVES: Final = 8
"""Number of cosines along an input; they contain 95 % of the variance of a step in its middle."""
_HALVES: Final = 200
"""Number of random halves of the rows from which the interval is estimated."""
_MAX_DEGREE: Final = 10
_ROWS_PER_TERM: Final = 4
"""Smallest number of rows for each term of a polynomial, so that it predicts left-out rows."""


def first_order(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First-order Sobol indices: share of a result's variance by each input alone, and half-width (95 %).

    The variance of a cosine series of the result over the input's rank, less the contribution of noise.
    Inputs are independent; with interactions the shares sum to less than 1.
    Args: `inputs`: shape (n, k). `result`: shape (n,).
    Returns: Both of shape (k,); NaN for a result that does not vary, or below `MIN_ROWS` rows.
    Source: Plischke, Reliab. Eng. Syst. Saf. 95 (2010) 354; half-widths by the jackknife that leaves half of
        the rows out, Shao and Wu, Ann. Statist. 17 (1989) 1176, and no less than the contribution of noise,
        which evenly spread points may lack: so the interval of a negative share holds zero.
    """
    rows, count = inputs.shape
    if rows < MIN_ROWS or np.ptp(result) <= 1e-12 * np.max(np.abs(result)):
        return np.full(count, np.nan), np.full(count, np.nan)
    random = np.random.default_rng(0)
    # Random order, so that rows with equal inputs do not keep the order of the sample.
    mixed = random.permutation(rows)
    x, y = inputs[mixed], result[mixed]
    halves = (np.sort(random.permutation(rows)[: rows // 2]) for _ in range(_HALVES))
    spread = np.std([_shares(x[half], y[half]) for half in halves], axis=0)
    noise = _WAVES / rows
    return _shares(x, y), np.maximum(NORMAL_95 * spread, noise / (1 - noise))


def _shares(inputs: FloatArray, result: FloatArray) -> FloatArray:
    rows, y = result.size, result - np.mean(result)
    phases = np.pi * (np.arange(rows) + 0.5) / rows
    waves = np.cos(np.arange(1, _WAVES + 1)[:, None] * phases)
    parts = waves @ y[np.argsort(inputs, axis=0, kind="stable")] / rows
    # Half of the rows may have one value only, which nothing decides.
    variance = np.mean(y**2) if np.ptp(result) > 0 else np.inf
    raw, noise = 2 * np.sum(parts**2, axis=0) / variance, _WAVES / rows
    return np.asarray((raw - noise) / (1 - noise))


def total_order(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Total Sobol indices: share of a result's variance by each input, alone or with others; half-width (95
    %).

    The variance of a polynomial of the inputs' ranks, of the total degree that predicts left-out rows best.
    The unexplained part may belong to any input: half of it is added, and the other half widens the interval.
    Args: `inputs`: shape (n, k), spread evenly as Sobol's or Latin points are. `result`: shape (n,).
    Returns: Both of shape (k,); NaN as `first_order`.
    Source: Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964; left-out rows by their leverage, Blatman and
        Sudret, J. Comput. Phys. 230 (2011) 2345.
    """
    rows, count = inputs.shape
    if rows < MIN_ROWS or np.ptp(result) <= 1e-12 * np.max(np.abs(result)):
        return np.full(count, np.nan), np.full(count, np.nan)
    y = (result - np.mean(result)) / np.std(result)
    fits = [_fit(powers, inputs, y) for powers in _powers(rows, count)]
    powers, weights, spread, missed = min(fits, key=lambda fit: fit[-1])
    squares, missed = weights**2, min(missed, 1.0)
    total = np.sum(squares) + missed
    takes_part = (powers > 0).T
    variance = np.array([(2 * weights * part) @ spread @ (2 * weights * part) for part in takes_part])
    return (
        np.asarray((takes_part @ squares + missed / 2) / total),
        np.asarray((missed / 2 + NORMAL_95 * np.sqrt(variance)) / total),
    )


_Fit = tuple[IntArray, FloatArray, FloatArray, float]


def _powers(rows: int, count: int) -> list[IntArray]:
    """Degrees of each term in each input, shape (terms, count), by polynomial that the rows can determine."""
    powers: list[IntArray] = []
    for degree in range(1, _MAX_DEGREE + 1):
        if math.comb(degree + count, count) * _ROWS_PER_TERM > rows and powers:
            break
        each = (
            np.bincount(axes, minlength=count)
            for n in range(1, degree + 1)
            for axes in combinations_with_replacement(range(count), n)
        )
        powers.append(np.array(list(each)))
    return powers


def _fit(powers: IntArray, inputs: FloatArray, result: FloatArray) -> _Fit:
    """Terms, weights, covariance of the weights, and mean square error at left-out rows."""
    ranks = (np.argsort(np.argsort(inputs, axis=0, kind="stable"), axis=0) + 0.5) / result.size
    waves = legvander(2 * ranks - 1, int(powers.max())) * np.sqrt(2 * np.arange(powers.max() + 1) + 1)
    terms = np.prod(waves[:, np.arange(powers.shape[1]), powers], axis=-1)
    q, r = np.linalg.qr(np.column_stack([np.ones(result.size), terms]))
    inverse = np.linalg.inv(r)
    errors = (result - q @ (q.T @ result)) / (1 - np.sum(q**2, axis=1))
    missed = float(np.mean(errors**2))
    return powers, (inverse @ (q.T @ result))[1:], missed * (inverse @ inverse.T)[1:, 1:], missed
