"""Moment of a pair over the fill of its positive chamber, tabulated in a record of type `PLANT`."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.arrays import Record
from ringbalance.scene.platform.compiled import in_place

MOMENT_NODES: Final = 513
"""Number of equally spaced nodes; cubic between them."""
END_STEP: Final = 1e-3
"""Fraction of the range of x over which a slope at its end is taken."""
_HALVINGS: Final = 60


def tabulate_moment(plant: Record, model: BalancerModel, *, total: float) -> None:
    """Write a balancer's moment of a pair whose two fill ratios sum to `total`, with its slopes."""
    largest = model.flow.max_fill_ratio
    lowest, highest = max(0.0, total - largest), min(total, largest)

    # Nodes and their middles: a slope is that between the middles on both sides.
    x = np.linspace(lowest, highest, 2 * MOMENT_NODES - 1)
    moment = model.moment.pair_vector(fill_ratio=x, opposite_fill_ratio=np.maximum(total - x, 0.0))
    middle = np.concatenate([moment[:1], moment[1::2], moment[-1:]])
    slope = np.diff(middle)
    slope[0] = 4.0 * moment[1] - 3.0 * moment[0] - moment[2]
    slope[-1] = 3.0 * moment[-1] - 4.0 * moment[-2] + moment[-3]
    plant["total"], plant["lowest_fill"] = total, lowest
    plant["moment_step"] = (highest - lowest) / (MOMENT_NODES - 1)
    plant["moment"][:, 0], plant["moment"][:, 1] = moment[::2], slope


@in_place
def pair_moment(plant: Record, fill: float) -> complex:
    """Moment of one pair along its axis and across it, kg m."""
    nodes, last = plant.moment, MOMENT_NODES - 1
    position = min(max((fill - plant.lowest_fill) / plant.moment_step, 0.0), float(last))
    cell = min(int(position), last - 1)
    part, rise, d0, d1 = (
        position - cell,
        nodes[cell + 1, 0] - nodes[cell, 0],
        nodes[cell, 1],
        nodes[cell + 1, 1],
    )
    change = part * (d0 + part * (3.0 * rise - 2.0 * d0 - d1 + part * (d0 + d1 - 2.0 * rise)))
    return complex(nodes[cell, 0] + change)


@in_place
def fill_for_moment(plant: Record, moment: float, lowest: float, highest: float) -> float:
    """Fill ratio of the positive chamber at which a pair has a moment, kg m, growing with that fill.

    Beyond the ends it is extrapolated linearly and so may lie outside [lowest, highest].
    """
    if highest <= lowest:
        return lowest
    short = END_STEP * (highest - lowest)
    low, high = pair_moment(plant, lowest).real, pair_moment(plant, highest).real
    if moment <= low:
        rise = pair_moment(plant, lowest + short).real - low
        return lowest + (moment - low) / rise * short
    if moment >= high:
        rise = high - pair_moment(plant, highest - short).real
        return highest + (moment - high) / rise * short
    for _ in range(_HALVINGS):
        middle = (lowest + highest) / 2.0
        if pair_moment(plant, middle).real >= moment:
            highest = middle
        else:
            lowest = middle
    return highest
