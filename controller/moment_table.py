"""Moment of a pair of chambers over its fill as a table, which compiled code reads."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from ringbalance.controller.formulas import piece_rise
from ringbalance.controller.loop_records import MOMENT_NODES
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.platform.compiled import in_place

_piece_rise: Final[Any] = in_place(piece_rise)


class MomentTable(NamedTuple):
    """Moment of a pair over the fill of its positive chamber, cubic between equally spaced nodes."""

    lowest: float
    """Smallest x."""
    step: float
    """Distance of the nodes."""
    nodes: ComplexArray
    """Moment along the pair's axis and across it, kg m, and its slope, kg m per step, shape (n, 2)."""

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
        return cls(lowest=float(lowest), step=float(step), nodes=np.stack([of(x), slope], axis=1))


@in_place
def pair_moment(nodes: ComplexArray, lowest: float, step: float, fill: float) -> complex:
    """Of one pair along its axis and across it, kg m."""
    last = nodes.shape[0] - 1
    place = min(max((fill - lowest) / step, 0.0), float(last))
    cell = min(int(place), last - 1)
    rise = nodes[cell + 1, 0] - nodes[cell, 0]
    return complex(nodes[cell, 0] + _piece_rise(place - cell, rise, nodes[cell, 1], nodes[cell + 1, 1]))
