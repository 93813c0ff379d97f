"""What it takes until laminar flow in a rotating tube is developed, and what that adds to its loss."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray

_CREEPING: Final = 0.2
_INERTIAL: Final = 57.0
_EKMAN: Final = 47.21
DEVELOPMENT_SHARE: Final = 1.0
"""Half-width of what development adds, over rotation's extra friction on one developing length.

One stands for an inlet that the secondary flow reaches only after that length.  Three-dimensional solutions
of the inlet, a parabola or a blunt profile, at (Re, R) = (100, 100), (200, 50) and (20, 200), gave from -0.70
to +0.20, beyond what the same inlet costs at rest: a blunt one loses less where rotation keeps flow blunt.
"""


def developing_length(
    *, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike, friction_ratio: npt.ArrayLike
) -> FloatArray:
    """Way on which the slowest disturbance of laminar rotating flow falls by e, in diameters, as a bound.

    l/d = 0.2 + Re/(57 F) + sqrt(R)/47.21

    The three are the creeping end effect; the carrying of vorticity, 0.0175 Re without rotation; and the
    exact limit of fast rotation without inertia, geostrophic flow over the section's depth that friction in
    its Ekman layers wears down.
    Args: `friction_ratio`: F of developed laminar flow there, broadcasts.
    Returns: l/d, of the broadcast shape: at least the length of the section's eigenproblem, at most 3 times
        it.
    Range: compared with `entry_length.slowest_decay` for Re up to 2000, R up to 1e4, R Re up to 3e5.
    Source: our bound of computed decay rates, with exact limits.
    """
    re, rotation, ratio = (
        np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds, friction_ratio)
    )
    return np.asarray(_CREEPING + re / (_INERTIAL * ratio) + np.sqrt(rotation) / _EKMAN)


def development_uncertainty(
    *, length: float, bore: float, developing: npt.ArrayLike, rotation_loss: npt.ArrayLike
) -> FloatArray:
    """Half-width of k for flow that is not developed yet: rotation's share on the developing length.

    k_rot (l/L) (1 - exp(-L/l))
    Args: `length`: L of the tube, m. `bore`: d, m. `developing`: l/d, any shape. `rotation_loss`: k_rot,
        rotation's extra friction on the whole tube, broadcasts.
    Returns: expanded uncertainty (95 %), of the broadcast shape.
    Source: the share stands with `DEVELOPMENT_SHARE`; the exponential is that of the slowest disturbance.
    """
    share = np.asarray(developing, dtype=np.float64) * bore / length
    way = -share * np.expm1(-1 / share)
    return np.asarray(DEVELOPMENT_SHARE * way * np.abs(np.asarray(rotation_loss, dtype=np.float64)))
