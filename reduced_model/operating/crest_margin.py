"""Margin of a full siphon's crest pressure above the cavity pressure, with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Conditions
from ringbalance.reduced_model.tube.directed_flow import Drive, siphon_margin
from ringbalance.reduced_model.tube.heads import velocity_of
from ringbalance.reduced_model.tube.regime import TubeEnds


@dataclass(frozen=True, kw_only=True)
class DirectedState:
    """One state of the tube, in one direction of flow."""

    reverse: bool
    """Whether the opposite chamber is upstream."""
    conditions: Conditions
    drive: Drive
    """What acts on the tube in that direction, arrays of shape ()."""

    @classmethod
    def of(
        cls, *, law: CalibratedLaw, fills: tuple[float, float], gas_pressure: float, reverse: bool
    ) -> DirectedState:
        """Take a state in one direction of flow."""
        x, y, p = (np.asarray(v, dtype=np.float64) for v in (*fills, gas_pressure))
        asked = Conditions(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=np.asarray(True))
        return cls._at(asked, law=law, reverse=reverse)

    @classmethod
    def _at(cls, asked: Conditions, *, law: CalibratedLaw, reverse: bool) -> DirectedState:
        return cls(reverse=reverse, conditions=asked, drive=law.drive(asked, reverse=reverse))

    @property
    def ends(self) -> TubeEnds[Any]:
        """Pressures at the tube's ends."""
        return self.drive.ends

    def margin(self, *, law: CalibratedLaw) -> tuple[float, float] | tuple[None, None]:
        """`siphon_margin` over the cavity of a primed tube, Pa; both None without a crest.

        The state is that in the direction of the driving pressure.
        """
        crest, head = law.path.crest, law.heads.to_crest(reverse=self.reverse)
        if crest is None or head is None:
            return None, None
        driving, (low, high) = np.asarray(self.ends.driving_pressure()), crest.possible_cavity(self.ends)
        margin, width = siphon_margin(
            path=law.path,
            heads=law.heads,
            hump_head=head,
            inputs=law.inputs,
            drive=self.drive,
            at_rest=np.asarray(crest.separation_margin(self.ends)),
            spread=np.asarray(max(crest.released, 1 - crest.released) * (high - low)),
            velocity=velocity_of(table=law.heads.head, head=driving / law.density, where=driving > 0),
        )
        sides = [
            self._at(self.conditions, law=each, reverse=self.reverse).margin(law=each)[0] or 0.0
            for each in law.variants
        ]
        by_fitted = ((high - low) / 2 for low, high in zip(sides[::2], sides[1::2], strict=True))
        return float(margin), math.hypot(float(width), *by_fitted)
