"""Extra friction of a tube that turns about an axis across it: Coriolis forces drive a secondary flow.

Three functions are all that the rest of the program knows of it, so that a table of finite-element solutions
can take the place of the joined formulas below: `rotating_friction_ratio`, `turbulent_friction_ratio` and
`critical_reynolds`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Estimate

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

STRAIGHT_CRITICAL_REYNOLDS: Final = 1070 * 28**0.23
"""Critical Re without rotation: the recalled formula at its lower end, R_Om = 28, about 2303."""
_TURBULENT_JOIN: Final = 500.0


def _harmonic(a: FloatArray, b: FloatArray, power: float) -> FloatArray:
    """Smooth smaller of two positive numbers, (a^-p + b^-p)^(-1/p), a where b is far larger."""
    return np.asarray(a * (1 + (a / b) ** power) ** (-1 / power), dtype=np.float64)


def _slow_rotation_excess(kl: FloatArray) -> FloatArray:
    """F - 1 for R_Om/Re -> 0: the exact Kl^2 series joined with Ito and Nanbu's formula."""
    # Their formula falls below 1 at Kl = 220, where its range ends; the last term keeps it away from there.
    ito = 0.0883 * kl**0.25 * (1 + 11.2 * kl**-0.325) - 1 + 0.011 * (220 / kl) ** 2
    return _harmonic(kl**2 / 16515072, ito, 1.3)


def _fast_rotation_excess(rotation: FloatArray) -> FloatArray:
    """F - 1 for Re -> 0: between the exact series R_Om^2/9216 and the exact limit 0.07863 sqrt(R_Om)."""
    root = np.sqrt(rotation)
    limit = 0.07863 * root * rotation / (rotation + 5.18 * root + 26.8)
    return np.asarray((rotation**2 / 9216) / np.sqrt(1 + (rotation**2 / 9216 / limit) ** 2), dtype=np.float64)


def rotating_friction_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> Estimate:
    """Laminar friction factor with rotation over the one without, F = f/(64/Re), developed flow.

    F = 1 + (y1^m + y2^m)^(1/m), m from 1 (small excess: the series add) to 4 (the larger one rules), with
    y1(Kl) between Kl^2/16515072 and Ito and Nanbu's 0.0883 Kl^(1/4) (1 + 11.2 Kl^-0.325) - 1,
    y2(R_Om) between R_Om^2/9216 and 0.07863 sqrt(R_Om).

    Args:
        reynolds: Re, any shape, positive.
        rotation_reynolds: R_Om, any shape that broadcasts, zero or more.

    Returns:
        Estimate of F, of the broadcast shape.  Uncertainty: 4 % of F inside
        `rotation_in_range`, 15 % outside, falling to zero with the excess F - 1.

    Range: Kl up to 1e7 and R_Om up to 3500, where the tests hold it against spectral solutions.

    Source: the series for slow rotation and the limit for fast rotation are exact; Ito and Nanbu, J. Basic
        Eng. 93 (1971) 383 as recalled (there for 220 < Kl < 1e7 and R_Om/Re < 0.5); the joining is ours.
    """
    re, rotation = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds))
    )
    # A floor keeps the powers finite; at R_Om = 0 the excess is then 1e-28, which the sum with 1 drops.
    turning = np.maximum(rotation, 1e-12)
    slow = _slow_rotation_excess(np.maximum(turning * re, 1e-12))
    fast = _fast_rotation_excess(turning)
    total = slow + fast
    power = 1 + 3 * total / (total + 0.4)
    larger, smaller = np.maximum(slow, fast), np.minimum(slow, fast)
    excess = larger * (1 + (smaller / larger) ** power) ** (1 / power)
    share = np.where(rotation_in_range(reynolds=re, rotation_reynolds=rotation), 0.04, 0.15)
    ratio = 1 + excess
    return Estimate(value=ratio, uncertainty=np.asarray(share * ratio * excess / (excess + 0.03)))


def rotation_in_range(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> BoolArray:
    """Whether the laminar rotation ratio was held against solutions: Kl <= 1e7 and R_Om <= 3500.

    Args:
        reynolds: Re, any shape.
        rotation_reynolds: R_Om, any shape that broadcasts.

    Returns:
        True inside, of the broadcast shape.

    Source: the spectral solutions in this package's tests.
    """
    rotation = np.asarray(rotation_reynolds, dtype=np.float64)
    kl = rotation * np.asarray(reynolds, dtype=np.float64)
    return np.asarray((kl <= 1e7) & (rotation <= 3500))


def turbulent_friction_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> Estimate:
    """Turbulent friction factor with rotation over the one without.

    0.942 + 0.058 Kt^0.282 up to Kt = 500, 0.942 Kt^0.05 above, 1 below Kt = 1, the joints rounded.

    Args:
        reynolds: Re, any shape, positive.
        rotation_reynolds: R_Om, any shape that broadcasts, zero or more.

    Returns:
        Estimate of the ratio, of the broadcast shape.  Uncertainty: 3 % and 30 % of the excess, because the
        formula is recalled and unverified; zero without rotation.

    Range: stated for Kt = R_Om^2/Re >= 1, smooth tubes.

    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, recalled.
    """
    re, rotation = (np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds))
    kt = rotation**2 / re
    power = 0.942 + 0.058 * (1 + np.minimum(kt, 1e9) ** (0.282 * 8)) ** (1 / 8)
    far = 0.942 * np.maximum(kt, 1.0) ** 0.05
    weight = 1 / (1 + (_TURBULENT_JOIN / np.maximum(kt, 1e-9)) ** 4)
    ratio = (1 - weight) * power + weight * far
    excess = np.abs(ratio - 1)
    return Estimate(value=ratio, uncertainty=0.3 * excess + 0.03 * excess / (excess + 0.01))


def critical_reynolds(*, rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """Reynolds number at which the rotating tube's flow turns turbulent, 1070 R_Om^0.23, at least 2303.

    Args:
        rotation_reynolds: R_Om, any shape, zero or more.

    Returns:
        Critical Re, the shape of `rotation_reynolds`.

    Range: 28 <= R_Om <= 2000; below, the straight tube's value, joined smoothly; above, extrapolated.

    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, recalled.
    """
    rotation = np.asarray(rotation_reynolds, dtype=np.float64)
    ratio = (1 + (rotation / 28) ** (0.23 * 8)) ** (1 / 8)
    return np.asarray(STRAIGHT_CRITICAL_REYNOLDS * ratio, dtype=np.float64)
