"""Margin of a full siphon's crest pressure above the cavity pressure, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tube.directed_flow import Drive, siphon_margin
from ringbalance.reduced_model.tube.heads import velocity_of
from ringbalance.reduced_model.tube.regime import TubeEnds


@dataclass(frozen=True, kw_only=True)
class DirectedState:
    """One state of the tube, in one direction of flow."""

    reverse: bool
    """Whether the opposite chamber is upstream."""
    ends: TubeEnds[float]
    """Pressures at the tube's ends."""
    upstream_uncertainty: float
    """Expanded uncertainty (95 %) of the upstream hydrostatic pressure, Pa."""
    downstream_uncertainty: float
    """The same downstream."""

    def margin(self, *, law: CalibratedLaw) -> tuple[float, float] | tuple[None, None]:
        """`siphon_margin` over the cavity of a primed tube, Pa; both None without a crest.

        The state is that in the direction of the driving pressure.
        """
        crest, head = law.path.crest, law.heads.to_crest(reverse=self.reverse)
        if crest is None or head is None:
            return None, None
        driving, (low, high) = np.asarray(self.ends.driving_pressure()), crest.cavity_bounds(self.ends)
        margin, width = siphon_margin(
            path=law.path,
            heads=law.heads,
            hump_head=head,
            inputs=law.inputs,
            drive=Drive(
                ends=self.ends,
                upstream_uncertainty=self.upstream_uncertainty,
                downstream_uncertainty=self.downstream_uncertainty,
                primed=np.asarray(True),
                allowed=np.asarray(True),
            ),
            at_rest=np.asarray(crest.separation_margin(self.ends)),
            spread=np.asarray(max(crest.released, 1 - crest.released) * (high - low)),
            velocity=velocity_of(table=law.heads.head, head=driving / law.density, where=driving > 0),
        )
        return float(margin), float(width)


def directed_state(
    *, law: CalibratedLaw, fills: tuple[float, float], gas_pressure: float, reverse: bool
) -> DirectedState:
    """Take a state in one direction of flow."""
    at = law.ends(fill_ratio=fills[0], opposite_fill_ratio=fills[1], gas_pressure=gas_pressure)
    ends = TubeEnds(
        upstream_gas=float(at.upstream_gas),
        downstream_gas=float(at.downstream_gas),
        upstream_hydrostatic=float(at.upstream_hydrostatic),
        downstream_hydrostatic=float(at.downstream_hydrostatic),
        port_pressure=law.path.port_pressure,
    )
    uncertainties = [float(law.wall_pressure_uncertainty(x)) for x in fills]
    upstream, downstream = uncertainties[::-1] if reverse else uncertainties
    return DirectedState(
        reverse=reverse,
        ends=ends.reversed() if reverse else ends,
        upstream_uncertainty=upstream,
        downstream_uncertainty=downstream,
    )
