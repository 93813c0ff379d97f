"""Friction factor from laminar to turbulent in one smooth formula, at rest and in a tube that turns.

A tube that turns about an axis across it has extra friction: Coriolis forces drive a secondary flow.
Turbulent flow and transition go by correlations; laminar flow rests on the table of finite-element
solutions, `rotation_table`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray, clipped

STRAIGHT_CRITICAL_REYNOLDS: Final = 1070 * 28**0.23
"""Critical Re without rotation: the recalled formula at its lower end, R_Om = 28, about 2303."""
_TURBULENT_JOIN: Final = 500.0
_CURVED_RATIOS: Final = (1.0, 0.25)
"""T of the equivalent curved tube over Kt of the rotating tube: by equal forces, and by equal gradients."""


def turbulent_friction_ratio(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """Turbulent friction factor with rotation over the one without.

    0.942 + 0.058 Kt^0.282 up to Kt = 500, 0.942 Kt^0.05 above, 1 below Kt = 1, the joints rounded.
    Returns: The ratio, of the broadcast shape.
    Range: stated for Kt = R_Om^2/Re >= 1, smooth tubes.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, recalled.
    """
    kt = np.asarray(rotation_reynolds, dtype=np.float64) ** 2 / np.asarray(reynolds, dtype=np.float64)
    power = 0.942 + 0.058 * (1 + np.minimum(kt, 1e9) ** (0.282 * 8)) ** (1 / 8)
    far = 0.942 * np.maximum(kt, 1.0) ** 0.05
    weight = 1 / (1 + (_TURBULENT_JOIN / np.maximum(kt, 1e-9)) ** 4)
    return np.asarray((1 - weight) * power + weight * far)


def turbulent_ratio_uncertainty(*, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """Expanded uncertainty (95 %) of `turbulent_friction_ratio`, zero without rotation.

    The formula is recalled and unverified, so the half-width reaches the farthest alternative: no effect at
    all, and `_curved_friction_ratio` of the bend whose centrifugal force equals the Coriolis force,
    a/R_c = S, or S/2.
    """
    kt = np.asarray(rotation_reynolds, dtype=np.float64) ** 2 / np.asarray(reynolds, dtype=np.float64)
    ratio = turbulent_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation_reynolds)
    bends = [_curved_friction_ratio(curvature_number=share * kt) for share in _CURVED_RATIOS]
    return np.asarray(np.max(np.abs([ratio - other for other in (np.ones_like(kt), *bends)]), axis=0))


def _curved_friction_ratio(*, curvature_number: npt.ArrayLike) -> FloatArray:
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


def friction_factor(
    *,
    reynolds: npt.ArrayLike,
    relative_roughness: float,
    laminar_ratio: npt.ArrayLike = 1.0,
    turbulent_ratio: npt.ArrayLike = 1.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Darcy friction factor, Churchill's blend of laminar and turbulent flow generalised to a turning tube.

    f/8 = [(8 F_lam/Re)^12 + (A/F_turb^8 + B c^16)^-1.5]^(1/12),
    A = [2.457 ln(1/((7/Re)^0.9 + 0.27 eps/d))]^16, B = (37530/Re)^16.
    The pressure loss f Re^2 grows with Re, because every branch falls more slowly than Re^-2.
    Args: `reynolds`: Re, any shape, positive. `relative_roughness`: eps/d. `laminar_ratio`: F_lam, factor on
        the laminar branch, broadcasts. `turbulent_ratio`: F_turb, factor on the turbulent branch, broadcasts.
        `critical_ratio`: c, critical Re over the straight tube's, broadcasts.
    Returns: f, of the broadcast shape; with all factors one it is Churchill's formula.
    Range: the formula states none. Tests compare it with data of smooth tubes for Re from 11 to 1e6, and of
        sand-roughened ones up to eps/d = 0.033; its expanded uncertainty is `friction_uncertainty`.
    Source: Churchill, Chem. Eng. 84 (1977) 91; the three factors are ours.
    """
    re = np.asarray(reynolds, dtype=np.float64)
    # Below Re = 1e-6 and above 1e12 only the powers would overflow: there one branch rules alone.
    bounded = clipped(re, 1e-6, 1e12)
    b = _sixteenth_power(37530 / bounded * np.asarray(critical_ratio, dtype=np.float64))
    laminar = 8 * np.asarray(laminar_ratio, dtype=np.float64) / re
    a = _log_power(bounded, relative_roughness) / np.asarray(turbulent_ratio, dtype=np.float64) ** 8
    turbulent = (a + b) ** -0.125
    larger, smaller = np.maximum(laminar, turbulent), np.minimum(laminar, turbulent)
    return np.asarray(8 * larger * (1 + (smaller / larger) ** 12) ** (1 / 12), dtype=np.float64)


def _log_power(re: FloatArray, relative_roughness: float) -> FloatArray:
    return _sixteenth_power(2.457 * np.log((7 / re) ** 0.9 + 0.27 * relative_roughness))


def _sixteenth_power(x: FloatArray) -> FloatArray:
    for _ in range(4):
        x = x * x
    return x


def friction_uncertainty(
    *,
    reynolds: npt.ArrayLike,
    relative_roughness: float,
    laminar_ratio: npt.ArrayLike = 1.0,
    turbulent_ratio: npt.ArrayLike = 1.0,
    critical_ratio: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Expanded uncertainty (95 %) of f by the friction correlation itself.

    The root of the sum of squares of: 1 % (laminar) to 4.5 % (turbulent) of f; around the critical Re how far
    the turbulent branch lies above the laminar one, since flow may stay laminar or turn early; on a rough
    wall, while its grains lie near the viscous layer (eps+ below about 35), the gap to a smooth wall, because
    sand-like walls still act smooth there.
    Args: `relative_roughness`: eps/d.
    Range: as for `friction_factor`.
    Source: deviations from McKeon et al., J. Fluid Mech. 511 (2004) 41, and Nikuradse, VDI Forschungsheft 361
        (1933); tests check that it covers them.
    """
    re = np.asarray(reynolds, dtype=np.float64)
    shape = {
        "laminar_ratio": laminar_ratio,
        "turbulent_ratio": turbulent_ratio,
        "critical_ratio": critical_ratio,
    }
    f = friction_factor(reynolds=re, relative_roughness=relative_roughness, **shape)
    smooth = friction_factor(reynolds=re, relative_roughness=0.0, **shape)
    turned = turbulent_share(reynolds=re, critical_ratio=critical_ratio, sharpness=6.0)
    grain = re * np.sqrt(f / 8) * relative_roughness
    # The turbulent branch without its onset term; below Re = 1000 its logarithm changes sign.
    log_power = _log_power(clipped(re, 1000.0, 1e12), relative_roughness)
    turbulent = 8 * np.asarray(turbulent_ratio) * log_power**-0.125
    # Where rotation has raised the laminar branch above the turbulent one the transition has no jump: values
    # measured in rotating ducts lie at the laminar branch or above it.
    branch_gap = np.maximum(turbulent - 64 * np.asarray(laminar_ratio, dtype=np.float64) / re, 0.0)
    parts = (
        (0.01 + 0.035 * turned) * f,
        4 * turned * (1 - turned) * branch_gap,
        turned * (f - smooth) * np.exp(-((grain / 35) ** 2)),
    )
    return np.asarray(np.sqrt(sum(p**2 for p in parts)), dtype=np.float64)


def turbulent_share(
    *, reynolds: npt.ArrayLike, critical_ratio: npt.ArrayLike = 1.0, sharpness: float = 4.0
) -> FloatArray:
    """Smooth switch from laminar (0) to turbulent (1), w = 1/(1 + (Re_c/Re)^n).

    With n = 4 a loss coefficient that falls through the transition still makes a head that grows with u.
    Args: `critical_ratio`: critical Re over the straight tube's 2303, broadcasts.
    Source: our interpolation between the two ends.
    """
    re = np.asarray(reynolds, dtype=np.float64)
    log_ratio = np.log(STRAIGHT_CRITICAL_REYNOLDS * np.asarray(critical_ratio, dtype=np.float64) / re)
    return np.asarray(1 / (1 + np.exp(clipped(sharpness * log_ratio, -300, 300))), dtype=np.float64)


def rotation_reynolds_number(*, angular_velocity: float, bore: float, kinematic_viscosity: float) -> float:
    """Rotation Reynolds number, R_Om = omega d^2/nu, the inverse of an Ekman number.

    Args: `angular_velocity`: omega, rad/s, of either sign. `bore`: d, m. `kinematic_viscosity`: nu, m^2/s.
    Returns: R_Om; with Re it makes Kl = R_Om Re (laminar), Kt = R_Om^2/Re (turbulent) and S = R_Om/Re.
    Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383, definitions.
    """
    return abs(angular_velocity) * bore**2 / kinematic_viscosity
