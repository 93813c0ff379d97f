"""What leaving one physical term out would change, estimated for a scene before anything is solved.

Every estimate is relative to the quantity that the term changes, holds at the worst fill of the range, and
rests on a dimensionless group that `terms` names.  What belongs to an injection is judged for the one that
matters most, the shortest (`_injection_time`).

**Inertia.**  A full column of length L under the driving pressure p obeys
    du/dt = (p/(rho L)) (1 - (u/u0)^2),    p = (k + 1) rho u0^2/2,
so u = u0 tanh(t/tau) with tau = rho L u0/p = 2 L/((k + 1) u0).  It has moved u0 tau ln cosh(t/tau), which
tends to u0 (t - tau ln 2): of an injection of duration T the start costs the fraction
1 - (tau/T) ln cosh(T/tau), at most 1, and tau ln 2 of a long one.  Where the loss is laminar, in proportion
to u, the same tau gives u = u0 (1 - exp(-t/tau)), and the fraction (tau/T) (1 - exp(-T/tau)), tau of a long
injection.  What the column coasts after the gas is shut is not subtracted: the fraction is an upper bound.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.state import TubeState, tube_state, tube_state_at
from ringbalance.reduced_model.chamber.contributions import (
    Contribution,
    amplification,
    capillary_share,
    chamber_fills,
    gravity_shares,
    percent,
    range_fills,
    wall_layers,
)
from ringbalance.reduced_model.chamber.values import chamber_closed_forms, chamber_pressure
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.path import crest_head, crest_middle, share_at_radius
from ringbalance.reduced_model.tube.regime import can_flow, driving_pressure, gas_over_crest, resting_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.loop_models import Sensor
from ringbalance.scene.models import Scene


def _deciding_gas_time(scene: Scene, *, rate: float) -> float:
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


def _long_start_up_loss(start_up: float, *, laminar: float = 0.0) -> float:
    """Valve-open time that a start costs of a long injection, s: tau ln 2 turbulent, tau laminar."""
    return start_up * (laminar + (1 - laminar) * math.log(2))


def _start_up_loss(*, start_up: float, gas_time: float, laminar: float = 0.0) -> float:
    """Fraction of an injection's steady volume that the column's start costs, from 0 to 1.

    1 - (tau/T) ln cosh(T/tau), or (tau/T) (1 - exp(-T/tau)) laminar.
    """
    t = gas_time / start_up
    log_cosh = t + math.log1p(math.exp(-2 * t)) - math.log(2)
    return laminar * -math.expm1(-t) / t + (1 - laminar) * (1 - log_cosh / t)


SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""
_NO_PRESSURE: Final = 1.0
"""Gauge, Pa, at or below which the gas drives nothing."""
_VELOCITIES: Final = 25
TubePart = str
"""Of the loss: `WHOLE`, "roughness", "rotation", "bends" or "ends"."""
WHOLE: Final = "whole"


def steady(scene: Scene) -> Scene:
    """The scene with fixed values of what no steady flow depends on: tuning, sensor and draws of a loop."""
    return replace(
        scene,
        rotor=replace(
            scene.rotor, influence_coefficient=1.0, lag_angle=0.0, initial_amplitude=1.0, initial_phase=0.0
        ),
        sensor=Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller=replace(
            scene.controller,
            kind="target_vector",
            limit=1.0,
            period=1.0,
            hold_time=1.0,
            proportional=1.0,
            first_trial=1.0,
            long_step=1.0,
            short_step=1.0,
        ),
        run=replace(scene.run, seed=0, time_limit=1.0),
    )


@dataclass(frozen=True, kw_only=True)
class _RangeFlow:
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

    @property
    def flows(self) -> bool:
        """Whether anything flows at some fill."""
        return bool(np.any(self.velocity > 0))


def range_flow(scene: Scene) -> _RangeFlow:
    """The flow over the range of fills, unprimed. Source: `column_flow`."""
    return _range_flow(steady(scene))


@lru_cache(maxsize=8)
def _range_flow(scene: Scene) -> _RangeFlow:
    own = chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio * np.array(SHARES))
    tube = TubeFlow.of(Designs(scene=scene, size=own.size))
    ends, gas = tube.ends(own, own[::-1]), np.full_like(own, pressure_factor(scene) * scene.gas.pressure)
    driving = driving_pressure(tube.path, ends)
    separated = np.full_like(own, np.inf)
    if tube.path.crest:
        separated = tube.flow(ends, primed=False).separation_velocity
    primes = resting_pressure(tube.path, ends) > gas_over_crest(tube.path, ends)
    return _RangeFlow(
        driving=driving,
        siphon=tube.velocity(driving, driving > 0, to_crest=False),
        separated=separated,
        primes=primes,
        starts=can_flow(tube.path, ends, False) & (scene.gas.pressure > _NO_PRESSURE),
        equal=float(tube.velocity(gas, gas > 0, to_crest=False)[0]),
    )


def _injection_time(scene: Scene) -> float:
    """Valve-open time of the injection that decides on a scene's estimates, s.

    Returns: s, of `_deciding_gas_time` with the flow at equal fills.
    """
    *_, arm = chamber_closed_forms(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2)
    flow = scene.liquid.density * scene.tube.area * range_flow(scene).equal
    rate = scene.rotor.influence_coefficient * scene.disc.moment_factor * float(arm) * flow
    return _deciding_gas_time(scene, rate=rate)


def plates(scene: Scene) -> Contribution:
    """Volume that the plates take from a plain sector."""
    disc = scene.disc
    # Eqs. 1 and 2: S_c = theta (R2^2 - R1^2)/2, without plates.
    bare = disc.axial_width * disc.central_angle / 2 * (disc.outer_radius**2 - disc.inner_radius**2)
    return Contribution(value=1 - chamber_volume(disc=disc) / bare, formula="1 - V/(B theta (R2^2 - R1^2)/2)")


def gravity_mean(scene: Scene) -> Contribution:
    """Change of wall pressure or moment, mean over a turn, of second order in g/(omega^2 a)."""
    formula = "free surface |r + g/omega^2| = b against a concentric one, at the worst fill of the range"
    return Contribution(value=gravity_shares(scene).mean, formula=formula)


def ripple_and_sloshing(scene: Scene) -> Contribution:
    """First order in g/(omega^2 a), and what the liquid's swing at 1x makes of it."""
    value = gravity_shares(scene).swing
    if scene.environment.shaft == "vertical":
        formula = "on a vertical shaft gravity does not turn in the disc's frame"
        return Contribution(value=value, formula=formula)
    largest = float(np.max(amplification(scene, _fills(scene)).largest))
    return Contribution(
        value=value,
        formula=(
            "first order in g/(omega^2 a), times 1 + 2 max(1, n) in the wall pressure, where the liquid's "
            f"swing at 1x makes n = |1/(1 - 1/s^2)| up to {largest:.2g} over the range of fills, s being "
            f"known to {percent(FREQUENCY_UNCERTAINTY)}"
        ),
    )


def surface_tension(scene: Scene) -> Contribution:
    """Pressure jump over a meniscus between wetted walls against the wall pressure."""
    return Contribution(
        value=float(np.max(capillary_share(scene, _fills(scene))["pressures"])),
        formula="sigma (2/B + 1/(a alpha) + 1/a)/P, an inverse Bond number",
    )


def wall_friction(scene: Scene) -> Contribution:
    """Ekman layers under the swing that gravity drives, against the wall pressure."""
    layers, ekman = wall_layers(scene, _fills(scene)[-1])
    formula = f"g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2) = {ekman:.1e}"
    return Contribution(value=float(layers), formula=formula)


def _fills(scene: Scene) -> FloatArray:
    closed = chamber_fills(scene)
    return closed if closed.size else range_fills(scene)


def crest(scene: Scene) -> Contribution:
    """A full siphon in place of the regimes over the crest, relative to the velocity."""
    if scene.tube.hump_radius is None:
        return Contribution(value=None, formula="the scene gives no hump_radius")
    return Contribution(
        value=_lost_at_crest(range_flow(scene)),
        formula="1 - u_separated/u_siphon, or 1 where the column to the siphon crest outweighs the gas",
    )


def _lost_at_crest(flow: _RangeFlow) -> float:
    driven = flow.siphon > 0
    if np.any(driven & ~flow.primes):
        return 1.0
    lost = 1 - flow.separated[driven] / flow.siphon[driven]
    return float(np.max(np.maximum(lost, 0.0), initial=0.0))


def tube_part(scene: Scene, part: TubePart) -> Contribution:
    """What leaving a part of the tube's loss out, or a constant in place of the whole, changes at worst.

    Relative, of k under the same pressure, or of the head up to the siphon crest.
    """
    if scene.tube.drag_coefficient is not None:
        return Contribution(value=None, formula="the scene prescribes k")
    return _tube_part(steady(scene), part)


@lru_cache(maxsize=32)
def _tube_part(scene: Scene, part: TubePart) -> Contribution:
    flow = range_flow(scene)
    if not flow.flows:
        return Contribution(value=None, formula="nothing flows")
    u = _range_velocities(flow)
    (k, *heads), (whole_k, *whole_heads) = (_heads(scene, u, left_out) for left_out in (part, None))
    ratios, log_u = np.array(heads) / np.array(whole_heads), np.log(u)
    # The same head drives another velocity, at which k is another: fully so in laminar flow.
    slope = np.gradient(np.log(whole_heads[0]), log_u)
    moved = np.abs(ratios[0] ** (-1 / slope) - 1)
    own = np.abs(k / whole_k - 1) + np.abs(np.gradient(np.log(whole_k), log_u)) * moved
    simpler = f"k = {PAPER_DRAG_COEFFICIENT:g}" if part == WHOLE else "leaving it out"
    over = f"over {u[0]:.2g} to {u[-1]:.2g} m/s"
    return Contribution(
        value=float(np.max([own, *np.abs(ratios[1:] - 1)])),
        formula=f"{simpler} changes k, or the head up to the siphon crest, {over}",
    )


def _range_velocities(flow: _RangeFlow) -> FloatArray:
    """From a quarter of the slowest flow, full or separated, to twice the fastest, m/s."""
    velocities = np.concatenate([flow.siphon, flow.separated])
    ends = np.log(velocities[(velocities > 0) & np.isfinite(velocities)])
    return np.exp(np.linspace(np.min(ends) - np.log(4), np.max(ends) + np.log(2), _VELOCITIES))


def _heads(scene: Scene, velocity: FloatArray, left_out: TubePart | None) -> tuple[FloatArray, ...]:
    """k, and the heads of the full tube and, where it has a crest, up to there."""
    state = _loss_without(scene, velocity, left_out)
    full = state.k, (state.k + 1) * velocity**2 / 2
    if scene.tube.hump_radius is None:
        return full
    return (*full, crest_head(scene=scene, tube=scene.tube, state=state, velocity=velocity))


def _loss_without(scene: Scene, velocity: FloatArray, left_out: TubePart | None) -> TubeState:
    """The loss of a smooth wall, at rest, straight, without entrance and exit; or the paper's constant."""
    tube = scene.tube
    if left_out == WHOLE:
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
    if left_out in (WHOLE, "ends"):
        state = replace(state, kinetic_factor=np.ones(velocity.shape))
    return state


def inertia(scene: Scene) -> Contribution:
    """What the start of the column costs, relative to the liquid that the deciding injection moves."""
    flow, deciding = range_flow(scene), _injection_time(scene)
    if not np.any(flow.starts):
        return Contribution(value=None, formula="nothing flows")
    re = abs(flow.equal) * scene.tube.bore / scene.liquid.kinematic_viscosity
    laminar = float(1 - turbulent_share(reynolds=np.array(re)))
    velocity, driving = flow.velocity[flow.starts], flow.driving[flow.starts]
    times = scene.liquid.density * scene.tube.length * velocity / driving
    # A column that never moves costs nothing to start.
    slowest = max(float(np.max(times)), 1e-12)
    return Contribution(
        value=_start_up_loss(start_up=slowest, gas_time=deciding, laminar=laminar),
        formula=f"start-up time 2 L/((k + 1) u) up to {1e3 * slowest:.3g} ms over the range of fills, "
        f"{_within(deciding)}",
        time=_long_start_up_loss(slowest, laminar=laminar),
    )


def filling(scene: Scene) -> Contribution:
    """The longer of filling and venting an empty chamber, by the slowest line."""
    volume = chamber_volume(disc=scene.disc) + (scene.gas.dead_volume or 0.0)
    ends, deciding = (line_ends(scene)[-1], line_ends(scene)[0]), _injection_time(scene)
    lines, supply = [end.line for end in ends], ends[1].line.supply_pressure
    fill = [float(line.filling_time(supply, volume=volume)) for line in lines]
    vent = [float(line.venting_time(supply, volume=volume)) for line in lines]
    formula = f"an empty chamber fills in {_span(fill)} ms and vents in {_span(vent)} ms, {_within(deciding)}"
    times = [max(pair) for pair in zip(fill, vent, strict=True)]
    return _over(formula, times, deciding, given=scene.gas.conductance is not None)


def lag(scene: Scene) -> Contribution:
    """Delay of the valve over the deciding injection."""
    times, deciding = [line_ends(scene)[i].valve_lag for i in (-1, 0)], _injection_time(scene)
    formula = f"{_span(times)} ms {_within(deciding)}"
    return _over(formula, times, deciding, given=scene.gas.valve_lag is not None)


def _within(deciding: float) -> str:
    return f"in the shortest injection that matters, {1e3 * deciding:.3g} ms"


def _span(times: Sequence[float]) -> str:
    """ms, of the fast and of the slow end."""
    return " to ".join(dict.fromkeys(f"{1e3 * time:.3g}" for time in times))


def _over(formula: str, times: Sequence[float], deciding: float, *, given: bool) -> Contribution:
    """With its times, s, at both ends of the gas line, over the deciding injection's."""
    fast, slow = (min(time / deciding, 1.0) for time in times)
    if given:
        return Contribution(value=slow, formula=formula, time=times[1])
    return Contribution(value=None, formula=formula, default_range=(fast, slow))


def held(scene: Scene) -> Contribution:
    """What is lifted to the crest and falls back, as in a run, at the lowest level of the range."""
    tube, flow, deciding = scene.tube, range_flow(scene), _injection_time(scene)
    slowest = float(np.min(flow.velocity[flow.starts], initial=np.inf))
    if tube.hump_radius is None:
        return Contribution(value=0.0, formula="a tube without a crest stays full")
    if not np.isfinite(slowest):
        return Contribution(value=None, formula="nothing flows")
    level = float(surface_radius(disc=scene.disc, fill_ratio=SHARES[0] * scene.disc.max_fill_ratio))
    near = share_at_radius(tube=tube, radius=level, far_leg=False)
    length = tube.length * (crest_middle(tube) - near)
    time = length / max(slowest, 1e-300)
    return Contribution(
        value=min(time / deciding, 1.0),
        formula=(
            f"at most what fills {1e3 * length:.3g} mm of tube, from the level to the crest's middle, falls "
            f"back after venting, over the liquid moved {_within(deciding)}, at the worst fill"
        ),
        time=time,
    )
