"""Effects of the inputs that were fitted together on the factors by which drawn devices differ."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.reduced_model.chamber.inputs import measured_closed_forms
from ringbalance.reduced_model.chamber.range import mean_gravity
from ringbalance.reduced_model.law.building import nominal_law
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.joint import direction_sides
from ringbalance.scene.models import Scene

LINE_KEYS: Final = ("conductance", "critical_ratio", "dead_volume", "valve_lag")
"""Of a chamber's gas line, which drawn devices may have of their own."""
RATE, MOMENT, INFLUENCE, LAG = range(4)
"""Rows of `fitted_effects` before those of `LINE_KEYS`."""


def fitted_effects(scene: Scene, *, of_flow: bool) -> FloatArray:
    """Changes along each direction of the fitted inputs by one expanded uncertainty (95 %).

    Args: `of_flow`: whether the flow is that of the scene's own tube, and not a law's that is given.
    Returns: Shape (8, directions): of ln S u/V, the rate at which a chamber empties at equal fills; of ln U,
        the moment; of ln kappa; of the lag angle, rad; and of the logarithms of `LINE_KEYS`.
    """
    gravity = mean_gravity(scene) > scene.tolerance
    sides = direction_sides(scene).values()
    ends = np.array(
        [[_values(side, gravity=gravity, of_flow=of_flow) for side in both] for both in sides]
    ).reshape(-1, 2, LAG + 1 + len(LINE_KEYS))
    return np.asarray(((ends[:, 1] - ends[:, 0]) / 2).T)


def _values(scene: Scene, *, gravity: bool, of_flow: bool) -> list[float]:
    fill = np.array([scene.disc.max_fill_ratio])
    moment = float(measured_closed_forms(scene=scene, fill_ratio=fill)[1][0])
    line = (getattr(scene.gas, key) for key in LINE_KEYS)
    return [
        _log_rate(scene, gravity=gravity) if of_flow else 0.0,
        math.log(moment),
        math.log(scene.rotor.influence_coefficient),
        scene.rotor.lag_angle,
        *(math.log(value) if value else 0.0 for value in line),
    ]


def _log_rate(scene: Scene, *, gravity: bool) -> float:
    """ln(S u/V); zero where nothing flows."""
    fill = scene.disc.initial_fill
    law = nominal_law(scene, gravity=gravity)
    flow = law.evaluate(
        fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=scene.gas.pressure, primed=True
    )
    u = abs(float(flow.velocity))
    return math.log(scene.tube.area * u / chamber_volume(disc=scene.disc)) if u > 0 else 0.0
