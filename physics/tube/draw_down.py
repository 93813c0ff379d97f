"""Draw-down: how deep the liquid over a port must be to keep the gas out of it."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray

_POINT_SINK: Final = 1.25 / (2 * math.pi**2) ** 0.2
"""0.6884; Lubin and Springer print 0.69."""
DRAW_DOWN_UNCERTAINTY: Final = 0.3
"""Relative, 95 %, of the depth.

A port as wide as the liquid is deep needs about 18 % less than a point, a rim over which the liquid falls as
over a weir up to 30 % less, and liquid that still moves somewhat more.
"""


def draw_down_depth(*, flow_rate: npt.ArrayLike, acceleration: float) -> FloatArray:
    """Depth of liquid over a port in a flat wall at which gas reaches it, h = 0.6884 (Q^2/g_c)^(1/5), m.

    Bernoulli's equation from the surface at rest to the axis of a point sink,
    h = y + [Q/(2 pi y^2)]^2/(2 g_c), has a solution y only for h at or above its minimum, which lies at
    y^5 = Q^2/(2 pi^2 g_c).
    Args: `flow_rate`: Q, m^3/s, any shape. `acceleration`: g_c towards the port, m/s^2.
    Raises: ValueError: an acceleration that is not positive and finite.
    Range: inviscid liquid without swirl about the port's axis. A bathtub vortex draws gas from deeper; the
        rotation of a disc makes none, because its axis lies in the surface.
    Source: derived; the same power and factor as Lubin and Springer, J. Fluid Mech. 29 (1967) 385.
    """
    if not (acceleration > 0 and math.isfinite(acceleration)):
        raise ValueError("acceleration must be positive and finite: a disc at rest holds no liquid")
    rate = np.asarray(flow_rate, dtype=np.float64)
    return np.asarray(_POINT_SINK * (rate**2 / acceleration) ** 0.2)
