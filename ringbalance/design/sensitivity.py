"""Sensitivity of a result to its inputs: first-order and total Sobol indices from a given sample."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement
from typing import Final

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.fft import dct

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.uncertain import NORMAL_95

MIN_ROWS: Final = 64
"""Smallest number of rows for a meaningful interval."""
_WAVES: Final = 8
"""Smallest number of cosines along an input; they contain 95 % of the variance of a step in its middle."""
_ROWS_PER_WAVE: Final = 4
"""Smallest number of rows for each cosine where a steep result takes more of them."""
_CARRYING_ROWS: Final = 8
"""So many rows or fewer carry the variance in 95 % of samples of 1/x, of any size: it is infinite, as that of
k where the axes reach the pressure at which the flow stalls.
"""
_HALVES: Final = 200
"""Number of random halves of the rows from which the interval is estimated."""
_MAX_DEGREE: Final = 10
_ROWS_PER_TERM: Final = 4
"""Smallest number of rows for each term of a polynomial, so that it predicts left-out rows."""


def first_order(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First-order Sobol indices: share of a result's variance by each input alone, and half-width (95 %).

    The variance of a cosine series of the result over the input's rank, less the contribution of noise. It
    has as many cosines as predict best: the variance of a result that is steep in one place lies in many.
    Inputs are independent; with interactions the shares sum to less than 1.
    Args: `inputs`: shape (n, k). `result`: shape (n,).
    Returns: Both of shape (k,); NaN for a result without a known variance, see `_varies`.
    Source: Plischke, Reliab. Eng. Syst. Saf. 95 (2010) 354; number of cosines by generalised
        cross-validation, Craven and Wahba, Numer. Math. 31 (1979) 377; half-widths by the jackknife that
        leaves half of the rows out, Shao and Wu, Ann. Statist. 17 (1989) 1176, plus the contribution of
        noise: evenly spread points may lack it, and cosines may be missed below it.
    """
    rows, count = inputs.shape
    if not _varies(result):
        return np.full(count, np.nan), np.full(count, np.nan)
    random = np.random.default_rng(0)
    # Random order, so that rows with equal inputs do not keep the order of the sample.
    mixed = random.permutation(rows)
    x, y = inputs[mixed], result[mixed]
    halves = (np.sort(random.permutation(rows)[: rows // 2]) for _ in range(_HALVES))
    spread = np.std([shares_alone(x[half], y[half])[0] for half in halves], axis=0)
    shares, noise = shares_alone(x, y)
    return shares, NORMAL_95 * spread + noise * (1 - shares)


def _varies(result: FloatArray) -> bool:
    """True if a sample shows the variance of a result, and so shares of it.

    False below `MIN_ROWS` rows, for one value, and where `_CARRYING_ROWS` or fewer carry the variance: they
    are (sum z^2)^2 / sum z^4, with z from the mean.
    """
    if result.size < MIN_ROWS or np.ptp(result) <= 1e-12 * np.max(np.abs(result)):
        return False
    squares = ((result - np.mean(result)) / np.std(result)) ** 2
    return bool(result.size**2 > _CARRYING_ROWS * np.sum(squares**2))


def shares_alone(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First-order shares of more than `_WAVES` rows, without intervals, and the noise taken off each."""
    rows, y = result.size, result - np.mean(result)
    parts = dct(y[np.argsort(inputs, axis=0, kind="stable")], axis=0)[1:] / rows
    # Half of the rows may have one value only, which nothing decides.
    variance = np.mean(y**2) if np.ptp(result) > 0 else np.inf
    waves = _WAVES * 2 ** np.arange(max(rows // (_ROWS_PER_WAVE * _WAVES), 1).bit_length())
    raw, noise = np.cumsum(parts**2, axis=0)[waves - 1] / (2 * variance), waves[:, None] / rows
    shares = (raw - noise) / (1 - noise)
    worse = np.diff((1 - shares) / (1 - noise), axis=0, append=np.inf) >= 0
    best = np.argmax(worse, axis=0)
    return shares[best, np.arange(best.size)], noise[best, 0]


def total_order(inputs: FloatArray, result: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Total Sobol indices: share of a result's variance by each input, alone or with others; half-width (95
    %).

    The variance of a polynomial of the inputs' ranks, of the total degree that predicts left-out rows best.
    The unexplained part may belong to any input: half of it is added, and the other half widens the interval.
    Args: `inputs`: shape (n, k), spread evenly as Sobol's or Latin points are. `result`: shape (n,).
    Returns: Both of shape (k,); NaN as `first_order`.
    Source: Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964; left-out rows by their leverage, Blatman and
        Sudret, J. Comput. Phys. 230 (2011) 2345; covariance of the weights from errors that differ by row,
        MacKinnon and White, J. Econometrics 29 (1985) 305.
    """
    rows, count = inputs.shape
    if not _varies(result):
        return np.full(count, np.nan), np.full(count, np.nan)
    y = (result - np.mean(result)) / np.std(result)
    fits = [_fit(powers, inputs, y) for powers in _powers(rows, count)]
    powers, weights, spread, missed = min(fits, key=lambda fit: fit[-1])
    # The square of an uncertain weight is too large by its variance.
    squares, missed = weights**2 - np.diag(spread), min(missed, 1.0)
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
    scatter = inverse @ (q.T * errors)
    return powers, (inverse @ (q.T @ result))[1:], (scatter @ scatter.T)[1:, 1:], missed
