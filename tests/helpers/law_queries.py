"""Queries of a flow law over all regimes, near a stall, and outside what it holds for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ringbalance.export.compact import CompactLaw
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.query import answer
from ringbalance.scene.arrays import FloatArray


def queries(law: CalibratedLaw, count: int, *, seed: int = 1, outside: bool = False) -> FloatArray:
    """Fill, opposite fill, gas pressure and primed; shape (4, count)."""
    rng = np.random.default_rng(seed)
    most, ambient = law.max_fill_ratio, law.ambient_pressure
    x, y = rng.uniform(0.0, most, (2, count))
    x[::10], y[::11], y[1::3] = 0.0, most, most - x[1::3]
    p = rng.uniform(-ambient, 1e6, count)
    p[::7] = 0.0
    near = slice(2, None, 4)
    level = np.maximum(law.hydrostatic_pressure(np.stack([x, y])), 0.0)
    stall = np.maximum(level[1], law.path.port_pressure) - level[0]
    driven = stall[near] + 10 ** rng.uniform(-1.0, 5.0, stall[near].size) * rng.choice([-1.0, 1.0])
    p[near] = np.maximum(driven, -ambient)
    found = np.stack([x, y, p, rng.integers(0, 2, count).astype(float)])
    if outside:
        odd = [-1.0, -1e-10, 0.6, 2.0, np.nan, np.inf, -np.inf, 5e-324, 1e13, -2e5]
        found[rng.integers(0, 3, count // 20), rng.integers(0, count, count // 20)] = rng.choice(
            odd, count // 20
        )
    return found


def answers(law: CompactLaw, asked: FloatArray) -> Iterator[list[float]]:
    """Velocity, regime, status and primed of each query, by the program's own evaluator."""
    for query in asked.T.tolist():
        w = query + [0.0] * (point.PLACES_OF_QUERY - 4)
        answer(law.constants, *law.tables, w)
        yield w[point.VELOCITY : point.PRIMED_AFTER + 1]
