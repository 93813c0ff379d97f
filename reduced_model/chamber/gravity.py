"""Gravity and the ring: when a ring exists at all, and when it is closed."""

from __future__ import annotations

import math

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.chamber.tilted_ring import TiltedRing
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


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
