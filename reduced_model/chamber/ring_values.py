"""Wall pressure, moment and dU/dV' of a chamber by closed forms or, under gravity, by quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.hydrostatics import displaced_by_gravity
from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.reduced_model.chamber.gravity import spilling_ring
from ringbalance.reduced_model.chamber.inputs import chamber_closed_forms
from ringbalance.reduced_model.chamber.tilted_ring import tilted_ring, turn_samples
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene

_EPSILON: Final = float(np.finfo(np.float64).eps)
_QUADRATURE: Final = 1e-10
"""Relative error of the quadrature over the tilted ring, on the safe side."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RingValues:
    """Means over a turn of gravity along the fill ratio, shape (n,); no finite elements."""

    fill_ratio: FloatArray
    surface_radius: FloatArray
    """Radius of the concentric free surface that holds the same volume, m."""
    wall_pressure: Estimate
    """Mean over the outer wall, of the liquid alone, Pa."""
    moment: Estimate
    """U, kg m."""
    moment_per_volume: Estimate
    """dU/dV' as liquid is added, kg/m^2."""
    closed: BoolArray
    """Whether gravity, where modelled, leaves a closed ring; where not, values are those without gravity."""
    status: Status


def ring_values(scene: Scene, *, fill_ratio: FloatArray, gravity: bool) -> RingValues:
    """Evaluate the closed forms of a chamber, or integrate over its tilted ring.

    Args: `fill_ratio`: x, shape (n,). `gravity`: whether gravity is modelled.
    Returns: RingValues; half-widths hold rounding, the quadrature's error and, where gravity leaves no closed
        ring, all that it could do to the liquid there.
    Source: `chamber_closed_forms`, `tilted_ring`.
    """
    disc, surface = scene.disc, surface_radius(disc=scene.disc, fill_ratio=fill_ratio)
    pressure, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fill_ratio)
    values = np.array([pressure, moment, scene.liquid.density * ratio / 2])
    closed, extra = np.ones(fill_ratio.shape, dtype=np.bool_), np.zeros_like(values)
    if gravity:
        values, closed, extra = _under_gravity(scene, fill_ratio, values)
    # The square of the surface's radius is known to a few eps of R2^2, which counts against the depth.
    depth = np.where(fill_ratio > 0, disc.outer_radius - surface, disc.outer_radius)
    widths = _EPSILON * (4 + 4 * disc.outer_radius / depth) * np.abs(values) + extra
    status = _status(scene, fill_ratio, closed)
    parts = [Estimate(value=v, uncertainty=w, status=status) for v, w in zip(values, widths, strict=True)]
    return RingValues(
        fill_ratio=fill_ratio,
        surface_radius=surface,
        wall_pressure=parts[0],
        moment=parts[1],
        moment_per_volume=parts[2],
        closed=closed,
        status=status,
    )


def _under_gravity(
    scene: Scene, fills: FloatArray, plain: FloatArray
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Values, whether the ring is closed, and half-widths of the quadrature or of what gravity could do."""
    gravity, wet = scene.environment.gravity, fills > 0
    ring = tilted_ring(scene, fills[wet])
    found = plain.copy()
    found[:, wet] = [ring.wall_pressure, ring.moment, ring.moment_per_volume]
    closed = ~spilling_ring(scene, fills) | ~wet
    closed[wet] &= ring.closed
    tilt = gravity / (scene.rotor.speed**2 * scene.disc.inner_radius)
    quadrature = (_QUADRATURE + min(tilt, 1.0) ** turn_samples(scene)) * np.abs(plain)
    displaced = displaced_by_gravity(
        disc=scene.disc, density=scene.liquid.density, gravity=gravity, fill_ratio=fills
    )
    displaced[:2, ~wet] = 0.0
    certain = closed & wet
    return np.where(closed, found, plain), closed, np.where(certain, quadrature, displaced)


def _status(scene: Scene, fills: FloatArray, closed: BoolArray) -> Status:
    if np.all(closed):
        return Status()
    x = fills[~closed][:1]
    where, change = "run dry on the outer wall", "raise the speed or the fill ratio"
    if spilling_ring(scene, x)[0]:
        where, change = "pass the inner radius", "raise the speed or lower the fill ratio"
    return Status(
        code=StatusCode.NO_RING,
        text=f"at a fill ratio of {x[0]:.4g}: the free surface would {where}: {change}; "
        "values there are without gravity",
    )
