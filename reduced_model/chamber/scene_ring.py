"""Finite elements of a scene's chamber: solved, or refused with what to change; there is no third way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


def scene_ring(
    scene: Scene,
    *,
    fill_ratio: npt.ArrayLike,
    gravity: bool,
    cells: Sequence[tuple[int, ...]] | None = None,
) -> RingQuantities:
    """Totals of one chamber's liquid, every one of them computed.

    Args: `gravity`: whether gravity is modelled. `cells`: meshes, finest first; default as in
        `ring_quantities`.
    Raises: SceneError: a chamber so narrow or a ring so shallow that a solve failed; the numbers of a failed
        solve would enter the tables of all other fill ratios.
    """
    ring = ring_quantities(
        disc=scene.disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fill_ratio,
        gravity=scene.environment.gravity if gravity else 0.0,
        shaft=scene.environment.shaft,
        cells=cells,
    )
    if np.all(ring.solved):
        return ring
    fault = scene_fault(
        scene=scene,
        table="disc",
        key="central_angle",
        problem=f"the pressure in a chamber of this shape cannot be solved ({ring.status.text})",
        allowed="a wider chamber, or a thinner plate_thickness",
    )
    raise SceneError([fault])
