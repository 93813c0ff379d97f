"""Types of arrays for all packages, and helpers that numpy lacks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ComplexArray = npt.NDArray[np.complex128]
StringArray = npt.NDArray[np.str_]
Records = npt.NDArray[np.void]
"""A structured array."""
Record = Any
"""One element of a structured array, which compiled code changes in place."""


def clipped(values: npt.ArrayLike, low: float, high: float) -> FloatArray:
    """Values within limits, in a third of the time that np.clip takes for a few numbers."""
    return np.minimum(np.maximum(values, low), high)


def stretches(values: Sequence[Any]) -> list[tuple[Any, slice]]:
    """Value and slice of each block of equal values; a slice includes the next block's first value, so that a
    drawn line has no gap."""
    parts, start = [], 0
    for value, members in groupby(values):
        stop = start + len(list(members))
        parts.append((value, slice(start, min(stop + 1, len(values)))))
        start = stop
    return parts


def plain(values: npt.ArrayLike) -> Any:
    """Float of a single number (one scene), else an array (many designs)."""
    array = np.asarray(values, dtype=np.float64)
    return float(array) if array.ndim == 0 else array


def finite(value: float | None) -> float | None:
    """A finite number, else None: JSON has no infinity and no NaN."""
    return value if value is not None and math.isfinite(value) else None


def as_real(matrix: npt.ArrayLike) -> FloatArray:
    """Matrix with each complex number c as ((Re c, -Im c), (Im c, Re c)), shape (2 n, 2 m)."""
    values = np.asarray(matrix, dtype=np.complex128)
    return np.kron(values.real, np.eye(2)) + np.kron(values.imag, [[0.0, -1.0], [1.0, 0.0]])


def within_since(time: FloatArray, values: FloatArray, *, limit: float) -> float | None:
    """Time from which on values stay within a limit to the end; None: the last one exceeds it."""
    above = np.flatnonzero(values > limit)
    first = int(above[-1]) + 1 if above.size else 0
    return None if first == time.size else float(time[first])
