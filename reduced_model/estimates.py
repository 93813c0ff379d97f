"""The numbers that estimates of left-out terms rest on: the tube's flow, the injection that decides.

Every estimate of `terms` is relative to the quantity that the term changes and holds at the worst fill of the
range.  What belongs to an injection is judged for the one that matters most, the shortest.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.tube.state import TubeState, tube_state, tube_state_at
from ringbalance.reduced_model.chamber.values import chamber_closed_forms, chamber_pressure
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.path import crest_head
from ringbalance.reduced_model.tube.regime import can_flow, driving_pressure, gas_over_crest, resting_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene

SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""
_NO_PRESSURE: Final = 1.0
"""Gauge, Pa, at or below which the gas drives nothing."""
_VELOCITIES: Final = 25
_TUBE_PARTS: Final = ("whole", "roughness", "rotation", "bends", "ends")
"""Of the loss."""


def deciding_gas_time(scene: Scene, *, rate: float) -> float:
    """Valve-open time of the shortest injection that matters, s: the one commanded at the limit of the
    vibration.

    Target vector: Kc times the limit; trial: the short step, where the limit lies below `fine_below`;
    law-based: the limit over the rate.  Every time scale is compared with this one, because the last
    injections decide whether a run settles.
    The controller's limits hold.  `rate` is the change of the vibration per second of gas, m/s; zero where
    nothing flows.
    Source: section 4 of the liquid-ring paper.
    """
    control = scene.controller
    commanded = control.proportional * control.limit
    if control.kind == "trial":
        fine = control.limit < control.fine_below
        commanded = min(control.first_trial, control.short_step if fine else control.long_step)
    elif control.kind == "law_based":
        commanded = control.limit / rate if rate > 0 else control.maximum_gas_time
    return min(max(commanded, control.minimum_gas_time), control.maximum_gas_time) or control.maximum_gas_time


def injection_time(scene: Scene) -> float:
    """`deciding_gas_time` with the flow at equal fills, s."""
    *_, arm = chamber_closed_forms(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2)
    flow = scene.liquid.density * scene.tube.area * range_flow(scene).equal
    rate = scene.rotor.influence_coefficient * scene.disc.moment_factor * float(arm) * flow
    return deciding_gas_time(scene, rate=rate)


def start_up_loss(*, start_up: float, gas_time: float, laminar: float = 0.0) -> float:
    """Fraction of an injection's steady volume that the column's start costs, from 0 to 1.

    1 - (tau/T) ln cosh(T/tau), or (tau/T) (1 - exp(-T/tau)) laminar.  A full column of length L under the
    driving pressure p obeys du/dt = (p/(rho L)) (1 - (u/u0)^2), p = (k + 1) rho u0^2/2, so that
    u = u0 tanh(t/tau) with tau = rho L u0/p = 2 L/((k + 1) u0); where the loss is laminar, in proportion to
    u, u = u0 (1 - exp(-t/tau)).  What the column coasts after the gas is shut is not subtracted.
    """
    t = gas_time / start_up
    log_cosh = t + math.log1p(math.exp(-2 * t)) - math.log(2)
    return laminar * -math.expm1(-t) / t + (1 - laminar) * (1 - log_cosh / t)


class RangeFlow(NamedTuple):
    """The tube's flow over the fills of `SHARES`, the opposite chamber with the rest of the pair's liquid."""

    driving: FloatArray
    """Pressure that drives a full siphon, Pa."""
    siphon: FloatArray
    """Velocity of a full siphon, m/s; zero without a driving pressure."""
    separated: FloatArray
    """Velocity of a column separated at the crest, m/s, of one that spills where gas stays there; infinite
    without a crest, zero where it blocks."""
    primes: BoolArray
    """Whether the gas lifts liquid over the crest of an unprimed tube."""
    starts: BoolArray
    """Whether the gas starts a flow in an unprimed tube."""
    equal: float
    """Velocity of a full siphon at equal fills, m/s; zero without gas pressure."""

    @property
    def velocity(self) -> FloatArray:
        """The smaller of both, m/s."""
        return np.minimum(self.siphon, self.separated)


@lru_cache(maxsize=8)
def range_flow(scene: Scene) -> RangeFlow:
    """The flow over the range of fills, unprimed. Source: `column_flow`."""
    own = chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio * np.array(SHARES))
    tube = TubeFlow.of(Designs(scene=scene, size=own.size))
    ends, gas = tube.ends(own, own[::-1]), np.full_like(own, pressure_factor(scene) * scene.gas.pressure)
    driving = driving_pressure(tube.path, ends)
    separated = np.full_like(own, np.inf)
    if tube.path.crest:
        separated = tube.flow(ends, primed=False).separation_velocity
    return RangeFlow(
        driving=driving,
        siphon=tube.velocity(driving, driving > 0, to_crest=False),
        separated=separated,
        primes=resting_pressure(tube.path, ends) > gas_over_crest(tube.path, ends),
        starts=can_flow(tube.path, ends, False) & (scene.gas.pressure > _NO_PRESSURE),
        equal=float(tube.velocity(gas, gas > 0, to_crest=False)[0]),
    )


def lost_at_crest(flow: RangeFlow) -> float:
    """Share of a full siphon's velocity that is lost over the crest: all where the gas does not prime it."""
    driven = flow.siphon > 0
    if np.any(driven & ~flow.primes):
        return 1.0
    lost = 1 - flow.separated[driven] / flow.siphon[driven]
    return float(np.max(np.maximum(lost, 0.0), initial=0.0))


def range_velocities(flow: RangeFlow) -> FloatArray:
    """From a quarter of the slowest flow, full or separated, to twice the fastest, m/s; empty without one."""
    velocities = np.concatenate([flow.siphon, flow.separated])
    ends = np.log(velocities[(velocities > 0) & np.isfinite(velocities)])
    if not np.any(flow.velocity > 0):
        return np.empty(0)
    return np.exp(np.linspace(np.min(ends) - np.log(4), np.max(ends) + np.log(2), _VELOCITIES))


def tube_changes(scene: Scene, velocity: FloatArray) -> dict[str, float]:
    """What leaving a part of the tube's loss out, or a constant in place of the whole, changes at worst.

    Returns: By `_TUBE_PARTS`, relative, of k under the same pressure, or of the head up to the siphon crest.
    """
    whole_k, *whole_heads = _heads(scene, velocity, "")
    log_u = np.log(velocity)
    # The same head drives another velocity, at which k is another: fully so in laminar flow.
    slope, along = np.gradient(np.log(whole_heads[0]), log_u), np.gradient(np.log(whole_k), log_u)
    changes = {}
    for part in _TUBE_PARTS:
        k, *heads = _heads(scene, velocity, part)
        ratios = np.array(heads) / np.array(whole_heads)
        moved = np.abs(ratios[0] ** (-1 / slope) - 1)
        own = np.abs(k / whole_k - 1) + np.abs(along) * moved
        changes[part] = float(np.max([own, *np.abs(ratios[1:] - 1)]))
    return changes


def _heads(scene: Scene, velocity: FloatArray, left_out: str) -> tuple[FloatArray, ...]:
    """k, and the heads of the full tube and, where it has a crest, up to there."""
    state = _loss_without(scene, velocity, left_out)
    full = state.k, (state.k + 1) * velocity**2 / 2
    if scene.tube.hump_radius is None:
        return full
    return (*full, crest_head(scene=scene, tube=scene.tube, state=state, velocity=velocity))


def _loss_without(scene: Scene, velocity: FloatArray, left_out: str) -> TubeState:
    """The loss of a smooth wall, at rest, straight, without entrance and exit; or the paper's constant."""
    tube = scene.tube
    if left_out == "whole":
        tube = replace(tube, drag_coefficient=PAPER_DRAG_COEFFICIENT)
    elif left_out == "roughness":
        tube = replace(tube, roughness=0.0)
    elif left_out == "bends":
        tube = replace(tube, bends=())
    state = tube_state(scene, velocity, tube=tube)
    if left_out == "rotation":
        return tube_state_at(tube=tube, reynolds=state.reynolds, rotation_reynolds=0.0)
    if left_out == "ends":
        nothing = np.zeros(velocity.shape)
        state = replace(state, terms={**state.terms, "entrance": nothing, "exit": nothing})
    if left_out in ("whole", "ends"):
        state = replace(state, kinetic_factor=np.ones(velocity.shape))
    return state
