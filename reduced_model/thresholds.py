"""Gas pressures at which the tube's flow begins and ends."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.scene.models import HumpGas

FloatArray = npt.NDArray[np.float64]


def priming_pressure(
    *,
    law: CalibratedLaw,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None = None,
    hump_gas: HumpGas,
) -> FloatArray | None:
    """Gas pressure that pushes an empty tube's liquid over the hump.

    vented: rho omega^2 (a_A^2 - r_m^2)/2; trapped: that and rho omega^2 (r_p^2 - a_C^2)/2.

    Args:
        law: the flow law.
        fill_ratio: x of the driven chamber, any shape.
        opposite_fill_ratio: of the opposite chamber; default max_fill_ratio - fill_ratio.
        hump_gas: which of the two bounds, whatever the law itself uses.

    Returns:
        Gauge pressure, Pa, of the broadcast shape; None without a hump.

    Source: hydrostatics of the two legs in the rotating frame.  For the liquid-ring paper's disc a hump at
        31.5 mm gives its 0.54 MPa, vented with the driven chamber nearly empty or trapped at equal fills: an
        inference, because the paper does not say what its figure means.
    """
    if law.path.hump_pressure is None:
        return None
    x = np.asarray(fill_ratio, dtype=np.float64)
    y = law.max_fill_ratio - x if opposite_fill_ratio is None else np.asarray(opposite_fill_ratio)
    vented = law.path.hump_pressure - law.wall_pressure(x)
    pushed = np.maximum(law.wall_pressure(y) - law.path.port_pressure, 0.0)
    return np.asarray(vented + pushed if hump_gas == "trapped" else vented + 0 * pushed, dtype=np.float64)


def siphon_stall_pressure(
    *,
    law: CalibratedLaw,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None = None,
) -> FloatArray:
    """Gas pressure at which a full siphon stands still, P_C - P_A.

    Args:
        law: the flow law.
        fill_ratio: x of the driven chamber, any shape.
        opposite_fill_ratio: of the opposite chamber; default max_fill_ratio - fill_ratio.

    Returns:
        Gauge pressure, Pa, of the broadcast shape; negative where the driven chamber holds more.

    Source: Eq. 18 of the liquid-ring paper with u = 0 and finite-element levels.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    y = law.max_fill_ratio - x if opposite_fill_ratio is None else np.asarray(opposite_fill_ratio)
    back = np.maximum(law.wall_pressure(y), law.path.port_pressure)
    return np.asarray(back - law.wall_pressure(x), dtype=np.float64)
