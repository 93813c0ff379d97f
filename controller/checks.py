"""What a scene must allow before a closed loop means anything."""

from __future__ import annotations

import math

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


def check_ring(scene: Scene) -> None:
    """Refuse a horizontal rotor too slow for the liquid to form a ring, omega^2 a <= g.

    a is the smallest free-surface radius of a run, that of the largest fill.

    Args:
        scene: the scene.

    Raises:
        SceneError: naming the speed and the lowest one allowed.

    Source: the free surface |r + g/omega^2| = const of a liquid at rest in the rotating frame.
    """
    gravity = scene.environment.gravity if scene.environment.shaft == "horizontal" else 0.0
    radius = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    lowest = math.sqrt(gravity / radius)
    if abs(scene.rotor.speed) > lowest:
        return
    fault = scene_fault(
        scene=scene,
        table="rotor",
        key="speed",
        problem="so slow that gravity keeps the liquid from forming a ring",
        allowed=f"above {lowest * 30 / math.pi:.4g} rpm",
    )
    raise SceneError([fault])
