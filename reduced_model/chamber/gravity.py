"""Gravity and the ring: its effect on the means over a turn, and when a ring exists at all."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.chamber.tilted_ring import TiltedRing
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class GravityEffect:
    """Change of the means over a turn by gravity; arrays along the fill ratio."""

    wall_pressure: FloatArray
    """Pa."""
    hydrostatic_pressure: FloatArray
    """Pa."""
    moment: FloatArray
    """kg m."""

    @classmethod
    def of(cls, scene: Scene, *, fill_ratio: FloatArray) -> GravityEffect:
        """Change of the means over a turn, a dry part of the outer wall included; zero where empty."""
        pressure, hydrostatic, moment = (np.zeros_like(fill_ratio) for _ in range(3))
        wet = fill_ratio > 0
        still = replace(scene, environment=replace(scene.environment, gravity=0.0))
        ring, level = (TiltedRing.of(each, fill_ratio[wet]) for each in (scene, still))
        pressure[wet], moment[wet] = ring.wall_pressure - level.wall_pressure, ring.moment - level.moment
        hydrostatic[wet] = ring.hydrostatic_pressure - level.hydrostatic_pressure
        return cls(wall_pressure=pressure, hydrostatic_pressure=hydrostatic, moment=moment)


def check_ring(scene: Scene) -> None:
    """Refuse a horizontal rotor too slow for the liquid to form a ring, omega^2 a <= g.

    a is the smallest free-surface radius, that of the largest fill.
    Raises: SceneError: naming the speed and the lowest one allowed.
    Source: the free surface |r + g/omega^2| = const of a liquid at rest in the rotating frame.
    """
    gravity = scene.environment.gravity if scene.environment.shaft == "horizontal" else 0.0
    radius = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    lowest = math.sqrt(gravity / radius)
    if abs(scene.rotor.speed) > lowest:
        return
    fault = scene_fault(
        scene,
        "rotor.speed",
        problem="so slow that gravity keeps the liquid from forming a ring",
        allowed=f"above {lowest * 30 / math.pi:.4g} rpm",
    )
    raise SceneError([fault])


def closed_ring(scene: Scene, fill_ratio: FloatArray) -> BoolArray:
    """Whether the liquid still covers the whole outer wall under gravity; an empty chamber counts as closed.

    Source: `TiltedRing.of`.
    """
    closed, wet = np.ones(fill_ratio.shape, dtype=np.bool_), fill_ratio > 0
    closed[wet] = TiltedRing.of(scene, fill_ratio[wet]).closed
    return closed
