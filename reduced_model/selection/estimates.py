"""Estimated contribution of every physical term of a scene, before anything is solved.

Every command takes its estimates from here, so that they agree.  Each is taken at the worst fill of the
range, and what belongs to an injection for the one that matters most, the shortest (`deciding_gas_time`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.sloshing.range import FREQUENCY_UNCERTAINTY
from ringbalance.physics.tube.friction import reynolds_number, turbulent_share
from ringbalance.reduced_model.chamber.range import (
    chamber_fills,
    mean_gravity,
    range_contributions,
    range_fills,
)
from ringbalance.reduced_model.chamber.terms import (
    MEAN,
    PLATES,
    RIPPLE,
    SLOSHING,
    amplification,
    capillary_share,
    wall_layers,
)
from ringbalance.reduced_model.chamber.values import by_closed_form
from ringbalance.reduced_model.contribution import Contribution, percent
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.selection.range_flow import (
    CONSTANT_MODELS,
    SHARES,
    RangeFlow,
    equal_velocity,
    flows,
    range_flow,
    range_velocities,
    steady,
)
from ringbalance.reduced_model.selection.tube_terms import (
    CREST,
    PART_TERMS,
    TUBE_LOSS,
    crest_contribution,
    loss_effect,
    without,
)
from ringbalance.reduced_model.time_scales import (
    deciding_gas_time,
    long_start_up_loss,
    start_up_loss,
    start_up_time,
)
from ringbalance.reduced_model.tube.path import crest_middle, share_at_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import TubeModels

RIPPLE_AND_SLOSHING: Final = "gravity ripple at 1x and sloshing"
SURFACE_TENSION: Final = "surface tension"
WALL_FRICTION: Final = "friction at the walls of a chamber"
INERTIA: Final = "tube inertia"
FILLING: Final = "gas filling"
LAG: Final = "valve lag"
HELD: Final = "liquid held in the tube"


@lru_cache(maxsize=8)
def term_estimates(scene: Scene) -> Mapping[str, Contribution]:
    """Estimates of all terms of a scene, by term."""
    return MappingProxyType({**_steady(steady(scene)), **injection_estimates(scene)})


@lru_cache(maxsize=32)
def _steady(scene: Scene) -> Mapping[str, Contribution]:
    return {c.term: c for c in (*_chamber(scene), *_tube(scene))}


def _chamber(scene: Scene) -> Iterator[Contribution]:
    closed, found = chamber_fills(scene), range_contributions(scene)
    fills = closed if closed.size else range_fills(scene)
    yield found["pressures"][PLATES]
    yield Contribution(
        term=MEAN,
        value=mean_gravity(scene),
        formula="free surface |r + g/omega^2| = b against a concentric one, at the worst fill of the range",
    )
    yield Contribution(
        term=RIPPLE_AND_SLOSHING,
        value=max((part[RIPPLE].value or 0.0) + (part[SLOSHING].value or 0.0) for part in found.values()),
        formula=_sloshing_formula(scene, fills),
    )
    yield Contribution(
        term=SURFACE_TENSION,
        value=float(np.max(capillary_share(scene, fills)["pressures"])),
        formula="sigma (2/B + 1/(a alpha) + 1/a)/P, an inverse Bond number",
    )
    layers, ekman = wall_layers(scene, fills[-1])
    formula = f"g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2) = {ekman:.1e}"
    yield Contribution(term=WALL_FRICTION, value=float(layers), formula=formula)


def _sloshing_formula(scene: Scene, fills: FloatArray) -> str:
    if scene.environment.shaft == "vertical":
        return "on a vertical shaft gravity does not turn in the disc's frame"
    largest = float(np.max(amplification(scene, fills).largest))
    return (
        "first order in g/(omega^2 a), times 1 + 2 max(1, n) in the wall pressure, where the liquid's swing "
        f"at 1x makes n = |1/(1 - 1/s^2)| up to {largest:.2g} over the range of fills, s being known to "
        f"{percent(FREQUENCY_UNCERTAINTY)}"
    )


def _tube(scene: Scene) -> Iterator[Contribution]:
    if scene.tube.hump_radius is None:
        yield Contribution(term=CREST, value=None, formula="the scene gives no hump_radius")
    else:
        yield crest_contribution(scene)
    yield _loss(scene, TUBE_LOSS, CONSTANT_MODELS)
    yield from (_loss(scene, term, without(part)) for term, part in PART_TERMS.items())


def _loss(scene: Scene, term: str, models: TubeModels) -> Contribution:
    if scene.tube.drag_coefficient is not None or not flows(scene):
        formula = "the scene prescribes k" if flows(scene) else "nothing flows"
        return Contribution(term=term, value=None, formula=formula)
    u, simpler = range_velocities(scene), "k = 50" if models.constant else "leaving it out"
    formula = f"{simpler} changes k, or the head up to the siphon crest, over {u[0]:.2g} to {u[-1]:.2g} m/s"
    return Contribution(term=term, value=loss_effect(scene, models).k, formula=formula)


def injection_time(scene: Scene) -> float:
    """Valve-open time of the injection that decides on a scene's estimates, s.

    Returns: s, of `deciding_gas_time` with the flow at equal fills.
    """
    equal = by_closed_form(scene, scene.disc.max_fill_ratio / 2)
    area = scene.tube.area
    flow = scene.liquid.density * area * equal_velocity(steady(scene))
    arm = scene.disc.moment_factor * equal.moment_per_mass
    return deciding_gas_time(scene, rate=scene.rotor.influence_coefficient * arm * flow)


def injection_estimates(scene: Scene) -> Mapping[str, Contribution]:
    """Estimates of what goes beyond the quasi-steady flow law in an injection.

    Returns: Tube inertia, gas filling, valve lag and liquid held in the tube, by term; relative to the liquid
        that the deciding injection moves, at most 1.
    Source: `time_scales`.
    """
    flow, deciding = range_flow(steady(scene)), injection_time(scene)
    within = f"in the shortest injection that matters, {1e3 * deciding:.3g} ms"
    found = (
        _inertia(scene, flow, deciding, within),
        _filling(scene, deciding, within),
        _lag(scene, deciding, within),
        _held(scene, flow, deciding, within),
    )
    return {c.term: replace(c, rough=True) for c in found}


def _inertia(scene: Scene, flow: RangeFlow, deciding: float, within: str) -> Contribution:
    source, starts = "rho L du/dt", flow.starts
    if not np.any(starts):
        return Contribution(term=INERTIA, value=None, formula="nothing flows", source=source)
    u, nu = equal_velocity(scene), scene.liquid.kinematic_viscosity
    re = reynolds_number(velocity=u, bore=scene.tube.bore, kinematic_viscosity=nu)
    laminar = float(1 - turbulent_share(reynolds=re))
    times = start_up_time(
        density=scene.liquid.density,
        length=scene.tube.length,
        velocity=flow.velocity[starts],
        driving_pressure=flow.driving_pressure[starts],
    )
    # A column that never moves costs nothing to start.
    slowest = max(float(np.max(times)), 1e-12)
    return Contribution(
        term=INERTIA,
        value=start_up_loss(start_up=slowest, gas_time=deciding, laminar=laminar),
        formula=(
            f"start-up time 2 L/((k + 1) u) up to {1e3 * slowest:.3g} ms over the range of fills, {within}"
        ),
        source=source,
        time=long_start_up_loss(slowest, laminar=laminar),
    )


def _filling(scene: Scene, deciding: float, within: str) -> Contribution:
    """The longer of filling and venting an empty chamber, by the slowest line."""
    volume = chamber_volume(disc=scene.disc) + (scene.gas.dead_volume or 0.0)
    ends = (line_ends(scene)[-1], line_ends(scene)[0])
    lines, supply = [end.line for end in ends], ends[1].line.supply_pressure
    filling = [float(line.filling_time(supply, volume=volume)) for line in lines]
    venting = [float(line.venting_time(supply, volume=volume)) for line in lines]
    told, vents = (_span(times) for times in (filling, venting))
    found = Contribution(
        term=FILLING,
        value=None,
        formula=f"an empty chamber fills in {told} ms and vents in {vents} ms, {within}",
        source="ISO 6358-1",
    )
    times = [max(pair) for pair in zip(filling, venting, strict=True)]
    return _over(found, times, deciding, given=scene.gas.conductance is not None)


def _lag(scene: Scene, deciding: float, within: str) -> Contribution:
    times = [line_ends(scene)[i].valve_lag for i in (-1, 0)]
    found = Contribution(term=LAG, value=None, formula=f"{_span(times)} ms {within}", source="definition")
    return _over(found, times, deciding, given=scene.gas.valve_lag is not None)


def _span(times: Sequence[float]) -> str:
    """ms, of the fast and of the slow end."""
    return " to ".join(dict.fromkeys(f"{1e3 * time:.3g}" for time in times))


def _over(found: Contribution, times: Sequence[float], deciding: float, *, given: bool) -> Contribution:
    """With its times, s, at both ends of the gas line, over the deciding injection's."""
    fast, slow = (min(time / deciding, 1.0) for time in times)
    if given:
        return replace(found, value=slow, time=times[1])
    return replace(found, default_range=(fast, slow))


def _held(scene: Scene, flow: RangeFlow, deciding: float, within: str) -> Contribution:
    """What is lifted to the crest and falls back, as in a run, at the lowest level of the range."""
    tube, slowest = scene.tube, float(np.min(flow.velocity[flow.starts], initial=np.inf))
    found = Contribution(term=HELD, value=None, formula="nothing flows", source="lift to the crest")
    if tube.hump_radius is None:
        return replace(found, value=0.0, formula="a tube without a crest stays full")
    if not np.isfinite(slowest):
        return found
    level = float(surface_radius(disc=scene.disc, fill_ratio=SHARES[0] * scene.disc.max_fill_ratio))
    near = share_at_radius(tube=tube, radius=level, far_leg=False)
    length = tube.length * (crest_middle(tube) - near)
    formula = (
        f"at most what fills {1e3 * length:.3g} mm of tube, from the level to the crest's middle, falls back "
        f"after venting, over the liquid moved {within}, at the worst fill"
    )
    time = length / max(slowest, 1e-300)
    return replace(found, value=min(time / deciding, 1.0), formula=formula, time=time)
