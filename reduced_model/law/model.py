"""What the closed loop needs of a balancer: flow law, moment, volumes; completed where a law gives less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import Flow, FlowLaw
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


_OF_BALANCER: Final = ("max_fill_ratio", "moment", "chamber_volume", "tube_area", "density")


@dataclass(frozen=True, kw_only=True)
class _Velocities:
    """The velocities of a law, and the two attributes that every law has."""

    law: Any
    name: str
    max_fill_ratio: float

    def evaluate(self, **conditions: Any) -> Flow:
        flow: Flow = self.law.evaluate(**conditions)
        return flow

    def table(self) -> Mapping[str, FloatArray]:
        return {}


def lacking(law: object) -> tuple[str, ...]:
    """Names of what a law does not give of what a balancer needs besides its velocities."""
    return tuple(name for name in _OF_BALANCER if not hasattr(law, name))


def completed_model(law: object, *, by: CompleteLaw) -> BalancerModel:
    """The balancer of a law of the caller's own; what it lacks is that of `by`.

    A law that wraps one of the program's does not go by the name of that one.

    Raises: TypeError: a law without velocities.
    """
    if not callable(getattr(law, "evaluate", None)):
        raise TypeError("a flow law has evaluate(*, fill_ratio, opposite_fill_ratio, gas_pressure, primed)")
    given = {name: getattr(law, name, getattr(by, name)) for name in _OF_BALANCER}
    largest, name = given.pop("max_fill_ratio"), getattr(law, "name", "")
    if name in ("", by.name, "paper"):
        name = type(law).__name__
    return BalancerModel(name=name, flow=_Velocities(law=law, name=name, max_fill_ratio=largest), **given)
