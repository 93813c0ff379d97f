"""Moment of a pair as a table over the fill of its positive chamber."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.formulas.paths import piece_rise
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import ComplexArray, FloatArray

MOMENT_NODES: Final = 4097


class MomentTable(NamedTuple):
    """Moment of a pair over the fill of its positive chamber, cubic between equally spaced nodes."""

    lowest: float
    """Smallest x."""
    step: float
    """Distance of the nodes."""
    value: ComplexArray
    """Along the pair's axis and across it, kg m, shape (n,)."""
    slope: ComplexArray
    """kg m per step, shape (n,)."""

    def at(self, fill: FloatArray) -> ComplexArray:
        """Moment of the pair, kg m, for fills of the positive chamber."""
        place = np.clip((fill - self.lowest) / self.step, 0.0, self.value.size - 1.0)
        cell = np.minimum(place.astype(np.intp), self.value.size - 2)
        t = place - cell
        y0, d0 = self.value[cell], self.slope[cell]
        rise, d1 = self.value[cell + 1] - y0, self.slope[cell + 1]
        return np.asarray(y0 + piece_rise(t, rise, d0, d1))

    @classmethod
    def of(cls, *, model: BalancerModel, total: float) -> MomentTable:
        """Tabulate a balancer's moment of a pair whose two fill ratios sum to `total`."""
        largest = model.flow.max_fill_ratio
        lowest, highest = max(0.0, total - largest), min(total, largest)
        step = (highest - lowest) / (MOMENT_NODES - 1)

        def of(x: FloatArray) -> ComplexArray:
            held = np.clip(x, lowest, highest)
            return model.moment.pair_vector(fill_ratio=held, opposite_fill_ratio=total - held)

        x = np.linspace(lowest, highest, MOMENT_NODES)
        before, after = np.maximum(x - step / 2, lowest), np.minimum(x + step / 2, highest)
        slope = (of(after) - of(before)) / (after - before) * step
        return cls(lowest=float(lowest), step=float(step), value=of(x), slope=slope)
