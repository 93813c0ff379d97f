"""The gain to use: the largest one with which no residual turns round, at the edge of the uncertainty."""

from __future__ import annotations

import math

import numpy as np

from ringbalance.controller.ensemble.samples import MemberUncertainty, member_uncertainty
from ringbalance.controller.tuning.loop_factor import LoopFactor, vibration_rates
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.models import Scene


def recommended_gain(
    scene: Scene, model: BalancerModel, *, loop: LoopFactor, uncertainty_95: MemberUncertainty | None = None
) -> float:
    """Kc, s/m, of the target-vector algorithm; zero where nothing flows or the limit is below the noise.

    With the expanded uncertainty U of the loop factor, and the fastest chamber r times as fast as the mean
    of its pair, Kc b = min(1/r, h_s)/(1 + U): one injection then removes at most the whole residual, and the
    loop factor is at most h_s, with which noise leaves the amplitude within its limit.
    """
    if loop.rate == 0.0:
        return 0.0
    widths = member_uncertainty(scene, model) if uncertainty_95 is None else uncertainty_95
    fastest = float(np.max(vibration_rates(scene, model))) / loop.rate
    return min(1.0 / fastest, loop.largest_staying) / (1.0 + factor_uncertainty(widths)) / loop.rate


def factor_uncertainty(widths: MemberUncertainty) -> float:
    """Expanded uncertainty (95 %) of the loop factor, relative: velocity, moment, influence coefficient."""
    return math.sqrt(widths.velocity**2 + widths.moment**2 + widths.influence_coefficient**2)
