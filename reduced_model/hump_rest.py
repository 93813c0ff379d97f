"""A tube at rest without liquid over its hump: how far each leg is full, and what lies between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ringbalance.reduced_model.hump_path import column_radius, share_at_radius
from ringbalance.scene.models import Scene

Filled = Callable[[float, float], tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class Rest:
    """Two columns and what lies between them."""

    near: float
    """s/L up to which the leg of the driven chamber is full."""
    far: float
    """s/L from which on the other leg is full."""
    between: float
    """Pressure of what lies between, gauge, Pa."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """Pressures of the liquid at the outer wall that lift the two columns, and the bounds of the tube."""

    near: float
    """p_A + P_A, gauge, Pa; a chamber whose level has left the port does not lift any."""
    far: float
    """p_C + P_C, gauge, Pa."""
    near_covered: bool
    """Whether A's level covers the port."""
    far_covered: bool
    """Whether C's level covers the port."""
    near_gas: float
    """p_A, gauge, Pa."""
    port: float
    """D_p, column from the port to the outer wall, Pa."""
    hump: float
    """D_m, column from the hump to the outer wall, Pa."""


def rest(*, scene: Scene, standing: Standing, cavity: float | None, ambient_near: float) -> Rest:
    """Find the two columns of a tube at rest.

    A torn column leaves a cavity at a given pressure.  An empty tube holds gas: vented, it is at the opposite
    chamber's pressure; trapped, it is compressed isothermally from the levels without drive until it leaves
    at the opposite port, and at least to what keeps the driven column below the hump.

    Args:
        scene: the scene.
        standing: what lifts the columns.
        cavity: pressure of the cavity of a torn column, gauge, Pa; None for gas.
        ambient_near: p + P_A of the driven chamber before its gas came on, gauge, Pa.

    Returns:
        Rest.

    Source: hydrostatics in the rotating frame; Boyle's law.
    """

    def filled(pressure: float, near: float) -> tuple[float, float]:
        """Shares of the path where the two columns end, under a pressure between them."""
        first, last = 0.0, 1.0
        if standing.near_covered:
            radius = column_radius(scene=scene, pressure=max(near - pressure, 0.0))
            first = share_at_radius(tube=scene.tube, radius=radius, far_leg=False)
        if standing.far_covered:
            radius = column_radius(scene=scene, pressure=max(standing.far - pressure, 0.0))
            last = share_at_radius(tube=scene.tube, radius=radius, far_leg=True)
        return first, last

    if cavity is not None:
        between = cavity
    elif not standing.near_covered:
        between = float(np.clip(standing.near_gas, 0.0, max(standing.far - standing.port, 0.0)))
    elif scene.tube.hump_gas == "vented":
        between = 0.0
    else:
        between = _trapped(scene, standing, filled, ambient_near)
    near, far = filled(between, standing.near)
    return Rest(near=near, far=far, between=between)


def _trapped(scene: Scene, standing: Standing, filled: Filled, ambient_near: float) -> float:
    """Pressure of the trapped gas, gauge; the gas that fills the tube between the columns is kept."""
    largest = max(standing.far - standing.port, 0.0)
    ambient = scene.gas.ambient_pressure
    first, last = filled(0.0, ambient_near)

    def surplus(pressure: float) -> float:
        near, far = filled(pressure, standing.near)
        return float((ambient + pressure) * (far - near) - ambient * (last - first))

    if largest <= 0:
        return 0.0
    found = largest if surplus(largest) < 0 else 0.0 if surplus(0.0) >= 0 else brentq(surplus, 0.0, largest)
    return float(np.clip(max(found, standing.near - standing.hump), 0.0, largest))
