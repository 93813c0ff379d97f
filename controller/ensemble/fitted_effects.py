"""Effects of the inputs that were fitted together on the factors by which drawn devices differ."""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from ringbalance.reduced_model.chamber.values import measured_closed_forms
from ringbalance.reduced_model.core import Answers
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, in_batches
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
    sides = [side for both in direction_sides(scene).values() for side in both]
    if not sides:
        return np.zeros((LAG + 1 + len(LINE_KEYS), 0))
    values = in_batches(sides, partial(_values, of_flow=of_flow))
    return np.asarray((values[:, 1::2] - values[:, ::2]) / 2)


def _values(designs: Designs, *, of_flow: bool) -> FloatArray:
    scene, whole = designs.scene, np.ones(designs.size)
    moment = measured_closed_forms(scene=scene, fill_ratio=scene.disc.max_fill_ratio)[1]
    line = [getattr(scene.gas, key) for key in LINE_KEYS]
    rows = [
        _log_rate(designs) if of_flow else 0.0,
        np.log(moment),
        np.log(scene.rotor.influence_coefficient),
        scene.rotor.lag_angle,
        # A dead volume of zero has no logarithm, and no effect.
        *(0.0 if value is None else np.log(np.where(np.asarray(value) > 0, value, 1.0)) for value in line),
    ]
    return np.array([row * whole for row in rows])


def _log_rate(designs: Designs) -> FloatArray:
    """ln(S u/V) of a primed tube; zero where nothing flows."""
    answers = Answers.of(designs)
    u = answers.primed_velocity
    rate = designs.scene.tube.area * np.where(u > 0, u, 1.0) / answers.chamber_volume
    return np.where(u > 0, np.log(rate), 0.0)
