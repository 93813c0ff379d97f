"""Laws to try integrators on, made from the paper's; here its velocity times a share set by the fill."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class TrialLaw:
    """What every such law has of the paper's."""

    name: str
    base: PaperLaw

    @property
    def max_fill_ratio(self) -> float:
        """Of the paper's law."""
        return self.base.max_fill_ratio

    def table(self) -> Mapping[str, FloatArray]:
        """Of the paper's law."""
        return self.base.table()


@dataclass(frozen=True, kw_only=True)
class SlowedLaw(TrialLaw):
    """The paper's law, slower in the share of its velocity that a function of the fill gives."""

    share: Callable[[FloatArray, float], FloatArray]
    """From x of the driven chamber and the largest x."""

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """As the paper's law, slowed.

        Args: `fill_ratio`: x of the driven chamber, any shape. `gas_pressure`: gauge, Pa.
        """
        flow = self.base.evaluate(
            fill_ratio=fill_ratio,
            opposite_fill_ratio=opposite_fill_ratio,
            gas_pressure=gas_pressure,
            primed=primed,
        )
        share = self.share(np.asarray(fill_ratio, dtype=np.float64), self.max_fill_ratio)
        return replace(flow, velocity=flow.velocity * share)
