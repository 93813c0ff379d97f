"""Identifiability of parameters by the data alone, without priors, from their Fisher information.

In the fitted scales t of the parameters, ln x or ln(k + 1), F = J'J with J = d(residuals)/dt.

- **Structurally not identified**: J has no column for the parameter, or its columns are linearly dependent.
- **Practically not identified**: the interval that the data alone give, by F, is wider than the scene's
  prior, or than a factor of two without a prior; or the profile is that wide in spite of F.
- **Identified**: otherwise.

If a parameter is not identified, products of powers may be: the directions in which F is strong, relative to
those widths.  They are reduced to as few parameters as possible, with whole exponents if these are about as
well identified.
Source: Raue et al., Bioinformatics 25 (2009) 1923 (both kinds of non-identifiability); Rothenberg,
Econometrica 39 (1971) 577 (rank of the information).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from ringbalance.identification.intervals import Profile
from ringbalance.identification.parameters import Parameter
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.uncertain import NORMAL_95

DEPENDENT: Final = 3e-5
"""Singular value of the normalised columns of J below which they count as dependent.

It is above the error of the differences, and so small that even thousands of measurements could not
compensate.
"""
FACTOR: Final = math.log(2)
"""Half-width of t up to which a parameter without a prior is identified."""
_ALIKE: Final = 2.0
"""Ratio of standard deviations up to which whole exponents count as equal to the best ones."""
_ROUNDED: Final = 0.12
"""Part of the largest exponent by which whole ones may differ: that of a velocity changes as the fills do,
and as liquid has to be lifted first, by a fifth of a short injection."""
_BENT: Final = 1.5
"""Ratio of the residuals' rise by J to that of the profile, at an end of it, beyond which J is not used."""
_SIGN: Final = 0.05
"""Smallest exponent, as a fraction of the largest, that decides the sign of all."""
_UNSEEN: Final = 1e-9
"""Replacement of a singular value or a norm of zero."""
_WHOLE: Final = 3
"""Largest whole exponent that is tried."""


class Identified(StrEnum):
    """Verdict on the identifiability of a parameter."""

    IDENTIFIED = "identified"
    PRACTICALLY = "practically not identified"
    STRUCTURALLY = "structurally not identified"


@dataclass(frozen=True, kw_only=True)
class Combination:
    """Product of powers of parameters that the data identify."""

    names: tuple[str, ...]
    exponents: tuple[float, ...]
    text: str
    """Formula, such as "lambda^2/(k + 1)"."""
    value: float
    """Value with the parameters in SI, k + 1 for a loss coefficient."""
    relative_uncertainty: float
    """Expanded uncertainty (95 %) of its logarithm, by the data alone."""


def _normalised(slopes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Norms of the columns, singular values of the columns of norm one, and right singular vectors."""
    norms = np.linalg.norm(slopes, axis=0)
    unit = slopes / np.where(norms > 0, norms, 1.0)
    _, s, vt = np.linalg.svd(unit, full_matrices=True)
    padded = np.zeros(slopes.shape[1])
    padded[: s.size] = s[: slopes.shape[1]]
    return norms, padded, vt


def _allowed_widths(parameters: Sequence[Parameter], t: FloatArray) -> FloatArray:
    """Largest half-width (95 %) of each t with which a parameter counts as identified: that of the prior, or
    a factor of two."""
    return np.array(
        [
            NORMAL_95 * p.prior / p.slope(x) if p.prior else FACTOR
            for p, x in zip(parameters, t.tolist(), strict=True)
        ]
    )


def verdicts(
    parameters: Sequence[Parameter], t: FloatArray, slopes: FloatArray, profiles: Sequence[Profile]
) -> tuple[Identified, ...]:
    """Verdict on each parameter. Args: `slopes`: d(residuals of the data)/dt, without priors."""
    _, s, vt = _normalised(slopes)
    null = vt[s <= DEPENDENT]
    lost = np.any(np.abs(null) > 1e-2, axis=0) if null.size else np.zeros(t.size, dtype=np.bool_)
    alone = np.linalg.norm(_data_root(slopes), axis=1)
    allowed = _allowed_widths(parameters, t)
    identified = []
    for i, (parameter, profile) in enumerate(zip(parameters, profiles, strict=True)):
        reach = max(profile.high - float(t[i]), float(t[i]) - profile.low)
        # With equal weights of prior and data the interval is the prior's over sqrt(2).
        wide = reach > allowed[i] / (math.sqrt(2) if parameter.prior else 1.0)
        weak = wide or profile.factor * alone[i] > allowed[i]
        identified.append(
            Identified.STRUCTURALLY if lost[i] else Identified.PRACTICALLY if weak else Identified.IDENTIFIED
        )
    return tuple(identified)


def _data_root(slopes: FloatArray, *, unseen: float = _UNSEEN) -> FloatArray:
    """Factor H of the covariance H H' of t by the data alone.

    Args: `unseen`: singular value along directions without information: small, or infinite to omit these.
    """
    norms, s, vt = _normalised(slopes)
    seen = np.where(s > DEPENDENT, s, unseen)
    size = np.where(norms > 0, norms, unseen)
    return np.asarray((vt.T / seen) / size[:, None])


def combinations(
    parameters: Sequence[Parameter],
    t: FloatArray,
    slopes: FloatArray,
    identified: Sequence[Identified],
    profiles: Sequence[Profile],
) -> tuple[Combination, ...]:
    """Products of powers that the data identify; none if every parameter is identified.

    Args: `slopes`: see `verdicts`.
    """
    if all(verdict is Identified.IDENTIFIED for verdict in identified):
        return ()
    # Products follow from the data alone: a prior by the geometry does not narrow the allowed widths.
    data = [replace(p, prior=None) if p.by_geometry else p for p in parameters]
    factor, allowed, flat = max(p.factor for p in profiles), _allowed_widths(data, t), slopes
    weak = np.array([verdict is not Identified.IDENTIFIED for verdict in identified])
    # Towards the ends of wide profiles J gets no more information than these show, unless both nearly agree
    # or a prior ends the profile.
    for profile in [p for p, is_weak in zip(profiles, weak, strict=True) if is_weak]:
        for end in profile.ends:
            way, scaled = (np.array(end) - t) / allowed, flat * allowed
            length = float(np.linalg.norm(way))
            if length > 1 / math.sqrt(2) and np.linalg.norm(scaled @ way) > _BENT * profile.factor:
                direction = way / length
                without = scaled - np.outer(scaled @ direction, direction)
                flat = np.concatenate([without, (profile.factor / length) * direction[None, :]]) / allowed
    _, s, vt = np.linalg.svd(flat * allowed, full_matrices=False)
    # Each row is the gradient of a product's logarithm; a row with one parameter is left to its verdict.
    root = _data_root(flat)
    # A profile is never wider than its prior: a direction counts from sqrt(2) on, see `verdicts`.
    strong = vt[s > math.sqrt(2) * factor]
    rows = [_simple(row, root) for row in _echelon(strong / allowed)]
    # Components along unseen directions are due to rounded exponents and do not widen the interval.
    seen, products = _data_root(slopes, unseen=math.inf), []
    for row in rows:
        used: BoolArray = row != 0
        if np.count_nonzero(used) > 1 and np.any(used & weak):
            some = [p for p, is_used in zip(parameters, used, strict=True) if is_used]
            products.append(
                Combination(
                    names=tuple(p.name for p in some),
                    exponents=tuple(float(x) for x in row[used]),
                    text=_power_text([p.symbol for p in some], row[used]),
                    value=math.exp(float(row @ t)),
                    relative_uncertainty=factor * float(np.linalg.norm(row @ seen)),
                )
            )
    return tuple(products)


def _echelon(rows: FloatArray) -> FloatArray:
    """Basis of the space of some directions with as many zeros as possible, by Gauss-Jordan elimination."""
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
    return rows


def _simple(row: FloatArray, root: FloatArray) -> FloatArray:
    """Whole exponents if these are near or about as well identified, else two decimals."""

    def width(direction: FloatArray) -> float:
        """Standard deviation along a direction, per unit of length."""
        return float(np.linalg.norm(direction @ root) / np.linalg.norm(direction))

    best, row = width(row), row / np.max(np.abs(row))
    row = row * np.sign(row[np.flatnonzero(np.abs(row) > _SIGN)[0]])
    wholes = [(largest, np.round(row * largest)) for largest in range(1, _WHOLE + 1)]
    near = [
        exponents for largest, exponents in wholes if np.max(np.abs(exponents / largest - row)) < _ROUNDED
    ]
    alike = [exponents for _, exponents in wholes if width(exponents) <= _ALIKE * best]
    for exponents in (*near, *alike):
        return np.asarray(exponents / np.gcd.reduce(exponents.astype(np.int64)))
    return np.asarray(np.round(row, 2))


def _power_text(symbols: Sequence[str], exponents: FloatArray) -> str:
    """Product of powers, such as "lambda^2/(k + 1)"."""
    sides: dict[bool, list[str]] = {True: [], False: []}
    for symbol, exponent in zip(symbols, exponents.tolist(), strict=True):
        if exponent:
            power = symbol if abs(exponent) == 1 else f"{symbol}^{abs(exponent):g}"
            sides[exponent > 0].append(power)
    above, below = " ".join(sides[True]) or "1", " ".join(sides[False])
    under = f"({below})" if len(sides[False]) > 1 else below
    return f"{above}/{under}" if under else above
