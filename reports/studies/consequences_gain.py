"""Gain per operation of the target-vector loop, and its margins to overshoot and instability."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

SMALL_FILL: Final = 1e-3
"""Change of fill over which a loop counts as linear."""
CURVE_FACTORS: Final[FloatArray] = np.geomspace(0.25, 4.0, 21)
"""Of k, along the analytic curves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GainCurve:
    """Where overshoot and instability start, in controller.proportional, as one quantity varies."""

    values: FloatArray
    """Of the quantity, shape (n,)."""
    overshoot_gain: FloatArray
    """s/m."""
    instability_gain: FloatArray
    """s/m."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopGain:
    """The proportional loop about level chambers under one law."""

    law: str
    velocity: float
    """u at equal fills, m/s."""
    drag_coefficient: float
    """k that Eq. 18 reads out of that velocity, 2p/(rho u^2) - 1."""
    moment_per_transferred_mass: float
    """lambda at equal fills, m."""
    slope: float
    """Vibration taken away per second of gas, m/s."""
    gain: float
    """controller.proportional, s/m."""
    per_operation: float
    """h = Kc slope: share of the residual that an operation takes away."""
    lag_margin: float
    """Error of the assumed lag angle at which the residual no longer falls, acos(h/2), rad; 0 if h >= 2."""
    over_drag: GainCurve

    @property
    def overshoot_gain(self) -> float:
        """Kc from which a small residual turns round, 1/slope, s/m."""
        return 1 / self.slope

    @property
    def instability_gain(self) -> float:
        """Kc from which a small residual grows, 2/slope, s/m."""
        return 2 / self.slope


def loop_gain(scene: Scene, model: BalancerModel) -> LoopGain | None:
    """Linearise the loop about level chambers.

    e_(n+1) = (1 - h) e_n with h = Kc dA/dt and dA/dt = kappa |dM/dx| u S/V, so a residual turns round from h
    = 1 and grows from h = 2. With k h varies as 1/sqrt(k + 1); for a law whose k depends on
    the velocity that is the curve for a constant k that gives the same velocity at equal fills.
    Returns: LoopGain; None when the gas does not drive a flow at equal fills.
    Source: sections 4.2 and 5 of the liquid-ring paper; a discrete first-order loop.
    """
    x, pressure = scene.disc.initial_fill, scene.gas.pressure
    flow = model.flow.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
    u = float(flow.velocity)
    if u <= 0 or pressure <= 0:
        return None
    per_fill = _moment_per_fill(scene, model)
    slope = scene.rotor.influence_coefficient * per_fill * u * model.tube_area / model.chamber_volume
    k = 2 * pressure / (model.density * u**2) - 1
    arm = per_fill / (model.density * model.chamber_volume)
    h = scene.controller.proportional * slope
    slowed = np.sqrt((k + 1) / (k * CURVE_FACTORS + 1))
    return LoopGain(
        law=model.name,
        velocity=u,
        drag_coefficient=k,
        moment_per_transferred_mass=arm,
        slope=slope,
        gain=scene.controller.proportional,
        per_operation=h,
        lag_margin=math.acos(min(h / 2, 1.0)),
        over_drag=GainCurve(
            values=k * CURVE_FACTORS,
            overshoot_gain=1 / (slope * slowed),
            instability_gain=2 / (slope * slowed),
        ),
    )


def _moment_per_fill(scene: Scene, model: BalancerModel) -> float:
    """|dM/dx| at equal fills with the total held, kg m."""
    x, step = scene.disc.initial_fill, SMALL_FILL
    ends = np.array([x - step, x + step])
    moments = model.moment.pair_vector(fill_ratio=ends, opposite_fill_ratio=2 * x - ends)
    return float(abs(moments[1] - moments[0])) / (2 * step)
