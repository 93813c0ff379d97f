"""Shape of a chamber, by closed forms or, where a mesh file gives it, by integrals over its walls.

A chamber is the set R1 <= r <= R2, |phi| <= alpha(r) with alpha(r) = theta/2 - asin(t/r): a plate takes a
strip of thickness t, with faces parallel to the bounding radii.  Of an imported one the cross-section is the
mean over the axial width B, and alpha(r) the half-angle of the sector whose free surface is as large.
"""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber_table import ChamberTable, chamber_table
from ringbalance.scene.arrays import FloatArray, plain
from ringbalance.scene.keys.derivations import swept_area
from ringbalance.scene.models import Disc

_LAST_STEP: Final = 1e-9
"""Newton step of the squared surface radius at which the iteration ends, over R2^2."""


def imported_table(disc: Disc) -> ChamberTable | None:
    """Integrals over a chamber's mesh; None for the sector between plates."""
    return None if disc.geometry is None else chamber_table(disc.geometry)


def half_angle(*, disc: Disc, radius: npt.ArrayLike) -> FloatArray:
    """Half-angle of the liquid's space at a radius, alpha(r) = theta/2 - asin(t/r).

    Args: `radius`: r, m, any shape; at least the plate thickness.
    Returns: alpha, rad, the shape of `radius`.
    Source: geometry of Fig. 2(b) of the liquid-ring paper; exact. Imported: -V'(r)/(2 r B).
    """
    if (table := imported_table(disc)) is not None:
        return np.asarray(table.surface(radius)[0] / (2 * disc.axial_width))
    r = np.asarray(radius, dtype=np.float64)
    return np.asarray(disc.central_angle / 2 - np.arcsin(disc.plate_thickness / r), dtype=np.float64)


def liquid_area(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """Cross-section between a concentric surface and the outer wall.

    A(a) = [theta r^2/2 - r^2 asin(t/r) - t sqrt(r^2 - t^2)] from a to R2.
    Args: `surface_radius`: a, m, any shape, within [R1, R2].
    Returns: Area, m^2, the shape of `surface_radius`.
    Source: integral of 2 r alpha(r); the paper's Eq. 3 is its flat-strip approximation, O(t^3) away.
    """
    if (table := imported_table(disc)) is not None:
        # Rounding at the outer wall would leave less than nothing, and a fill ratio below zero.
        return np.maximum(table.at_radius(surface_radius, 0), 0.0) / disc.axial_width
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
    if (table := imported_table(disc)) is not None:
        return np.asarray(table.at_radius(surface_radius, 1) / disc.axial_width)
    a, outer, t = np.asarray(surface_radius, dtype=np.float64), disc.outer_radius, disc.plate_thickness
    inner_face, outer_face = np.sqrt(a**2 - t**2), np.sqrt(outer**2 - t**2)
    # Differences of powers as products, because they would cancel in a film of a micrometre.
    squares = (outer - a) * (outer + a)
    cubes = squares * (inner_face**2 + inner_face * outer_face + outer_face**2) / (inner_face + outer_face)
    half = disc.central_angle / 2
    return np.asarray(2 * np.sin(half) / 3 * cubes - np.cos(half) * t * squares, dtype=np.float64)


def moment_across(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """First moment of the cross-section along y, m^3: zero unless an imported chamber is asymmetric.

    It turns the moment of every chamber by the same angle, atan(moment_across/liquid_first_moment).
    """
    if (table := imported_table(disc)) is not None:
        return np.asarray(table.at_radius(surface_radius, 2) / disc.axial_width)
    return np.zeros(np.shape(surface_radius))


def surface_centroid(*, disc: Disc, radius: npt.ArrayLike) -> FloatArray:
    """Mean of x over the concentric free surface, dU/dV' over the density, m.

    Returns: a sin(alpha)/alpha, the shape of `radius`; half of lambda at equal fills.
    Source: each volume that enters lies on the surface. Imported: U'(a)/V'(a).
    """
    if (table := imported_table(disc)) is not None:
        return table.surface(radius)[1]
    a, alpha = np.asarray(radius, dtype=np.float64), half_angle(disc=disc, radius=radius)
    return np.asarray(a * np.sin(alpha) / alpha, dtype=np.float64)


def wall_square(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """Mean over the outer wall of r^2 - a^2 where it is wet, m^2: times rho omega^2/2 the wall pressure."""
    if (table := imported_table(disc)) is not None:
        return table.at_radius(surface_radius, 3)
    return head_square(disc=disc, surface_radius=surface_radius)


def head_square(*, disc: Disc, surface_radius: npt.ArrayLike) -> FloatArray:
    """R2^2 - a^2, m^2: times rho omega^2/2 the pressure of the liquid at R2, for walls of any shape.

    Of an imported chamber R2 is the radius of its outermost point.
    """
    a = np.asarray(surface_radius, dtype=np.float64)
    return np.maximum((disc.outer_radius - a) * (disc.outer_radius + a), 0.0)


def chamber_volume(*, disc: Disc) -> float:
    """Volume of one chamber between its plates, V = B A(R1), m^3: Eq. 4 with the exact area."""
    if (table := imported_table(disc)) is not None:
        return table.volume
    volume: float = plain(disc.axial_width * liquid_area(disc=disc, surface_radius=disc.inner_radius))
    return volume


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
    if (table := imported_table(disc)) is not None:
        return np.asarray(np.sqrt(table.level_of(x * table.volume)))
    least, most, t = disc.inner_radius**2, disc.outer_radius**2, disc.plate_thickness

    def within(squared: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """`swept_area`, and its slope by the square of the radius, alpha."""
        alpha = half_angle(disc=disc, radius=np.sqrt(squared))
        return squared * alpha - t * np.sqrt(squared - t**2), alpha

    full = within(most)[0]
    target = x * (full - within(least)[0])
    # Newton's method squares the error, so a step of this size leaves only rounding.
    squared, enough = most - x * (most - least), _LAST_STEP * most
    for _ in range(60):
        area, alpha = within(squared)
        step = (full - area - target) / alpha
        squared = np.minimum(np.maximum(squared + step, least), most)
        if (np.abs(step) <= enough).all():
            break
    return np.asarray(np.sqrt(squared), dtype=np.float64)
