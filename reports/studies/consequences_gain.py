"""Gain per operation of the target-vector loop, its margins to overshoot and instability, both simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.ensemble.moment import moment_table
from ringbalance.controller.ensemble.monte_carlo import simulate_members
from ringbalance.controller.ensemble.samples import Members, members_alike
from ringbalance.controller.ensemble.transfer import PairTransfer
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

SMALL_FILL: Final = 1e-3
"""Change of fill over which a loop counts as linear."""
GAINS: Final = 61
"""Tried at once for each onset."""
PASSES: Final = 2
SEARCH: Final = (0.3, 4.0)
"""Gains per operation between which onsets are looked for."""
OPERATIONS: Final = 12
CURVE_FACTORS: Final[FloatArray] = np.geomspace(0.25, 4.0, 21)
"""Of k and of lambda, along the analytic curves."""
SIMULATED_FACTORS: Final[FloatArray] = np.geomspace(0.25, 4.0, 5)
"""The same where the loop is simulated."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GainCurve:
    """Where overshoot and instability start, in controller.proportional, as one quantity varies."""

    values: FloatArray
    """Of the quantity, shape (n,)."""
    overshoot_gain: FloatArray
    """s/m."""
    instability_gain: FloatArray
    """s/m."""
    simulated_values: FloatArray
    """Shape (m,)."""
    simulated_overshoot_gain: FloatArray
    """s/m; infinite where no overshoot was found."""
    simulated_instability_gain: FloatArray
    """s/m; infinite where no growth was found."""


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
    over_moment: GainCurve

    @property
    def overshoot_gain(self) -> float:
        """Kc from which a small residual turns round, 1/slope, s/m."""
        return 1 / self.slope

    @property
    def instability_gain(self) -> float:
        """Kc from which a small residual grows, 2/slope, s/m."""
        return 2 / self.slope


def loop_gain(scene: Scene, model: BalancerModel, *, transfer: PairTransfer) -> LoopGain | None:
    """Linearise the loop about level chambers, and find its margins by simulation as well.

    e_(n+1) = (1 - h) e_n with h = Kc dA/dt and dA/dt = kappa |dM/dx| u S/V, so a residual turns round from h
    = 1 and grows from h = 2. With k and lambda h varies as lambda/sqrt(k + 1); for a law whose k depends on
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
    ones = np.ones(SIMULATED_FACTORS.size)
    slowed = np.sqrt((k + 1) / (k * SIMULATED_FACTORS + 1))
    arms = SIMULATED_FACTORS
    drag = _simulated(scene, model, transfer, slope * slowed, (slowed, ones))
    moment = _simulated(scene, model, transfer, slope * arms, (ones, arms))
    return LoopGain(
        law=model.name,
        velocity=u,
        drag_coefficient=k,
        moment_per_transferred_mass=arm,
        slope=slope,
        gain=scene.controller.proportional,
        per_operation=h,
        lag_margin=math.acos(min(h / 2, 1.0)),
        over_drag=_curve(k, slope * np.sqrt((k + 1) / (k * CURVE_FACTORS + 1)), drag),
        over_moment=_curve(arm, slope * CURVE_FACTORS, moment),
    )


def _moment_per_fill(scene: Scene, model: BalancerModel) -> float:
    """|dM/dx| at equal fills with the total held, kg m."""
    table = moment_table(model=model, total=2 * scene.disc.initial_fill)
    x, step = scene.disc.initial_fill, SMALL_FILL
    ends = table.at(np.array([x - step, x + step]))
    return float(abs(ends[1] - ends[0])) / (2 * step)


def _curve(value: float, slopes: FloatArray, simulated: tuple[FloatArray, FloatArray]) -> GainCurve:
    return GainCurve(
        values=value * CURVE_FACTORS,
        overshoot_gain=1 / slopes,
        instability_gain=2 / slopes,
        simulated_values=value * SIMULATED_FACTORS,
        simulated_overshoot_gain=simulated[0],
        simulated_instability_gain=simulated[1],
    )


def _simulated(
    scene: Scene,
    model: BalancerModel,
    transfer: PairTransfer,
    slopes: FloatArray,
    factors: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Smallest gains with an overshoot and with growth, for each pair of factors of velocity and moment."""
    quiet = _small_and_exact(scene, model)
    onsets = []
    for which in ("overshoots", "diverged"):
        low, high = SEARCH[0] / slopes, SEARCH[1] / slopes
        for _ in range(PASSES):
            gains = np.geomspace(low, high, GAINS, axis=1)
            members = _members(quiet, gains, factors)
            runs = simulate_members(quiet, model, members=members, transfer=transfer)
            seen = np.asarray(getattr(runs, which)).reshape(gains.shape) > 0
            first = np.argmax(seen, axis=1)
            rows = np.arange(slopes.size)
            found = seen.any(axis=1) & (first > 0)
            low, high = gains[rows, np.maximum(first - 1, 0)], gains[rows, first]
        onsets.append(np.where(found, np.sqrt(low * high), np.inf))
    return onsets[0], onsets[1]


def _members(scene: Scene, gains: FloatArray, factors: tuple[FloatArray, FloatArray]) -> Members:
    alike = members_alike(scene, size=gains.size)
    velocity, moment = (np.repeat(factor, gains.shape[1]) for factor in factors)
    return Members(
        velocity_factor=velocity,
        moment_factor=moment,
        influence_coefficient=alike.influence_coefficient,
        lag_angle=alike.lag_angle,
        proportional=gains.ravel(),
    )


def _small_and_exact(scene: Scene, model: BalancerModel) -> Scene:
    """A small unbalance along chamber A, proportional part only, exact sensor, right beliefs, fast valves."""
    amplitude = scene.rotor.influence_coefficient * _moment_per_fill(scene, model) * SMALL_FILL
    period = scene.controller.period
    settings = replace(
        scene.controller,
        limit=1e-4 * amplitude,
        integral_time=None,
        derivative_time=0.0,
        minimum_gas_time=0.0,
        assumed_lag_angle=scene.rotor.lag_angle,
    )
    rotor = replace(scene.rotor, initial_amplitude=amplitude, initial_phase=-scene.rotor.lag_angle)
    return replace(
        scene,
        rotor=rotor,
        controller=settings,
        sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0),
        run=replace(scene.run, time_limit=OPERATIONS * (period + settings.maximum_gas_time)),
    )
