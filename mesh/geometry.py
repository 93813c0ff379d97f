"""The chamber's cross-section in closed form: the exact area between two radii, and fill ratio to radius.

A chamber is the set R1 <= r <= R2, |phi| <= alpha(r) with alpha(r) = theta/2 - asin(t/r): a plate takes a
strip of thickness t, with faces parallel to the bounding radii.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.keys.derivations import swept_area
from ringbalance.scene.models import Disc


def half_angle(*, disc: Disc, radius: npt.ArrayLike) -> FloatArray:
    """Half-angle of the liquid's space at a radius, alpha(r) = theta/2 - asin(t/r).

    Args: `radius`: r, m, any shape; at least the plate thickness.
    Returns: alpha, rad, the shape of `radius`.
    Source: geometry of Fig. 2(b) of the liquid-ring paper; exact.
    """
    r = np.asarray(radius, dtype=np.float64)
    return np.asarray(disc.central_angle / 2 - np.arcsin(disc.plate_thickness / r), dtype=np.float64)


def liquid_area(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """Cross-section between a concentric surface and the outer wall.

    A(a) = [theta r^2/2 - r^2 asin(t/r) - t sqrt(r^2 - t^2)] from a to R2.
    Args: `surface_radius`: a, m, any shape, within [R1, R2].
    Returns: Area, m^2, the shape of `surface_radius`.
    Source: integral of 2 r alpha(r); the paper's Eq. 3 is its flat-strip approximation, O(t^3) away.
    """
    within = partial(swept_area, central_angle=disc.central_angle, plate_thickness=disc.plate_thickness)
    return np.asarray(within(radius=disc.outer_radius) - within(radius=surface_radius), dtype=np.float64)


def liquid_first_moment(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """First moment of the cross-section about the shaft, between a concentric surface and the outer wall.

    int x dA = [2 sin(theta/2)/3 (r^2 - t^2)^(3/2) - cos(theta/2) t r^2] from a to R2; times rho B it is the
    moment U of a chamber, without finite elements.
    Args: `surface_radius`: a, m, any shape, within [R1, R2].
    Returns: First moment, m^3, the shape of `surface_radius`.
    Source: integral of 2 r^2 sin(alpha(r)); with t = 0 and times rho B it is Eq. 7 of the liquid-ring paper.
    """
    a, outer, t = np.asarray(surface_radius, dtype=np.float64), disc.outer_radius, disc.plate_thickness
    inner_face, outer_face = np.sqrt(a**2 - t**2), np.sqrt(outer**2 - t**2)
    # Differences of powers by their factors, or a film of a micrometre would cancel.
    squares = (outer - a) * (outer + a)
    cubes = squares * (inner_face**2 + inner_face * outer_face + outer_face**2) / (inner_face + outer_face)
    half = disc.central_angle / 2
    return np.asarray(2 * np.sin(half) / 3 * cubes - np.cos(half) * t * squares, dtype=np.float64)


def chamber_volume(*, disc: Disc) -> float:
    """Volume of one chamber between its plates, V = B A(R1), m^3: Eq. 4 with the exact area."""
    return float(disc.axial_width * liquid_area(disc=disc, surface_radius=disc.inner_radius))


def surface_radius(*, disc: Disc, fill_ratio: npt.ArrayLike) -> FloatArray:
    """Radius of the concentric free surface at a fill ratio: A(a) = x A(R1), by safeguarded Newton steps.

    Args: `fill_ratio`: x, any shape, within [0, 1].
    Returns: a, m, the shape of `fill_ratio`; R2 for an empty chamber, R1 for a full one.
    Raises: ValueError: a fill ratio outside [0, 1].
    Source: inverse of the exact area; gravity left out.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    if np.any(~((x >= 0) & (x <= 1))):
        raise ValueError("fill_ratio must lie within [0, 1]")
    r1, r2 = disc.inner_radius, disc.outer_radius
    within = partial(swept_area, central_angle=disc.central_angle, plate_thickness=disc.plate_thickness)
    whole = within(radius=r2)
    target = x * (whole - within(radius=r1))
    # The depth form keeps full relative accuracy for a film of a micrometre, where a^2 = R2^2 - ... cancels.
    squared, enough = r2**2 - x * (r2**2 - r1**2), 4 * np.finfo(np.float64).eps * r2**2
    for _ in range(60):
        a = np.sqrt(squared)
        step = (whole - within(radius=a) - target) / half_angle(disc=disc, radius=a)
        squared = np.minimum(np.maximum(squared + step, r1**2), r2**2)
        if (np.abs(step) <= enough).all():
            break
    return np.asarray(np.sqrt(squared), dtype=np.float64)
