"""Least-squares fits of the error of a number over more than three meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.physics.roots import bracketed_minimum
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Fit:
    """One fit phi_i = limit + sum_k a_k h_i^p_k."""

    limit: float
    """phi for vanishing cells."""
    error: float
    """phi(h1) - limit as the fit has it."""
    misfit: float
    """Finest value minus the fit there."""
    deviation: float
    """Standard deviation of the fit, weighted as the fit was."""
    observed_order: float
    """Of the free fit, whether or not it was kept."""
    order: float
    """Highest power in the fit that was kept."""


def best_fit(values: FloatArray, sizes: FloatArray, *, formal_order: float) -> Fit:
    """The fit with a free order when that lies within [0.5, formal], else the best one of fixed orders.

    Fixed orders: formal; formal/2; and, when convergence is slower than 0.5, both together.  Every fit is
    tried with equal weights and with weights proportional to 1/h; the one with the smaller deviation is kept.
    Args: `values`: finest first, shape (n,), at least four.
    Source: Eca and Hoekstra (2014), section 3, doi:10.1016/j.jcp.2014.01.006; their orders 1 and 2 stand here
        as half the formal order and the formal order.
    """
    h = sizes / sizes[0]
    free = min((_free(values, h, w, formal_order) for w in _weights(h)), key=lambda fit: fit.deviation)
    if 0.5 <= free.observed_order <= 1.05 * formal_order:
        return free
    powers: list[tuple[float, ...]] = [(formal_order,), (formal_order / 2,)]
    if free.observed_order < 0.5:
        powers.append((formal_order / 2, formal_order))
    fits = [_linear(values, h, w, p, free.observed_order) for p in powers for w in _weights(h)]
    return min(fits, key=lambda fit: fit.deviation)


def _weights(h: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.full(h.size, 1 / h.size), (1 / h) / np.sum(1 / h)


def _free(values: FloatArray, h: FloatArray, weights: FloatArray, formal_order: float) -> Fit:
    def deviation(order: float) -> float:
        return _linear(values, h, weights, (order,), order).deviation

    # The deviation may have a second valley; a coarse scan finds the right one.
    grid = np.concatenate([-np.arange(0.1, 3.05, 0.1)[::-1], np.arange(0.1, 2.5 * formal_order, 0.1)])
    start = float(grid[int(np.argmin([deviation(p) for p in grid]))])
    low, high = start - 0.1, start + 0.1
    if low <= 0 <= high:
        low, high = (0.02, high) if start > 0 else (low, -0.02)
    order = bracketed_minimum(deviation, low, high, tolerance=1e-9)
    return _linear(values, h, weights, (order,), order)


def _linear(
    values: FloatArray, h: FloatArray, weights: FloatArray, powers: tuple[float, ...], observed: float
) -> Fit:
    columns = np.stack([np.ones(h.size), *(h**p for p in powers)], axis=1)
    root = np.sqrt(weights)
    scale = np.abs(columns).max(axis=0)
    shift = values[0]  # the fit is of changes, so that a large common value costs no digits
    coefficients = np.linalg.lstsq(columns / scale * root[:, None], (values - shift) * root, rcond=None)[0]
    coefficients = coefficients / scale
    residual = values - shift - columns @ coefficients
    freedom = max(values.size - len(powers) - 2, 1) if len(powers) == 1 else max(values.size - 3, 1)
    return Fit(
        limit=float(coefficients[0] + shift),
        error=float(np.sum(coefficients[1:])),
        misfit=float(residual[0]),
        deviation=float(np.sqrt(values.size * np.sum(weights * residual**2) / freedom)),
        observed_order=observed,
        order=max(powers),
    )
