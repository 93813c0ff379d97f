"""The upper end of the window of gas pressures, whose lower end lifts the liquid over the crest."""

from __future__ import annotations

from functools import cache
from typing import Final

from scipy.optimize import brentq

from ringbalance.reduced_model.gas_line import line_answers
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import with_value

_FARTHEST: Final = 2.0
"""Times the scene's gas pressure: how far it is sought."""


def highest_pressure(scene: Scene, model: BalancerModel) -> float | None:
    """Gauge gas pressure up to which the valve's smallest correction leaves the limit sure, Pa.

    The worse end counts where the scene gives no gas line; within 1 %.
    Returns: None: the smallest correction is too large already at the scene's pressure, or still
        small enough at twice that pressure.
    """

    @cache
    def above(pressure: float) -> float:
        answers = line_answers(with_value(scene=scene, quantity="pressure", value=pressure), model)
        return max((a.smallest_correction or 0.0) / a.largest_correction for a in answers) - 1

    low, high = scene.gas.pressure, _FARTHEST * scene.gas.pressure
    if low <= 0 or above(low) > 0 or above(high) <= 0:
        return None
    return float(brentq(above, low, high, xtol=0.01 * low))
