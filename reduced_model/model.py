"""What the closed loop needs of a balancer: its flow law, the moment of a pair of chambers, its volumes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.flow_law import FlowLaw

FloatArray = npt.NDArray[np.float64]


class MomentCurve(Protocol):
    """Balancing moment of a pair of opposite chambers from their fill ratios."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        """Moment along the pair's axis, positive towards the chamber that has `fill_ratio`.

        Args:
            fill_ratio: x of the chamber on the positive side of the axis, any shape.
            opposite_fill_ratio: of the opposite chamber, broadcast with `fill_ratio`.

        Returns:
            Moment, kg m, of the broadcast shape.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class BalancerModel:
    """One balancer as the closed loop sees it."""

    name: str
    """ "paper", "calibrated", ..."""
    flow: FlowLaw
    moment: MomentCurve
    chamber_volume: float
    """V of one chamber, m^3."""
    tube_area: float
    """S, m^2."""
    density: float
    """kg/m^3."""
