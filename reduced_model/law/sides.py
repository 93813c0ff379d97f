"""Half-widths of the flow, from laws with each uncertain input at its low and its high side, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.half_widths import HalfWidths
from ringbalance.reduced_model.pieces import point
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.errors import larger
from ringbalance.scene.registry import registered

_FILLS: Final = 25
"""Number of fills, denser towards the ends, where a port is uncovered."""
_PRESSURES: Final = 41
"""Number of even pressures up to `_HIGHEST`; `_DOUBLINGS` more follow, each twice the one before."""
_HIGHEST: Final = 2.0
"""Ratio of the highest even pressure to the largest of gas pressure, D_m and level of a full chamber."""
_DOUBLINGS: Final = 4
_NEAR: Final = np.concatenate(
    [-np.geomspace(0.1, 3e-4, 6), [0.0, 3e-4, 1e-3, 2e-3], np.linspace(4e-3, 0.08, 24)]
)
"""Distances of further nodes from D_m, over the highest even pressure; densest where the flow carries gas
out."""
_DIGITS: Final = 4
"""Significant digits of a half-width in the table."""


def half_width_table(laws: Sequence[CalibratedLaw], *, gas_pressure: float) -> HalfWidths:
    """Tabulate `half_widths_of` over fill and pressure.

    Args: `gas_pressure`: the scene's, Pa; the even pressures reach at least twice as high.
    """
    law, top = laws[0], laws[0].max_fill_ratio
    crest, full = law.path.column_pressure, float(law.hydrostatic_pressure(top))
    highest = _HIGHEST * max(law.gas_factor * gas_pressure, crest, full)
    fills = top * (1 - np.cos(np.linspace(0.0, np.pi, _FILLS))) / 2
    doubled = highest * 2.0 ** np.arange(1, _DOUBLINGS + 1)
    parts = np.linspace(0.0, highest, _PRESSURES), doubled, np.maximum(crest + highest * _NEAR, 0.0)
    pressures = np.unique(np.concatenate(parts))
    primed, fill, pressure = np.meshgrid([False, True], fills, pressures, indexing="ij")
    gas = (pressure - law.hydrostatic_pressure(fill)) / law.gas_factor
    width = half_widths_of(laws, fill, top - fill, gas, primed)
    scale = 10.0 ** (_DIGITS - 1 - np.floor(np.log10(np.where(width > 0, width, 1.0))))
    velocity, margin = (np.rint(width * scale) / scale).reshape(2, -1)
    return HalfWidths(fill_ratio=fills, wall_pressure=pressures, velocity=velocity, margin=margin)


def half_widths_of(
    laws: Sequence[CalibratedLaw],
    fill_ratio: FloatArray,
    opposite: FloatArray,
    gas_pressure: FloatArray,
    primed: BoolArray,
) -> FloatArray:
    """Half-widths of the velocity, m/s, and of the margin over the crest, Pa, shape (2, ...).

    Each uncertainty counts with the larger of its two changes; they combine as root sum of squares.
    Args: `laws`: the nominal one, then those at the low and the high side of each uncertainty in turn.
    Source: ASME V&V 20-2009, one input at a time.
    """
    answer_each = registered("function", "answer_each")
    shape = np.shape(fill_ratio)
    # Copies: the code is compiled for writeable arrays.
    conditions = [np.array(each).ravel() for each in (fill_ratio, opposite, gas_pressure, primed)]
    query, size = np.zeros(point.PLACES_OF_QUERY), conditions[0].size
    answers = np.empty((len(laws), 2, *shape))
    for law, (speed, margin) in zip(laws, answers.reshape(len(laws), 2, size), strict=True):
        numbers, pieces = law.constants
        numbers = numbers.copy()
        # Nodes of the table may lie below vacuum.
        numbers[point.LEAST_PRESSURE] = -np.inf
        columns = speed, np.empty(size, dtype=np.int64), np.empty(size, dtype=np.bool_), margin
        answer_each(numbers, pieces, tuple(conditions), query, columns)
        margin[speed <= 0.0] = np.nan
        np.abs(speed, out=speed)
    changes = np.reshape(answers[1:] - answers[0], (-1, 2, 2, *shape))
    return np.asarray(np.sqrt(np.sum(np.nan_to_num(larger(changes)) ** 2, axis=0)))
