"""Extra friction of a tube that turns about an axis across it: Coriolis forces drive a secondary flow.

Turbulent flow and transition, by correlations; laminar flow rests on the table of finite-element solutions,
`rotation_table`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Estimate
from ringbalance.scene.arrays import FloatArray

STRAIGHT_CRITICAL_REYNOLDS: Final = 1070 * 28**0.23
"""Critical Re without rotation: the recalled formula at its lower end, R_Om = 28, about 2303."""
_TURBULENT_JOIN: Final = 500.0
_EQUAL_FORCE: Final = (1.0, 0.25)
"""T of the curved tube that is like the turning one, over Kt: by equal forces, and by equal gradients."""


def turbulent_friction_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> Estimate:
    """Turbulent friction factor with rotation over the one without.

    0.942 + 0.058 Kt^0.282 up to Kt = 500, 0.942 Kt^0.05 above, 1 below Kt = 1, the joints rounded.
    Returns: Estimate of the ratio, of the broadcast shape. The formula is recalled and unverified, so its 95
        % half-width reaches the farthest of what else could be: no effect at all, and `curved_friction_ratio`
        of the bend whose centrifugal force equals the Coriolis force, a/R_c = S, or S/2. Zero without
        rotation.
    Range: stated for Kt = R_Om^2/Re >= 1, smooth tubes.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, recalled.
    """
    re, rotation = (np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds))
    kt = rotation**2 / re
    power = 0.942 + 0.058 * (1 + np.minimum(kt, 1e9) ** (0.282 * 8)) ** (1 / 8)
    far = 0.942 * np.maximum(kt, 1.0) ** 0.05
    weight = 1 / (1 + (_TURBULENT_JOIN / np.maximum(kt, 1e-9)) ** 4)
    ratio = (1 - weight) * power + weight * far
    bends = (curved_friction_ratio(curvature_number=share * kt) for share in _EQUAL_FORCE)
    gaps = [np.abs(ratio - 1), *(np.abs(ratio - bend) for bend in bends)]
    return Estimate(value=ratio, uncertainty=np.asarray(np.max(np.array(gaps), axis=0), dtype=np.float64))


def curved_friction_ratio(*, curvature_number: npt.ArrayLike) -> FloatArray:
    """Turbulent friction factor of a smooth curved tube over Blasius' of a straight one.

    (0.3/0.3164) T^0.05 (1 + 0.112/T^0.2) with T = Re (a/R_c)^2; below T = 1 its excess fades with T^(1/4).

    A turning tube is like a curved one when the forces across are alike: with S = R_Om/Re,
    2 omega w against w^2/R_c gives a/R_c = S at the mean velocity, half of it for equal gradients; then T is
    Kt = R_Om^2/Re, or a quarter of it.
    Source: Mori and Nakayama, Int. J. Heat Mass Transfer 10 (1967) 37; the analogy after Ishigaki, J. Fluid
        Mech. 307 (1996) 1; the fading is ours.
    """
    number = np.asarray(curvature_number, dtype=np.float64)
    t = np.maximum(number, 1.0)
    curved = 0.3 / 0.3164 * t**0.05 * (1 + 0.112 / t**0.2)
    return np.asarray(1 + (curved - 1) * np.minimum(number, 1.0) ** 0.25, dtype=np.float64)


def critical_reynolds(*, rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """Reynolds number at which the rotating tube's flow turns turbulent, 1070 R_Om^0.23, at least 2303.

    Range: 28 <= R_Om <= 2000; below, the straight tube's value, joined smoothly; above, extrapolated.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, recalled.
    """
    rotation = np.asarray(rotation_reynolds, dtype=np.float64)
    ratio = (1 + (rotation / 28) ** (0.23 * 8)) ** (1 / 8)
    return np.asarray(STRAIGHT_CRITICAL_REYNOLDS * ratio, dtype=np.float64)
