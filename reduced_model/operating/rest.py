"""A tube at rest without liquid over its siphon crest: how far each leg is full, and what lies between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.geometry import wall_radius
from ringbalance.physics.gas.column import vented_pressure
from ringbalance.physics.pressure.hydrostatics import column_radius
from ringbalance.physics.roots import bracketed_root
from ringbalance.reduced_model.tube.path import share_at_radius
from ringbalance.reduced_model.tube.regime import TubeEnds
from ringbalance.scene.models import Scene

Filled = Callable[[float, float], tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class _Rest:
    """Two columns and what lies between them."""

    near: float
    """s/L up to which the leg of the driven chamber is full."""
    far: float
    """s/L from which on the other leg is full."""
    between: float
    """Pressure of what lies between, gauge, Pa."""


def rest(*, scene: Scene, ends: TubeEnds[float], cavity: float | None, crest_pressure: float) -> _Rest:
    """Find the two columns of a tube at rest.

    A separated column leaves a cavity at a given pressure.  An unprimed tube holds gas: vented, it is at the
    opposite chamber's pressure; trapped, it is compressed isothermally from the hydrostatic pressures alone
    until it leaves at the opposite port, and at least to what keeps the driven column below the crest.
    Args: `ends`: pressures at the tube's ends, the driven chamber upstream; one that leaves its port open
        supports no column. `cavity`: pressure of the cavity of a separated column, gauge, Pa; None for gas.
        `crest_pressure`: D_m, column from the crest to the outer wall, Pa.
    Source: hydrostatics in the rotating frame; Boyle's law.
    """
    outer, covered = wall_radius(disc=scene.disc), ends.upstream_covered()
    near, far = ends.upstream_pressure(), ends.downstream_pressure()

    def leg(pressure: float, *, far_leg: bool) -> float:
        """Fraction of the path where a column ends that a pressure at the outer wall supports."""
        radius = column_radius(
            density=scene.liquid.density,
            angular_velocity=scene.rotor.speed,
            pressure=max(pressure, 0.0),
            outer=outer,
        )
        return share_at_radius(tube=scene.tube, radius=radius, far_leg=far_leg)

    def filled(pressure: float, near: float) -> tuple[float, float]:
        """Fractions of the path where the two columns end, under a pressure between them."""
        first = leg(near - pressure, far_leg=False) if covered else 0.0
        return first, 1.0 if ends.downstream_open() else leg(far - pressure, far_leg=True)

    if cavity is not None:
        between = cavity
    elif not covered:
        between = float(np.clip(ends.upstream_gas, 0.0, max(far - ends.port_pressure, 0.0)))
    elif scene.tube.hump_gas == "vented":
        between = 0.0
    else:
        between = _trapped(vented_pressure(scene), ends, filled, crest_pressure)
    first, last = filled(between, near)
    return _Rest(near=first, far=last, between=between)


def _trapped(ambient: float, ends: TubeEnds[float], filled: Filled, crest_pressure: float) -> float:
    """Pressure of the trapped gas, gauge; the gas that fills the tube between the columns is kept."""
    near_pressure, largest = (
        ends.upstream_pressure(),
        max(ends.downstream_pressure() - ends.port_pressure, 0.0),
    )
    first, last = filled(0.0, ends.upstream_hydrostatic)

    def excess(pressure: float) -> float:
        near, far = filled(pressure, near_pressure)
        return float((ambient + pressure) * (far - near) - ambient * (last - first))

    if largest <= 0:
        return 0.0
    root = (
        largest if excess(largest) < 0 else 0.0 if excess(0.0) >= 0 else bracketed_root(excess, 0.0, largest)
    )
    return float(np.clip(max(root, near_pressure - crest_pressure), 0.0, largest))
