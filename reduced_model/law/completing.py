"""A flow law that gives velocities and less than a balancer needs: the rest is that of another law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.model import BalancerModel, CompleteLaw
from ringbalance.scene.arrays import FloatArray

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
