"""The liquid-ring paper, Eqs. 1 to 8: area, volume, ring radius and moment of a chamber, as printed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc


def sector_area(*, disc: Disc) -> float:
    """Area of a chamber without its plates, S_c = theta (R2^2 - R1^2)/2.

    Returns: Area, m^2.
    Source: Eqs. 1 and 2.
    """
    return disc.central_angle / 2 * (disc.outer_radius**2 - disc.inner_radius**2)


def flat_strip_area(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """Area between a radius and the outer wall less two flat strips, theta (R2^2 - a^2)/2 - 2 t (R2 - a).

    Args: `surface_radius`: a, m, any shape; R1 gives the paper's S_a.
    Returns: Area, m^2, the shape of `surface_radius`.
    Source: Eq. 3; an O(t^3) approximation of the exact area.
    """
    a = np.asarray(surface_radius, dtype=np.float64)
    swept = disc.central_angle / 2 * (disc.outer_radius**2 - a**2)
    return np.asarray(swept - 2 * disc.plate_thickness * (disc.outer_radius - a), dtype=np.float64)


def chamber_area_paper(*, disc: Disc) -> float:
    """Actual area of one chamber, S_a = theta (R2^2 - R1^2)/2 - 2 t (R2 - R1).

    Returns: Area, m^2.
    Source: Eq. 3.
    """
    return float(flat_strip_area(disc=disc, surface_radius=disc.inner_radius))


def chamber_volume_paper(*, disc: Disc) -> float:
    """Volume of one chamber, V = S_a B.

    Returns: Volume, m^3; printed as 67.7 ml, from which the plate thickness is inferred.
    Source: Eq. 4.
    """
    return chamber_area_paper(disc=disc) * disc.axial_width


def max_liquid_volume_paper(*, disc: Disc) -> float:
    """Largest liquid volume of one chamber, V'_max = x_max V.

    Returns: Volume, m^3; printed as 33.9 ml, which is half of the rounded 67.7 ml.
    Source: Eq. 5.
    """
    return disc.max_fill_ratio * chamber_volume_paper(disc=disc)


def initial_liquid_volume_paper(*, disc: Disc) -> float:
    """Liquid volume of each chamber before balancing, V'_initial = V'_max/2.

    Returns: Volume, m^3; printed as 16.9 ml.
    Source: Eq. 6.
    """
    return 0.5 * max_liquid_volume_paper(disc=disc)


def surface_radius_paper(*, disc: Disc, liquid_volume: npt.ArrayLike) -> FloatArray:
    """Inner radius R1' of the liquid ring: the root a of Eq. 3, theta (R2^2 - a^2)/2 - 2 t (R2 - a) = V'/B.

    Args: `liquid_volume`: V', m^3, any shape, from zero to the chamber's volume.
    Returns: R1', m, the shape of `liquid_volume`; at V'_max the paper prints 34.9 mm.
    Raises: ValueError: a volume below zero or above the chamber's.
    Source: Eq. 3 read backwards, as the text after Eq. 6 does.
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
    Args: `density`: rho, kg/m^3. `surface_radius`: R1', m, any shape.
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

    Args: `chamber_moment`: U of one chamber, kg m, any shape.
    Returns: Moment, kg m, the shape of `chamber_moment`; printed as 1885 g mm.
    Source: Eq. 8, whose typeset root reaches over U: the printed number is sqrt(2) times U.
    """
    return np.asarray(np.sqrt(2) * np.asarray(chamber_moment, dtype=np.float64), dtype=np.float64)
