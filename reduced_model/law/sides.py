"""Half-widths of the flow from laws at both sides of each uncertainty, and the table of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.half_widths import HalfWidths
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.heads import BACK_SHARE, SHARE
from ringbalance.reduced_model.tube.regime import ColumnFlow, TubeEnds, column_flow, driving_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.errors import larger

_FILLS: Final = 25
"""Closer to the ends, where a port is uncovered."""
_PRESSURES: Final = 41
"""Evenly up to `_HIGHEST`, then `_DOUBLINGS` more, each twice the one before."""
_HIGHEST: Final = 2.0
"""Of the largest of the scene's gas pressure, the crest's column and a full chamber's level."""
_DOUBLINGS: Final = 4
_NEAR: Final = np.concatenate(
    [-np.geomspace(0.1, 3e-4, 6), [0.0, 3e-4, 1e-3, 2e-3], np.linspace(4e-3, 0.08, 24)]
)
"""Of the highest even pressure: how far from the crest's column more stand, most where gas is carried out."""
_DIGITS: Final = 4
"""Of a half-width in the table."""


def half_width_table(laws: Sequence[CalibratedLaw], *, gas_pressure: float) -> HalfWidths:
    """Tabulate `half_widths_of` over fill and pressure.

    Args: `gas_pressure`: the scene's, Pa, around which the table is finest.
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

    The larger change by each uncertainty counts, all as the root of the sum of squares.
    Args: `laws`: the nominal one, then those at the low and the high side of each uncertainty in turn.
    Source: ASME V&V 20-2009, one input at a time.
    """
    nominal, *sides = (_velocity_and_margin(law, fill_ratio, opposite, gas_pressure, primed) for law in laws)
    changes = np.reshape(np.array(sides) - nominal, (-1, 2, *nominal.shape))
    return np.asarray(np.sqrt(np.sum(np.nan_to_num(larger(changes)) ** 2, axis=0)))


def _velocity_and_margin(
    law: CalibratedLaw,
    fill_ratio: FloatArray,
    opposite: FloatArray,
    gas_pressure: FloatArray,
    primed: BoolArray,
) -> FloatArray:
    """Speed of the flow in either direction, m/s, and margin over the crest, Pa, NaN without a flow out.

    Returns: Shape (2, ...). Source: `column_flow`, by the law's tables of heads.
    """
    x, y = np.minimum(fill_ratio, law.max_fill_ratio), np.clip(opposite, 0.0, law.max_fill_ratio)
    ahead = law.ends(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=gas_pressure)
    flow = _directed(law, ahead, primed, reverse=False)
    speed, flows = flow.velocity.copy(), flow.velocity > 0
    margin = flow.holding - lost_to_crest(law, ahead, reverse=False) if law.path.crest else 0.0 * speed
    back = TubeEnds(*(each[~flows] for each in ahead)).reversed()
    speed[~flows] = _directed(law, back, primed[~flows], reverse=True).velocity
    return np.array([speed, np.where(flows, margin, np.nan)])


def _directed(
    law: CalibratedLaw, ends: TubeEnds, primed: BoolArray, *, reverse: bool
) -> ColumnFlow[FloatArray]:
    def under(way: Table | None, pressure: FloatArray, where: BoolArray) -> FloatArray:
        return np.where(where, law.heads.velocity(np.maximum(pressure, 0.0) / law.density, way), 0.0)

    separation = partial(under, law.heads.to_crest(reverse=reverse))
    return column_flow(law.path, ends, primed=primed, siphon=partial(under, None), separation=separation)


def lost_to_crest(law: CalibratedLaw, ends: TubeEnds, *, reverse: bool) -> FloatArray:
    """Pressure that a full siphon loses from its upstream chamber to the crest, Pa."""
    driving = np.maximum(driving_pressure(law.path, ends), 0.0)
    column = BACK_SHARE if reverse and law.heads.return_hump else SHARE
    return np.asarray(law.heads.siphon.cubic((driving / law.density) ** 0.125, column) * driving)
