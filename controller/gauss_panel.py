"""A panel of Gauss-Legendre nodes in a variable z: its integral, and where a part of it is about reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

FloatArray = npt.NDArray[np.float64]

NODES: Final = 12
"""Points of a panel."""

_NODE, _NODE_WEIGHT = legendre.leggauss(NODES)
ABSCISSA: Final[FloatArray] = (1 + _NODE) / 2
"""Nodes on [0, 1]."""
WEIGHT: Final[FloatArray] = _NODE_WEIGHT / 2
"""Weights on [0, 1]."""
_DEGREE: Final = np.arange(NODES) + 0.5
_TO_SERIES: Final = _DEGREE[:, None] * (_NODE_WEIGHT * legendre.legvander(_NODE, NODES - 1).T)
_GRID: Final = np.linspace(-1.0, 1.0, 33)
_POLISH: Final = 2


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Nodes from `bottom` to `top` with the integrand at each."""

    top: float
    bottom: float
    integrand: FloatArray
    """At bottom + (top - bottom) ABSCISSA, shape (NODES,), positive."""

    @property
    def integral(self) -> float:
        """Over the panel, by Gauss's rule."""
        return float(self.integrand @ WEIGHT) * (self.top - self.bottom)

    def reached(self, part: FloatArray) -> FloatArray:
        """Estimate the z from which the integral up to `top` has a value, by the nodes' polynomial.

        Args:
            part: values between zero and the integral, shape (m,).

        Returns:
            z within the panel, shape (m,).
        """
        half = (self.top - self.bottom) / 2
        series = _TO_SERIES @ self.integrand * half
        below = legendre.legint(series, lbnd=-1)
        wanted = self.integral - part
        s = np.interp(wanted, np.maximum.accumulate(legendre.legval(_GRID, below)), _GRID)
        for _ in range(_POLISH):
            slope = np.maximum(legendre.legval(s, series), np.finfo(np.float64).tiny ** 0.5)
            s = np.clip(s - (legendre.legval(s, below) - wanted) / slope, -1.0, 1.0)
        return np.asarray(self.bottom + half * (1 + s), dtype=np.float64)


def three_panels(top: float, bottom: float) -> tuple[tuple[float, float], ...]:
    """A panel and its two halves, the upper one first.

    Args:
        top: upper end.
        bottom: lower end.

    Returns:
        (top, bottom) of each.
    """
    middle = (top + bottom) / 2
    return (top, bottom), (top, middle), (middle, bottom)


def nodes(ends: tuple[tuple[float, float], ...]) -> FloatArray:
    """Nodes of several panels.

    Args:
        ends: (top, bottom) of each.

    Returns:
        z, shape (panels, NODES).
    """
    top, bottom = (np.array(end)[:, None] for end in zip(*ends, strict=True))
    return np.asarray(bottom + (top - bottom) * ABSCISSA, dtype=np.float64)
