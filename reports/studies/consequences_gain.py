"""Gain per operation of the target-vector loop, its margins to overshoot and instability, both simulated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np

from ringbalance.controller.ensemble.monte_carlo import simulate_members
from ringbalance.controller.ensemble.run import MemberRuns
from ringbalance.controller.ensemble.samples import Members
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.models import Scene

SMALL_FILL: Final = 1e-3
"""Change of fill over which a loop counts as linear."""
_Seen: TypeAlias = BoolArray | IntArray
"""By member, whether or how often something happened."""

GAINS: Final = 11
"""Tried at once for each onset."""
PASSES: Final = 3
"""Each narrows an onset down tenfold in its logarithm; the last leaves 0.3 per cent."""
SEARCH: Final = (0.3, 4.0)
"""Gains per operation between which onsets are looked for."""
OPERATIONS: Final = 12
CURVE_FACTORS: Final[FloatArray] = np.geomspace(0.25, 4.0, 21)
"""Of k, along the analytic curves."""
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

    @property
    def overshoot_gain(self) -> float:
        """Kc from which a small residual turns round, 1/slope, s/m."""
        return 1 / self.slope

    @property
    def instability_gain(self) -> float:
        """Kc from which a small residual grows, 2/slope, s/m."""
        return 2 / self.slope


def loop_gain(scene: Scene, model: BalancerModel, *, dynamics: Dynamics) -> LoopGain | None:
    """Linearise the loop about level chambers, and find its margins by simulation as well.

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
    slowed, simulated = (np.sqrt((k + 1) / (k * f + 1)) for f in (CURVE_FACTORS, SIMULATED_FACTORS))
    overshoot, growth = _onsets(scene, model, dynamics, slope, simulated)
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
            simulated_values=k * SIMULATED_FACTORS,
            simulated_overshoot_gain=overshoot,
            simulated_instability_gain=growth,
        ),
    )


def _moment_per_fill(scene: Scene, model: BalancerModel) -> float:
    """|dM/dx| at equal fills with the total held, kg m."""
    x, step = scene.disc.initial_fill, SMALL_FILL
    ends = np.array([x - step, x + step])
    moments = model.moment.pair_vector(fill_ratio=ends, opposite_fill_ratio=2 * x - ends)
    return float(abs(moments[1] - moments[0])) / (2 * step)


def _onsets(
    scene: Scene, model: BalancerModel, dynamics: Dynamics, slope: float, slowed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Smallest gains with an overshoot and with growth, at factors of the velocity."""
    quiet = _small_and_exact(scene, model)

    def run(gains: FloatArray) -> MemberRuns:
        members = _members(quiet, gains, slowed)
        return simulate_members(quiet, model, members=members, dynamics=dynamics)

    low, high = (end / (slope * slowed) for end in SEARCH)
    first = np.geomspace(low, high, GAINS, axis=1)
    found = run(first)
    overshoot = _onset(first, found.overshoots, lambda gains: run(gains).overshoots)
    growth = _onset(first, found.diverged, lambda gains: run(gains).diverged)
    return overshoot, growth


def _onset(gains: FloatArray, seen: _Seen, look: Callable[[FloatArray], _Seen]) -> FloatArray:
    """Gain in each row from which on something is seen; infinite where that is none of them, or all."""
    low, high = _bracket(gains, seen)
    for _ in range(PASSES - 1):
        gains = np.geomspace(low, high, GAINS, axis=1)
        low, high = _bracket(gains, look(gains))
    return np.where(low < high, np.sqrt(low * high), np.inf)


def _bracket(gains: FloatArray, seen: _Seen) -> tuple[FloatArray, FloatArray]:
    """The last gain of each row before something is seen, and the next; equal where there is no such step."""
    first = np.argmax(seen.reshape(gains.shape) > 0, axis=1)
    rows = np.arange(len(gains))
    return gains[rows, np.maximum(first - 1, 0)], gains[rows, first]


def _members(scene: Scene, gains: FloatArray, slowed: FloatArray) -> Members:
    alike = Members.alike(scene, size=gains.size)
    return replace(alike, velocity_factor=np.repeat(slowed, gains.shape[1]), proportional=gains.ravel())


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
