"""What a separated siphon looks like to someone who reads k off Eq. 18: a drag that falls as 1/u^2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ApparentDrag:
    """Loss coefficients by k := 2 (H_A - H_C)/u^2 - 1 over the velocity; arrays of one shape."""

    velocity: FloatArray
    """u, m/s."""
    siphon: FloatArray
    """k(u) of the full siphon."""
    separated: FloatArray
    """What a separated siphon of that velocity would read."""
    read: FloatArray
    """What is read: the larger of the two, since the tube runs at the smaller velocity."""
    lower_bound: FloatArray
    """alpha + k_up - 1, to which `separated` falls."""
    excess_head: float
    """C, m^2/s^2, in separated = lower_bound + 2 C/u^2; not above zero, the siphon never separates."""


def apparent_drag(*, law: CalibratedLaw, velocity: npt.ArrayLike, opposite_fill_ratio: float) -> ApparentDrag:
    """Read Eq. 18 off a separated siphon.

    Separated, (alpha + k_up) u^2/2 = (p_A - p_c + P_A - D_m)/rho, while Eq. 18 counts the head H_A - H_C =
    (p_A - p_C + P_A - P_C)/rho. Their difference C = (D_m + p_c - P_C - p_C)/rho does not depend on what
    drives the flow, so k = alpha + k_up - 1 + 2 C/u^2: at one fill of the opposite chamber the excess falls
    exactly as 1/u^2, whatever the gas pressure and the driven chamber's fill.
    Args: `velocity`: u, m/s, any shape, positive.
    Raises: ValueError: a law without a crest, or a velocity that is not positive and finite.
    Source: Eq. 18 of the liquid-ring paper and the crest's energy balance.
    """
    crest, crest_head = law.path.crest, law.heads.hump_head
    if crest is None or crest_head is None:
        raise ValueError("a tube without a siphon crest does not separate: give tube.hump_radius")
    u = np.asarray(velocity, dtype=np.float64)
    if not np.all(np.isfinite(u) & (u > 0)):
        raise ValueError("velocity must be positive and finite")
    ends = law.ends(fill_ratio=0.0, opposite_fill_ratio=opposite_fill_ratio)
    excess = float(ends.driving_pressure() - crest.separation_margin(ends)) / law.density
    siphon, lower_bound = (2 * np.exp(table(np.log(u))) / u**2 - 1 for table in (law.heads.head, crest_head))
    separated = lower_bound + 2 * excess / u**2
    return ApparentDrag(
        velocity=u,
        siphon=siphon,
        separated=separated,
        read=np.maximum(siphon, separated),
        lower_bound=lower_bound,
        excess_head=excess,
    )
