"""What a scene's imbalance filter can know at best, before anything is measured."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.estimation.imbalance_filter import (
    predicted_deviation,
    start_estimate,
)
from ringbalance.controller.eccentric_mass.estimation.imbalance_model import ProcessNoise
from ringbalance.controller.eccentric_mass.strategy.settings import believed_whirl
from ringbalance.scene.eccentric_models import EccentricScene

LONGEST_STEPS: Final = 2_000
"""Steps in which it is worked out; with fewer than the filter takes, each carries less noise."""


def expected_deviation(scene: EccentricScene, *, speed: float, duration: float | None = None) -> float:
    """Standard deviation of the imbalance that an estimation at constant speed comes to.

    Divide by the imbalance, or by the balancing capacity 2 m_b r_b, to see whether it can be resolved at all.
    Args: `duration`: of the estimation, s; default the longest that the scene allows.
    Returns: kg m; at zero speed the earlier estimate, since a resting rotor shows nothing.
    """
    told = scene.imbalance_filter
    if speed == 0:
        return told.initial_unbalance
    longest = scene.supervisor.imbalance_time if duration is None else duration
    step = max(told.step, longest / LONGEST_STEPS)
    variance = np.repeat([told.position_noise**2, told.velocity_noise**2], 2) * told.step / step
    found = predicted_deviation(
        start_estimate(told.initial_position, told.initial_velocity, told.initial_unbalance),
        model=believed_whirl(scene),
        noise=ProcessNoise(told.velocity_walk**2, told.unbalance_walk**2),
        variance=variance,
        angular_velocity=speed,
        step=step,
        duration=longest,
        laboratory=scene.sensor.frame == "laboratory",
    )
    return float(found[-1])
