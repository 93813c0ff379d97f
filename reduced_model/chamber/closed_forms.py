"""Wall pressure, moment and lambda of a chamber by closed forms, of one scene or of many designs at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import (
    head_square,
    liquid_first_moment,
    surface_centroid,
    surface_radius,
    wall_square,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene


def chamber_closed_forms(
    *, scene: Scene, fill_ratio: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wall pressure, moment and lambda of a chamber without gravity.

    P = rho omega^2 <max(r^2 - a^2, 0)>/2 over the outer wall, U = rho B int x dA, lambda = 2 <x> over the
    free surface: in a sector P = rho omega^2 (R2^2 - a^2)/2 and lambda = 2 a sin(alpha)/alpha.
    Returns: P, Pa, U, kg m, and lambda, m, the shape of `fill_ratio`.
    Source: hydrostatics with the chamber's exact geometry, that of its mesh where it is imported.
    """
    disc, rho = scene.disc, scene.liquid.density
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    return (
        rho * scene.rotor.speed**2 / 2 * wall_square(disc=disc, surface_radius=a),
        rho * disc.axial_width * liquid_first_moment(disc=disc, surface_radius=a),
        2 * surface_centroid(disc=disc, radius=a),
    )


def chamber_pressure(*, scene: Scene, fill_ratio: npt.ArrayLike) -> FloatArray:
    """What a chamber's liquid presses with at the outer radius R2, rho omega^2 (R2^2 - a^2)/2; no gravity.

    The head of a chamber of any shape is this over rho, from R2; a mean over its walls is a load.
    Returns: Pa, the shape of `fill_ratio`.
    Source: Eq. 11 of the liquid-ring paper from the free surface outward.
    """
    a = surface_radius(disc=scene.disc, fill_ratio=fill_ratio)
    scale = scene.liquid.density * scene.rotor.speed**2 / 2
    return np.asarray(scale * head_square(disc=scene.disc, surface_radius=a))


def measured_closed_forms(
    *, scene: Scene, fill_ratio: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same with moment and lambda as a measured factor corrects them.

    U and lambda times `Disc.moment_factor`; P as the geometry has it.
    Returns: P, Pa, U, kg m, and lambda, m, the shape of `fill_ratio`.
    """
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill_ratio)
    factor = scene.disc.moment_factor
    return pressure, factor * moment, factor * ratio
