"""Balancing moment of a pair of chambers from finite elements, as a smooth table over the fill ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMoment:
    """U(x) of one chamber; a pair's moment is U(x_A) - U(x_C)."""

    chamber_moment: HermiteTable
    """U, kg m, over the fill ratio."""
    half_width: HermiteTable
    """Expanded uncertainty (95 %) of U, kg m, over the fill ratio: numerical, interpolation and left-out
    terms."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        return np.asarray(self.chamber_moment(fill_ratio) - self.chamber_moment(opposite_fill_ratio))
