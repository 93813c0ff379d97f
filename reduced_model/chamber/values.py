"""Wall pressure, moment and lambda of a chamber over its fill: by closed forms, with gravity, from a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber_table import chamber_table
from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    head_square,
    liquid_first_moment,
    surface_centroid,
    surface_radius,
    wall_square,
)
from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.chamber.tilted_ring import TiltedRing, turn_samples
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Disc, Scene


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
    """Hydrostatic pressure at the outer radius R2 without gravity, rho omega^2 (R2^2 - a^2)/2.

    Over rho it is the head of a chamber of any shape, from R2; the mean over the outer wall is a load.
    Returns: Pa, the shape of `fill_ratio`.
    Source: Eq. 11 of the liquid-ring paper from the free surface outward.
    """
    a = surface_radius(disc=scene.disc, fill_ratio=fill_ratio)
    scale = scene.liquid.density * scene.rotor.speed**2 / 2
    return np.asarray(scale * head_square(disc=scene.disc, surface_radius=a))


def measured_closed_forms(
    *, scene: Scene, fill_ratio: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Wall pressure, and moment and lambda corrected by the measured factor.

    U and lambda times `Disc.moment_factor`; P is that of the geometry.
    Returns: P, Pa, U, kg m, and lambda, m, the shape of `fill_ratio`.
    """
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill_ratio)
    factor = scene.disc.moment_factor
    return pressure, factor * moment, factor * ratio


_EPSILON: Final = float(np.finfo(np.float64).eps)
_QUADRATURE_ERROR: Final = 1e-10
"""Relative error of the quadrature over the tilted ring, on the safe side."""


def paper_closed_forms(scene: Scene, fill_ratio: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Paper's wall pressure from the exact volume, Pa, and moment from the paper's volume, kg m.

    Source: Eqs. 3, 4, 7 and 12.
    """
    disc, rho = scene.disc, scene.liquid.density
    volume = np.asarray(fill_ratio) * paper.chamber_volume_paper(disc=disc)
    radius = paper.surface_radius_paper(disc=disc, liquid_volume=volume)
    pressure = paper.wall_pressure_paper(
        disc=disc,
        density=rho,
        angular_velocity=scene.rotor.speed,
        liquid_volume=np.asarray(fill_ratio) * chamber_volume(disc=disc),
    )
    moment = paper.moment_paper(disc=disc, density=rho, surface_radius=radius)
    # Rounding of a root and its square would give an empty chamber a moment.
    return pressure, np.where(volume > 0, moment, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class RingValues:
    """Means over a turn of gravity along the fill ratio, shape (n,); no finite elements."""

    fill_ratio: FloatArray
    surface_radius: FloatArray
    """Radius of the concentric free surface that holds the same volume, m."""
    wall_pressure: Estimate
    """Mean liquid pressure on the outer wall, Pa: a load."""
    hydrostatic_pressure: Estimate
    """Liquid pressure at the outer radius R2, Pa: it drives the tube."""
    moment: Estimate
    """U, kg m."""
    moment_per_volume: Estimate
    """dU/dV' as liquid is added, kg/m^2."""
    closed: BoolArray
    """True where gravity, if modelled, leaves a closed ring; elsewhere values are those without gravity."""
    status: Status

    @classmethod
    def of(cls, scene: Scene, *, fill_ratio: FloatArray, gravity: bool) -> RingValues:
        """Evaluate the closed forms of a chamber, or integrate over its tilted ring.

        Args: `fill_ratio`: x, shape (n,). `gravity`: true if gravity is modelled.
        Returns: RingValues; half-widths include rounding, the quadrature's error and, where gravity leaves no
            closed ring, a bound of its effect.
        Source: `chamber_closed_forms`, `TiltedRing.of`.
        """
        disc, surface = scene.disc, surface_radius(disc=scene.disc, fill_ratio=fill_ratio)
        pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill_ratio)
        hydrostatic = chamber_pressure(scene=scene, fill_ratio=fill_ratio)
        values = np.array([pressure, moment, scene.liquid.density * ratio / 2, hydrostatic])
        closed, extra = np.ones(fill_ratio.shape, dtype=np.bool_), np.zeros_like(values)
        if gravity:
            values, closed, extra = _under_gravity(scene, fill_ratio, values)
        # The square of the surface's radius is known to a few eps of R2^2, which counts against the depth.
        depth = np.where(fill_ratio > 0, disc.outer_radius - surface, disc.outer_radius)
        widths = _EPSILON * (4 + 4 * disc.outer_radius / depth) * np.abs(values) + extra
        status = Status()
        if not np.all(closed):
            x = fill_ratio[~closed][:1]
            where, change = "run dry on the outer wall", "raise the speed or the fill ratio"
            if _spilling_ring(scene, x)[0]:
                where, change = "pass the inner radius", "raise the speed or lower the fill ratio"
            status = Status(
                code=StatusCode.NO_RING,
                text=f"at a fill ratio of {x[0]:.4g}: the free surface would {where}: {change}; "
                "values there are without gravity",
            )
        parts = [Estimate(value=v, uncertainty=w, status=status) for v, w in zip(values, widths, strict=True)]
        return cls(
            fill_ratio=fill_ratio,
            surface_radius=surface,
            wall_pressure=parts[0],
            moment=parts[1],
            moment_per_volume=parts[2],
            hydrostatic_pressure=parts[3],
            closed=closed,
            status=status,
        )


def _under_gravity(
    scene: Scene, fills: FloatArray, plain: FloatArray
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Values in the rows of `plain`, closed rings, half-widths of the quadrature or of gravity's effect."""
    disc, density, gravity, wet = scene.disc, scene.liquid.density, scene.environment.gravity, fills > 0
    ring = TiltedRing.of(scene, fills[wet])
    values = plain.copy()
    values[:, wet] = [ring.wall_pressure, ring.moment, ring.moment_per_volume, ring.hydrostatic_pressure]
    closed = ~_spilling_ring(scene, fills) | ~wet
    closed[wet] &= ring.closed
    tilt = gravity / (scene.rotor.speed**2 * disc.inner_radius)
    quadrature = (_QUADRATURE_ERROR + min(tilt, 1.0) ** turn_samples(scene)) * np.abs(plain)
    # At most gravity takes a chamber's liquid from the middle to a corner, or back; an imported chamber may
    # have corners beyond the half-angle that is as large as its surface.
    a = surface_radius(disc=disc, fill_ratio=fills)
    corner = half_angle(disc=disc, radius=a) if disc.geometry is None else disc.central_angle / 2
    reach = disc.outer_radius - a * np.cos(corner)
    pressure = np.where(wet, 2 * density * gravity * disc.outer_radius, 0.0)
    moment = density * fills * chamber_volume(disc=disc) * reach
    displaced = np.array([pressure, moment, density * reach, pressure])
    return np.where(closed, values, plain), closed, np.where(closed & wet, quadrature, displaced)


def _spilling_ring(scene: Scene, fill_ratio: FloatArray) -> BoolArray:
    """True where gravity tilts the free surface past the inner radius, shape (n,).

    Horizontal shaft: a - delta [(cos(alpha) - s)^2 + sin^2(alpha)]^(1/2) < R1, s = sin(alpha)/alpha;
    vertical: a^2 - delta B/2 < R1^2; delta = g/omega^2.
    Source: the free surface |r + g/omega^2| = const, to first order.
    """
    disc, delta = scene.disc, scene.environment.gravity / scene.rotor.speed**2
    a = surface_radius(disc=disc, fill_ratio=fill_ratio)
    alpha = half_angle(disc=disc, radius=a)
    if scene.environment.shaft == "vertical":
        innermost = np.sqrt(np.maximum(a**2 - delta * disc.axial_width / 2, 0.0))
    else:
        innermost = a - delta * np.hypot(np.cos(alpha) - np.sin(alpha) / alpha, np.sin(alpha))
    return np.asarray(innermost < disc.inner_radius * (1 - 1e-9))


def share_across(disc: Disc, fills: FloatArray) -> FloatArray:
    """Ratio dW/dU of the moments across and along the chamber's middle, of liquid that moves at a fill ratio.

    The ratio of a pair's moment lies between those of the fills that it passes.
    Returns: Tangent of the angle between both, the shape of `fills`.
    """
    if disc.geometry is None:
        return np.zeros(fills.shape)
    a = surface_radius(disc=disc, fill_ratio=fills)
    _, along_middle, across_middle = chamber_table(disc.geometry).surface(a)
    return np.asarray(across_middle / along_middle)
