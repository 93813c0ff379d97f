"""Balancing moment of a pair of chambers from finite elements, as a smooth table over the fill ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.scene.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMoment:
    """U(x) of one chamber along its middle, and W(x) across it; a pair's is U(x_A) - U(x_C), W alike."""

    chamber_moment: HermiteTable
    """U, kg m, over the fill ratio."""
    half_width: HermiteTable
    """Expanded uncertainty (95 %) of U, kg m, over the fill ratio: numerical, interpolation and left-out
    terms."""
    across: HermiteTable | None = None
    """W, kg m, over the fill ratio, in the sense of the rotation; None for a symmetric chamber."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        return np.asarray(self.chamber_moment(fill_ratio) - self.chamber_moment(opposite_fill_ratio))

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        along = self.pair_moment(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
        if self.across is None:
            return np.asarray(along, dtype=np.complex128)
        return np.asarray(along + 1j * (self.across(fill_ratio) - self.across(opposite_fill_ratio)))
