"""What the closed loop needs of a balancer: its flow law, the moment of a pair of chambers, its volumes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.scene.arrays import ComplexArray, FloatArray


class MomentCurve(Protocol):
    """Balancing moment of a pair of opposite chambers from their fill ratios."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        """Moment along the pair's axis, positive towards the chamber that has `fill_ratio`.

        Args: `fill_ratio`: x of the chamber on the positive side of the axis, any shape.
            `opposite_fill_ratio`: of the opposite chamber, broadcast with `fill_ratio`.
        """
        ...

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        """`pair_moment` and, as the imaginary part, the moment across the axis of an asymmetric chamber."""
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

    @classmethod
    def of(cls, law: CompleteLaw) -> BalancerModel:
        """The balancer that a complete law describes. Returns: BalancerModel with the law's name."""
        return cls(
            name=law.name,
            flow=law,
            moment=law.moment,
            chamber_volume=law.chamber_volume,
            tube_area=law.tube_area,
            density=law.density,
        )


class CompleteLaw(FlowLaw, Protocol):
    """A flow law that carries all else that the closed loop needs; what `load_law` returns."""

    @property
    def moment(self) -> MomentCurve:
        """The moment that goes with the law."""
        ...

    @property
    def chamber_volume(self) -> float:
        """V of one chamber, m^3."""
        ...

    @property
    def tube_area(self) -> float:
        """S, m^2."""
        ...

    @property
    def density(self) -> float:
        """rho, kg/m^3."""
        ...

    def save(self, path: Path | str) -> Path:
        """Write the law to a file that `load_law` reads back bit for bit."""
        ...
