"""The one interface of every flow law, so that the closed loop does not know which it has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy.typing as npt

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray


class Regime(IntEnum):
    """How the connecting tube flows."""

    BLOCKED = 0
    SIPHON = 1
    SEPARATED = 2
    REVERSE = 3
    UNDECIDED = 4
    """Siphon or separated: the uncertainty of the pressure over the crest allows both."""

    @property
    def label(self) -> str:
        """As it stands in JSON: the lower-case name, or "cannot be told"."""
        return "cannot be told" if self is Regime.UNDECIDED else self.name.lower()


@dataclass(frozen=True, kw_only=True)
class Flow:
    """State of the tube for arrays of conditions, all of one shape."""

    velocity: FloatArray
    """Mean velocity, m/s, positive out of the driven chamber; zero where blocked."""
    regime: IntArray
    """Values of `Regime`."""
    uncertainty: FloatArray
    """Expanded uncertainty (95 %) of the velocity, m/s."""
    primed: BoolArray
    """Whether the tube holds a continuous column afterwards."""


class FlowLaw(Protocol):
    """Velocity in the connecting tube; arrays in, arrays out, SI."""

    @property
    def name(self) -> str:
        """Short name for results: "paper", "calibrated", ..."""
        ...

    @property
    def max_fill_ratio(self) -> float:
        """Liquid of the pair as a share of one chamber's volume."""
        ...

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """Flow for a driven chamber's fill ratio and gauge gas pressure.

        Args:
            fill_ratio: x of the driven chamber, any shape, within [0, max_fill_ratio].
            opposite_fill_ratio: of the opposite chamber; default max_fill_ratio - fill_ratio.
            gas_pressure: gauge, Pa, in the driven chamber; the opposite one is vented.
            primed: whether the tube holds a continuous column beforehand.
        Returns: Flow, of the broadcast shape of the arguments.
        Raises: ValueError: a fill ratio outside the range, a NaN, or a negative absolute pressure.
        """
        ...

    def table(self) -> Mapping[str, FloatArray]:
        """Plain arrays for compiled code, named in the implementing law's docstring."""
        ...
