"""Discretisation error of a number, estimated from three meshes.

The procedure of Celik et al. (2008), with the order capped at the formal one of the quantity at hand.
Differences that are only round-off, oscillate or grow are reported as such, not as an order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ringbalance.scene.arrays import FloatArray

_LOWEST_ORDER = 0.5
_HIGHEST_ORDER = 50.0
_EPSILON = float(np.finfo(np.float64).eps)


class GridVerdict(StrEnum):
    """Convergence behaviour of the values on three meshes."""

    MONOTONE = "monotone"
    OSCILLATORY = "oscillatory"
    ROUND_OFF = "round_off"
    NOT_ASYMPTOTIC = "not_asymptotic"
    DIVERGING = "diverging"


_TEXT = {
    GridVerdict.MONOTONE: "converges steadily at about its formal order",
    GridVerdict.OSCILLATORY: "oscillates from mesh to mesh: add a finer mesh before trusting the order",
    GridVerdict.ROUND_OFF: "has converged to round-off: no order can be seen, and none is needed",
    GridVerdict.NOT_ASYMPTOTIC: "is not yet in its asymptotic range: add a finer mesh",
    GridVerdict.DIVERGING: "does not converge on these meshes: look for an error before refining",
}


@dataclass(frozen=True, kw_only=True)
class GridConvergence:
    """Order, limit and uncertainty of one number computed on several meshes."""

    verdict: GridVerdict
    observed_order: float
    """Observed order with its sign and before any cap; zero where none can be seen."""
    order: float
    """The order that the uncertainty rests on, within [0.5, formal order]; zero where none was used."""
    extrapolated: float
    """Limit for vanishing mesh size with the observed order; the finest value where there is no order."""
    approximate_error: float
    """Change from the second mesh to the finest, relative."""
    extrapolated_error: float
    """Distance from the finest value to the limit, relative to the limit."""
    index: float
    """Grid convergence index of the finest mesh with the observed order, relative; zero at round-off."""
    uncertainty: float
    """Expanded uncertainty (95 %) about the finest value, in its own unit."""
    text: str
    """Kind of convergence and what to do next."""


def gci(
    *,
    values: Sequence[float],
    sizes: Sequence[float],
    formal_order: float,
    round_off: float = 0.0,
    safety: float = 1.25,
) -> GridConvergence:
    """Grid convergence of one number by Celik's procedure.

    p = |ln|e32/e21| + q(p)| / ln r21, q(p) = ln((r21^p - s)/(r32^p - s)), s = sign(e32/e21),
    GCI = 1.25 e_a / (r21^p - 1); the half-width takes p no higher than the formal order, and is at least what
    the two coarser meshes predict.
    Args:
        values: three values of the number, finest mesh first, in any one unit.
        sizes: three sizes of the cells, finest first, in any one unit, strictly increasing.
        formal_order: order at which this number should converge; that of a functional is higher than its
            field's.
        round_off: bound of the noise in each value, in its unit; never taken below 8 ulp of the largest
            value.
        safety: factor on the estimated error.
    Returns: The record; its uncertainty is a half-width about values[0].
    Raises: ValueError: not three values, sizes that do not grow, or a value that is not finite.
    Source: Celik et al. (2008), doi:10.1115/1.2960953.
    """
    phi, h = np.asarray(values, dtype=np.float64), np.asarray(sizes, dtype=np.float64)
    if not phi.shape == h.shape == (3,):
        raise ValueError("values and sizes must be two sequences of three")
    if not (np.all(np.isfinite(phi)) and np.all(np.isfinite(h)) and formal_order > 0):
        raise ValueError("values and sizes must be finite, and formal_order positive")
    if h[0] <= 0 or np.any(np.diff(h) <= 0):
        raise ValueError("sizes must be positive and grow from the finest mesh to the coarsest")
    noise = max(round_off, 8 * _EPSILON * float(np.abs(phi).max()))
    e21, e32 = float(phi[1] - phi[0]), float(phi[2] - phi[1])
    r21, r32 = float(h[1] / h[0]), float(h[2] / h[1])
    # The last change is rounding only if the coarser pair predicts it: errors may cross zero by accident.
    foretold = abs(e32) / (r32**formal_order - 1) / r21**formal_order
    if abs(e21) <= noise and foretold <= 10 * noise:
        return _record(GridVerdict.ROUND_OFF, phi, 0.0, 0.0, float(phi[0]), 0.0, noise + abs(e21))
    if abs(e32) <= noise:
        return _record(GridVerdict.DIVERGING, phi, 0.0, 0.0, phi[0], 0.0, 3 * abs(e21) + noise)
    observed = _celik_order(e21, e32, r21, r32)
    if observed <= 0:
        half_width = 3 * max(abs(e21), abs(e32)) + noise
        return _record(GridVerdict.DIVERGING, phi, observed, 0.0, phi[0], 0.0, half_width)
    gain = r21**observed - 1
    order = float(np.clip(observed, _LOWEST_ORDER, formal_order))
    # An order above the formal one means that leading errors cancel here; the coarser pair still sees them.
    foretold = abs(e32) / (r32**order - 1) / r21**order
    error = max(abs(e21) / (r21**order - 1), foretold if observed > formal_order else 0.0)
    verdict = GridVerdict.NOT_ASYMPTOTIC
    if e21 * e32 < 0:
        verdict, error = GridVerdict.OSCILLATORY, max(error, float(np.ptp(phi)) / 2)
    elif 0.5 * formal_order <= observed <= 1.5 * formal_order:
        verdict = GridVerdict.MONOTONE
    half_width = safety * error + noise
    return _record(verdict, phi, observed, order, phi[0] - e21 / gain, safety * abs(e21) / gain, half_width)


def _celik_order(e21: float, e32: float, r21: float, r32: float) -> float:
    """Observed order from two changes, by fixed-point iteration; negative when the changes grow.

    Args: `e21`: zero counts as the highest order. `e32`: not zero.
    Returns: p with the sign that Celik's absolute value drops; limited to +-50.
    Source: Celik et al. (2008), Eqs. 5a to 5c, doi:10.1115/1.2960953.
    """
    if e21 == 0:
        return _HIGHEST_ORDER
    ratio = e32 / e21
    s, logarithm = np.sign(ratio), np.log(abs(ratio))
    p = float(logarithm / np.log(r21))
    if abs(r21 - r32) <= 1e-12 * r21:
        return float(np.clip(p, -_HIGHEST_ORDER, _HIGHEST_ORDER))
    for _ in range(200):
        size = float(np.clip(abs(p), 1e-6, _HIGHEST_ORDER))
        update = float((logarithm + np.log((r21**size - s) / (r32**size - s))) / np.log(r21))
        if abs(update - p) <= 1e-12 * max(1.0, abs(p)):
            break
        p = update
    return float(np.clip(p, -_HIGHEST_ORDER, _HIGHEST_ORDER))


def _record(
    verdict: GridVerdict,
    phi: FloatArray,
    observed: float,
    order: float,
    limit: float,
    index: float,
    half_width: float,
) -> GridConvergence:
    scale = float(abs(phi[0])) or float(np.abs(phi).max()) or 1.0
    return GridConvergence(
        verdict=verdict,
        observed_order=observed,
        order=order,
        extrapolated=float(limit),
        approximate_error=abs(float(phi[1] - phi[0])) / scale,
        extrapolated_error=abs(float(limit - phi[0])) / (abs(float(limit)) or scale),
        index=float(index) / scale,
        uncertainty=float(half_width),
        text=f"{_TEXT[verdict]} (observed order {observed:.2f})",
    )
