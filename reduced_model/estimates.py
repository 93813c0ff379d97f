"""Basis of the estimates of neglected terms: the flow in the tube and the shortest injection that matters.

Every estimate in `terms` is relative to the quantity that the term changes, at the worst fill of the range.
Terms of an injection are estimated for the shortest one that matters.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.tube.state import tube_state, tube_state_at
from ringbalance.reduced_model.chamber.values import chamber_closed_forms, chamber_pressure
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.path import crest_head
from ringbalance.reduced_model.tube.regime import can_flow, driving_pressure, gas_over_crest, resting_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene

FILL_SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is evaluated, as fractions of max_fill_ratio."""
_NO_PRESSURE_PA: Final = 1.0
"""Gauge pressure at or below which the gas drives nothing."""
_VELOCITY_POINTS: Final = 25
_LOSS_PARTS: Final = ("whole", "roughness", "rotation", "bends", "ends")


def deciding_gas_time(scene: Scene, *, rate: float) -> float:
    """Valve-open time of the shortest injection that matters, s: that for a vibration at its limit.

    Target vector: Kc times the limit; trial: the short step, where the limit lies below `fine_below`;
    law-based: the limit over the rate.  Every time scale is compared with this one, because the last
    injections decide whether a run settles.
    The result lies within the controller's limits of the valve-open time. `rate` is the change of the
    vibration per second of gas, m/s; zero where nothing flows.
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
    """Fraction of an injection's steady volume that is lost while the column starts, from 0 to 1.

    1 - (tau/T) ln cosh(T/tau), or (tau/T) (1 - exp(-T/tau)) laminar.  A full column of length L under the
    driving pressure p obeys du/dt = (p/(rho L)) (1 - (u/u0)^2), p = (k + 1) rho u0^2/2, so that
    u = u0 tanh(t/tau) with tau = rho L u0/p = 2 L/((k + 1) u0); where the loss is laminar, in proportion to
    u, u = u0 (1 - exp(-t/tau)).  The flow by inertia after the gas is shut is not subtracted.
    """
    t = gas_time / start_up
    log_cosh = t + math.log1p(math.exp(-2 * t)) - math.log(2)
    return laminar * -math.expm1(-t) / t + (1 - laminar) * (1 - log_cosh / t)


class RangeFlow(NamedTuple):
    """Flow of the tube over `FILL_SHARES`, the opposite chamber with the rest of the pair's liquid."""

    driving: FloatArray
    """Pressure that drives a full siphon, Pa."""
    siphon: FloatArray
    """Velocity of a full siphon, m/s; zero without a driving pressure."""
    separated: FloatArray
    """Velocity of a column that is separated at the crest, or spills into gas that stays there, m/s; infinite
    without a crest, zero where the tube is blocked."""
    primes: BoolArray
    """True where the gas lifts liquid over the crest of an unprimed tube."""
    starts: BoolArray
    """True where the gas starts a flow in an unprimed tube."""
    equal: float
    """Velocity of a full siphon at equal fills, m/s; zero without gas pressure."""

    @property
    def velocity(self) -> FloatArray:
        """Smaller velocity of a full and of a separated column, m/s."""
        return np.minimum(self.siphon, self.separated)


@lru_cache(maxsize=8)
def range_flow(scene: Scene) -> RangeFlow:
    """Flow over the range of fills, the tube unprimed beforehand. Source: `column_flow`."""
    wall = chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio * np.array(FILL_SHARES))
    tube = TubeFlow.of(Designs(scene=scene, size=wall.size))
    ends, gas = tube.ends(wall, wall[::-1]), np.full_like(wall, pressure_factor(scene) * scene.gas.pressure)
    driving = driving_pressure(tube.path, ends)
    separated = np.full_like(wall, np.inf)
    if tube.path.crest:
        separated = tube.flow(ends, primed=False).separation_velocity
    return RangeFlow(
        driving=driving,
        siphon=tube.velocity(driving, driving > 0, to_crest=False),
        separated=separated,
        primes=resting_pressure(tube.path, ends) > gas_over_crest(tube.path, ends),
        starts=can_flow(tube.path, ends, False) & (scene.gas.pressure > _NO_PRESSURE_PA),
        equal=float(tube.velocity(gas, gas > 0, to_crest=False)[0]),
    )


def tube_changes(scene: Scene) -> tuple[FloatArray, dict[str, float]]:
    """Largest relative change by leaving out a part of the tube's loss, or by the paper's k for the whole.

    Returns: Velocities from 1/4 of the slowest (full or separated) to twice the fastest, m/s; the larger
        change of k under the same pressure and of the head up to the siphon crest, by part of the loss. Both
        empty without flow, or for a prescribed k.
    """
    flow = range_flow(scene)
    if scene.tube.drag_coefficient is not None or not np.any(flow.velocity > 0):
        return np.empty(0), {}
    velocities = np.concatenate([flow.siphon, flow.separated])
    ends = np.log(velocities[(velocities > 0) & np.isfinite(velocities)])
    velocity = np.exp(np.linspace(np.min(ends) - np.log(4), np.max(ends) + np.log(2), _VELOCITY_POINTS))
    drags, heads = {}, {}
    for part in ("", *_LOSS_PARTS):
        tube = scene.tube
        if part == "whole":
            tube = replace(tube, drag_coefficient=PAPER_DRAG_COEFFICIENT)
        elif part == "roughness":
            tube = replace(tube, roughness=0.0)
        elif part == "bends":
            tube = replace(tube, bends=())
        state = tube_state(scene, velocity, tube=tube)
        if part == "rotation":
            state = tube_state_at(tube=tube, reynolds=state.reynolds, rotation_reynolds=0.0)
        elif part == "ends":
            nothing = np.zeros(velocity.shape)
            state = replace(state, terms={**state.terms, "entrance": nothing, "exit": nothing})
        if part in ("whole", "ends"):
            state = replace(state, kinetic_factor=np.ones(velocity.shape))
        drags[part], heads[part] = state.k, [(state.k + 1) * velocity**2 / 2]
        if tube.hump_radius is not None:
            heads[part].append(crest_head(scene=scene, tube=scene.tube, state=state, velocity=velocity))
    # Under the same head the velocity changes, and k with it, most in laminar flow.
    log_u = np.log(velocity)
    head_slope, k_slope = np.gradient(np.log(heads[""][0]), log_u), np.gradient(np.log(drags[""]), log_u)
    changes = {}
    for part in _LOSS_PARTS:
        ratios = np.array(heads[part]) / np.array(heads[""])
        moved = np.abs(ratios[0] ** (-1 / head_slope) - 1)
        change_of_k = np.abs(drags[part] / drags[""] - 1) + np.abs(k_slope) * moved
        changes[part] = float(np.max([change_of_k, *np.abs(ratios[1:] - 1)]))
    return velocity, changes
