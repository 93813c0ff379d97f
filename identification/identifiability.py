"""What the data alone, without priors on the parameters, can tell, from their Fisher information.

In the parameters' own scales t, ln x or ln(k + 1), F = J'J with J = d(residuals)/dt.

- **Structurally not identified**: J has no column for the parameter, or its columns are linearly dependent.
- **Practically not identified**: the interval that the data alone give is wider than the scene's prior, or
  than a factor of two where there is none.
- **Identified**: otherwise.

Of parameters that are not identified, products of powers may be: the directions in which F, with all else
free, is strong.  They are reduced to as few parameters as possible, and their exponents to small whole
numbers where those serve as well.
Source: Raue et al., Bioinformatics 25 (2009) 1923 (both kinds of non-identifiability); Rothenberg,
Econometrica 39 (1971) 577 (rank of the information).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from ringbalance.identification.parameters import Parameter
from ringbalance.scene.arrays import BoolArray, FloatArray

DEPENDENT: Final = 3e-5
"""Singular value of the normalised columns of J below which they count as dependent: above the error of
differences, and below what thousands of measurements could make up for."""
FACTOR: Final = math.log(2)
"""Half-width of t up to which a parameter without a prior is identified."""
_ALIKE: Final = 2.0
"""Ratio of standard deviations up to which whole exponents serve as well as the best ones."""
_WHOLE: Final = 3
"""Largest whole exponent looked for."""


class Verdict(StrEnum):
    """Whether data identify a parameter."""

    IDENTIFIED = "identified"
    PRACTICALLY = "practically not identified"
    STRUCTURALLY = "structurally not identified"


@dataclass(frozen=True, kw_only=True)
class Combination:
    """A product of powers of parameters that the data identify."""

    names: tuple[str, ...]
    exponents: tuple[float, ...]
    text: str
    """Such as "lambda^2/(k + 1)"."""
    value: float
    """With the parameters in SI, k + 1 for a loss coefficient."""
    relative_uncertainty: float
    """Expanded (95 %), by the data alone: of its logarithm."""


def rank(slopes: FloatArray) -> int:
    """Number of independent directions that the data see. Args: `slopes`: J, without priors."""
    return int(np.count_nonzero(_normalised(slopes)[1] > DEPENDENT))


def _normalised(slopes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Norms of the columns, singular values of the columns of norm one, and right singular vectors."""
    norms = np.linalg.norm(slopes, axis=0)
    unit = slopes / np.where(norms > 0, norms, 1.0)
    _, s, vt = np.linalg.svd(unit, full_matrices=True)
    padded = np.zeros(slopes.shape[1])
    padded[: s.size] = s[: slopes.shape[1]]
    return norms, padded, vt


def verdicts(
    parameters: Sequence[Parameter], t: FloatArray, slopes: FloatArray, factors: FloatArray
) -> tuple[Verdict, ...]:
    """Verdict of each parameter.

    Args: `slopes`: d(residuals of the data)/dt without priors. `factors`: Student's t of each.
    """
    _, s, vt = _normalised(slopes)
    null = vt[s <= DEPENDENT]
    in_null = np.any(np.abs(null) > 1e-2, axis=0) if null.size else np.zeros(t.size, dtype=np.bool_)
    spread = data_spread(slopes)
    found = []
    for i, parameter in enumerate(parameters):
        if in_null[i]:
            found.append(Verdict.STRUCTURALLY)
        else:
            alone = factors[i] * math.sqrt(spread[i, i])
            prior = parameter.prior and 1.96 * parameter.prior / parameter.slope(float(t[i]))
            weak = alone > (prior or FACTOR)
            found.append(Verdict.PRACTICALLY if weak else Verdict.IDENTIFIED)
    return tuple(found)


def data_spread(slopes: FloatArray) -> FloatArray:
    """Covariance of t by the data alone; huge along what they do not see."""
    norms, s, vt = _normalised(slopes)
    floor = np.where(s > DEPENDENT, s, 1e-9)
    size = np.where(norms > 0, norms, 1e-9)
    half = (vt.T / floor) / size[:, None]
    return np.asarray(half @ half.T)


def combinations(
    parameters: Sequence[Parameter],
    t: FloatArray,
    slopes: FloatArray,
    found: Sequence[Verdict],
    factors: FloatArray,
) -> tuple[Combination, ...]:
    """Products of powers of the parameters that are not identified, as far as the data identify them."""
    weak = np.array([v is not Verdict.IDENTIFIED for v in found])
    if not np.any(weak):
        return ()
    factor = float(np.max(factors))
    reduced = _without(slopes[:, ~weak], slopes[:, weak])
    _, s, vt = np.linalg.svd(reduced, full_matrices=False)
    strong = vt[factor < FACTOR * s]
    # One that is dependent on nothing else would stand alone, and be identified.
    rows = [row for row in _echelon(strong) if np.count_nonzero(row) > 1]
    names = [p for p, is_weak in zip(parameters, weak, strict=True) if is_weak]
    inner = t[weak]
    spread = data_spread(reduced)
    return tuple(_combination(names, inner, _simple(row, spread), spread, factor) for row in rows)


def _without(others: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns without what others can take up."""
    if others.shape[1] == 0:
        return columns
    q, _ = np.linalg.qr(others)
    return np.asarray(columns - q @ (q.T @ columns))


def _echelon(rows: FloatArray) -> FloatArray:
    """The same space of directions with as many zeros as possible: reduced by Gauss and Jordan."""
    rows = rows.copy()
    pivots: list[int] = []
    for i in range(rows.shape[0]):
        free = np.abs(rows[i:]).copy()
        free[:, pivots] = 0.0
        row, column = np.unravel_index(int(np.argmax(free)), free.shape)
        rows[[i, i + int(row)]] = rows[[i + int(row), i]]
        rows[i] /= rows[i, column]
        pivots.append(int(column))
        for j in range(rows.shape[0]):
            if j != i:
                rows[j] -= rows[j, column] * rows[i]
    rows[np.abs(rows) < 0.02] = 0.0
    return rows


def _simple(row: FloatArray, spread: FloatArray) -> FloatArray:
    """Whole exponents where the data identify them nearly as well, else two decimals; the first positive."""
    best = _width(row, spread)
    row = row / row[np.flatnonzero(row)[0]]
    for largest in range(1, _WHOLE + 1):
        whole = np.round(row / np.max(np.abs(row)) * largest)
        if np.array_equal(whole != 0, row != 0) and _width(whole, spread) <= _ALIKE * best:
            return np.asarray(whole / np.gcd.reduce(whole.astype(np.int64)))
    return np.asarray(np.round(row, 2))


def _width(row: FloatArray, spread: FloatArray) -> float:
    """Standard deviation along a direction, per unit of length."""
    return math.sqrt(float(row @ spread @ row) / float(row @ row))


def _combination(
    parameters: Sequence[Parameter], t: FloatArray, row: FloatArray, spread: FloatArray, factor: float
) -> Combination:
    used: BoolArray = row != 0
    return Combination(
        names=tuple(p.name for p, one in zip(parameters, used, strict=True) if one),
        exponents=tuple(float(x) for x in row[used]),
        text=power_text([p.symbol for p, one in zip(parameters, used, strict=True) if one], row[used]),
        value=math.exp(float(row @ t)),
        relative_uncertainty=factor * math.sqrt(float(row @ spread @ row)),
    )


def power_text(symbols: Sequence[str], exponents: FloatArray) -> str:
    """Product of powers, such as "lambda^2/(k + 1)"."""
    above = [_power(s, e) for s, e in zip(symbols, exponents, strict=True) if e > 0]
    below = [_power(s, -e) for s, e in zip(symbols, exponents, strict=True) if e < 0]
    under = "" if not below else "/" + (below[0] if len(below) == 1 else f"({' '.join(below)})")
    return (" ".join(above) or "1") + under


def _power(symbol: str, exponent: float) -> str:
    return symbol if exponent == 1 else f"{symbol}^{exponent:g}"
