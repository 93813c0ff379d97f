"""Every closed formula of the liquid-ring paper, one function each, with the paper's equation number.

Pan, Wu, Gao and Mu, "Performance Analysis and Control Simulation of Pneumatic Liquid Online Automatic
Balancing System for Rotating Machinery".  The formulas are as printed, flat plate strips included, for
comparison with the exact geometry and the finite elements; nothing is corrected silently.
Where the paper writes 0.5 for the liquid of a pair as a share of one chamber, these functions read the disc's
`max_fill_ratio`.

SI units: density rho, kg/m^3; angular velocity omega, rad/s; surface radius R1', m; liquid volume V' of one
chamber and pair volume V'_AC, m^3; gas pressure p0, gauge, Pa; tube area S, m^2; fill ratio x_a of the driven
chamber; moment U, kg m; vibration V, m zero-to-peak; influence K, m/(kg m).  Array arguments broadcast.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Disc

PAPER_DRAG_COEFFICIENT: Final = 50.0
"""k between the ends of the connecting tube, "about 50" (section 3.2)."""
PAPER_LAMBDA_M: Final = 72e-3
"""lambda, m: balancing moment per unit mass of liquid, "72 mm within 0.7 %" (section 5.2)."""


def flat_strip_area(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """Area between a radius and the outer wall less two flat strips, theta (R2^2 - a^2)/2 - 2 t (R2 - a).

    Returns: Area, m^2, the shape of `surface_radius`.
    Source: Eq. 3; an O(t^3) approximation of the exact area.
    """
    a = np.asarray(surface_radius, dtype=np.float64)
    swept = disc.central_angle / 2 * (disc.outer_radius**2 - a**2)
    return np.asarray(swept - 2 * disc.plate_thickness * (disc.outer_radius - a), dtype=np.float64)


def chamber_volume_paper(*, disc: Disc) -> float:
    """Volume of one chamber, V = S_a B, S_a = theta (R2^2 - R1^2)/2 - 2 t (R2 - R1).

    Returns: Volume, m^3; printed as 67.7 ml, from which the plate thickness is inferred.
    Source: Eqs. 3 and 4.
    """
    return float(flat_strip_area(disc=disc, surface_radius=disc.inner_radius)) * disc.axial_width


def max_liquid_volume_paper(*, disc: Disc) -> float:
    """Largest liquid volume of one chamber, V'_max = x_max V.

    Returns: Volume, m^3; printed as 33.9 ml, which is half of the rounded 67.7 ml.
    Source: Eq. 5.
    """
    return disc.max_fill_ratio * chamber_volume_paper(disc=disc)


def surface_radius_paper(*, disc: Disc, liquid_volume: npt.ArrayLike) -> FloatArray:
    """Inner radius R1' of the liquid ring: the root a of Eq. 3, theta (R2^2 - a^2)/2 - 2 t (R2 - a) = V'/B.

    Returns: R1', m, the shape of `liquid_volume`; at V'_max the paper prints 34.9 mm.
    Raises: ValueError: a volume below zero or above the chamber's.
    Source: Eq. 3 solved for a, as in the text after Eq. 6.
    """
    volume = np.asarray(liquid_volume, dtype=np.float64)
    if np.any(~((volume >= 0) & (volume <= chamber_volume_paper(disc=disc) * (1 + 1e-12)))):
        raise ValueError("liquid_volume must lie between zero and the chamber's volume")
    theta, t, r2 = disc.central_angle, disc.plate_thickness, disc.outer_radius
    constant = volume / disc.axial_width - theta / 2 * r2**2 + 2 * t * r2
    return np.asarray((2 * t + np.sqrt(4 * t**2 - 2 * theta * constant)) / theta, dtype=np.float64)


def moment_paper(*, disc: Disc, density: float, surface_radius: npt.ArrayLike) -> FloatArray:
    """Balancing moment of one chamber, U = 2/3 rho B (R2^3 - R1'^3) sin(theta/2).

    The plates are left out of U although Eq. 3 takes them out of the volume.
    Returns: Moment along the chamber's centre line, kg m, the shape of `surface_radius`; the printed 1333 g
        mm belongs to R1' rounded to 34.9 mm.
    Source: Eq. 7.
    """
    a = np.asarray(surface_radius, dtype=np.float64)
    cubes = disc.outer_radius**3 - a**3
    scale = 2 / 3 * density * disc.axial_width * np.sin(disc.central_angle / 2)
    return np.asarray(scale * cubes, dtype=np.float64)


def capacity(*, chamber_moment: npt.ArrayLike) -> FloatArray:
    """Balancing ability of the disc from two adjacent chambers at right angles, U_max = sqrt(2) U.

    Returns: Moment, kg m, the shape of `chamber_moment`; printed as 1885 g mm.
    Source: Eq. 8, whose typeset root reaches over U: the printed number is sqrt(2) times U.
    """
    return np.asarray(np.sqrt(2) * np.asarray(chamber_moment, dtype=np.float64), dtype=np.float64)


def wall_pressure_paper(
    *, disc: Disc, density: float, angular_velocity: float, liquid_volume: npt.ArrayLike
) -> FloatArray:
    """Liquid pressure on the outer wall from the volume, p = rho omega^2 V'/(B theta).

    Returns: Pressure above the gas pressure, Pa, the shape of `liquid_volume`.
    Source: Eq. 12; equals Eqs. 9 to 11 only where V' = B theta (R2^2 - R1'^2)/2, that is without plates.
    """
    volume = np.asarray(liquid_volume, dtype=np.float64)
    return np.asarray(_pressure_per_volume(disc, density, angular_velocity) * volume, dtype=np.float64)


def _pressure_per_volume(disc: Disc, density: float, angular_velocity: float) -> float:
    return density * angular_velocity**2 / (disc.axial_width * disc.central_angle)


def velocity_from_pressures(
    *, density: float, drag_coefficient: npt.ArrayLike, pressure_difference: npt.ArrayLike
) -> FloatArray:
    """Tube velocity from the pressures at its ends, (p1 - p3)/rho = (k + 1) u^2/2.

    Returns: u, m/s, of the broadcast shape; zero where the difference is not positive.
    Source: Eqs. 13 and 14 (both ends at one radius, gravity left out).
    """
    k = np.asarray(drag_coefficient, dtype=np.float64)
    difference = np.maximum(np.asarray(pressure_difference, dtype=np.float64), 0.0)
    return np.asarray(np.sqrt(2 * difference / (density * (k + 1))), dtype=np.float64)


def stall_pressure(*, disc: Disc, density: float, angular_velocity: float) -> float:
    """Gas pressure that Eq. 19 needs at an empty chamber, p0 = rho omega^2 V x_max/(B theta).

    Returns: Gauge pressure, Pa; 0.381 MPa for the paper's disc, which the paper does not print: it quotes
        0.54 to 1.77 MPa as the working range.
    Source: Eq. 19 with u = 0.
    """
    full = chamber_volume_paper(disc=disc) * disc.max_fill_ratio
    return float(
        wall_pressure_paper(disc=disc, density=density, angular_velocity=angular_velocity, liquid_volume=full)
    )


def departure(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    gas_pressure: npt.ArrayLike,
    pair_volume: float | None = None,
) -> FloatArray:
    """Total departure of the velocity while a full chamber empties, 1 - u(x_a = 0)/u(x_a = x_max).

    (k + 1) u^2/2 = p0/rho + omega^2 (2 V'_A - V'_AC)/(B theta)
    Returns: Departure, the shape of `gas_pressure`; independent of k; one where the flow stalls on the way.
    Source: Eqs. 15 to 18 and the text under Fig. 4, which prints 45.6 % at 0.7 MPa and 22.9 % at 1.5 MPa. The
        unrounded volume gives 45.7 % and 22.9 %; the printed pair follows from R1'_min rounded to 34.9 mm.
    """
    total = max_liquid_volume_paper(disc=disc) if pair_volume is None else pair_volume
    gas = np.asarray(gas_pressure, dtype=np.float64)
    level = _pressure_per_volume(disc, density, angular_velocity) * total
    at_full, at_empty = (
        velocity_from_pressures(
            density=density, drag_coefficient=PAPER_DRAG_COEFFICIENT, pressure_difference=gas + side * level
        )
        for side in (1, -1)
    )
    return np.asarray(1 - at_empty / at_full, dtype=np.float64)


def correction_mass(*, disc: Disc, density: float, fill_ratio: npt.ArrayLike) -> FloatArray:
    """Mass difference of a pair of opposite chambers, m = rho V (2 x_a - 0.5).

    Returns: Mass, kg, positive towards the chamber that has `fill_ratio`, the shape of `fill_ratio`.
    Source: Eq. 21; twice the transferred mass.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    volume = chamber_volume_paper(disc=disc)
    return np.asarray(density * volume * (2 * x - disc.max_fill_ratio), dtype=np.float64)


def correction_moment(
    *, real_mass: npt.ArrayLike, imaginary_mass: npt.ArrayLike, moment_per_mass: float = PAPER_LAMBDA_M
) -> ComplexArray:
    """Correction moment of the disc, U = lambda (m_Re + i m_Im).

    Returns: Complex moment, kg m, of the broadcast shape; its argument is the paper's delta.
    Source: Eq. 22 taken literally. With lambda = 72 mm it is twice Eq. 7's moment: 72 mm belongs to the
        transferred mass, half of Eq. 21's difference.
    """
    real, imaginary = (np.asarray(m, dtype=np.float64) for m in (real_mass, imaginary_mass))
    return np.asarray(moment_per_mass * (real + 1j * imaginary), dtype=np.complex128)
