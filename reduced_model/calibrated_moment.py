"""Balancing moment of a pair of chambers from finite elements, as a smooth table over the fill ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.hermite import HermiteTable

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMoment:
    """U(x) of one chamber; a pair's moment is U(x_A) - U(x_C)."""

    chamber_moment: HermiteTable
    """U, kg m, over the fill ratio."""
    half_width: HermiteTable
    """95 % half-width of U, kg m, over the fill ratio: numerical, interpolation and left-out terms."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        """Moment along the pair's axis, positive towards the chamber that has `fill_ratio`.

        Args:
            fill_ratio: x of the chamber on the positive side of the axis, any shape.
            opposite_fill_ratio: of the opposite chamber, broadcast with `fill_ratio`.

        Returns:
            Moment, kg m, of the broadcast shape.
        """
        return np.asarray(self.chamber_moment(fill_ratio) - self.chamber_moment(opposite_fill_ratio))
