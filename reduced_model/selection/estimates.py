"""Estimated contribution of every physical term of a scene, before anything is solved.

Every command takes its estimates from here, so that they agree.  Each is taken at the worst fill of the
range, and what belongs to an injection for the one that matters most, the shortest (`deciding_gas_time`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.numbers import reynolds_number
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
from ringbalance.reduced_model.gas_line import LineEnd, line_ends
from ringbalance.reduced_model.selection.loss_models import CONSTANT_MODELS
from ringbalance.reduced_model.selection.range_flow import (
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
from ringbalance.scene.accuracy import FINEST
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import TubeModels

RIPPLE_AND_SLOSHING: Final = "gravity ripple at 1x and sloshing"
SURFACE_TENSION: Final = "surface tension"
WALL_FRICTION: Final = "friction at the walls of a chamber"
INERTIA: Final = "tube inertia"
FILLING: Final = "gas filling"
LAG: Final = "valve lag"
HELD: Final = "liquid held in the tube"
Row = tuple[str, float | None, str, float | None]
"""Term, contribution, formula and time."""
NO_BASIS: Final = "the scene gives no basis for an estimate"


@dataclass(frozen=True, kw_only=True)
class TermEstimate:
    """Estimated contribution of one term."""

    term: str
    contribution: float | None
    """Relative to the quantity it changes; None where the scene gives no basis for an estimate."""
    formula: str
    """How it is estimated, with its numbers."""
    tolerance: float
    """Of the scene."""
    time: float | None = None
    """Valve-open time that it costs of a long injection, s; None for a term that is no time."""

    default_range: tuple[float, float] | None = None
    """Contribution at both ends of a default range, where the scene does not give the numbers."""

    @property
    def above(self) -> bool:
        """Whether the contribution exceeds the tolerance."""
        return self.contribution is not None and self.contribution > self.tolerance

    @property
    def comparison(self) -> str:
        """The contribution compared with the tolerance."""
        if self.default_range is not None:
            low, high = (percent(end) for end in self.default_range)
            return f"not in the scene: {low if low == high else f'{low} to {high}'} over a default range"
        if self.contribution is None:
            return NO_BASIS
        if self.tolerance == FINEST:
            return f"{percent(self.contribution)}; every term is modelled that has a model"
        side = "above" if self.above else "below"
        return f"{percent(self.contribution)} is {side} the tolerance of {percent(self.tolerance)}"

    @property
    def reason(self) -> str:
        """Formula and comparison; the same text in every command."""
        return f"{self.formula}; {self.comparison}"


def percent(fraction: float) -> str:
    """A fraction in per cent, to two digits."""
    value = 100 * fraction
    return f"{value:.0f} %" if 99.5 <= abs(value) < 1e6 else f"{value:.2g} %"


@lru_cache(maxsize=8)
def term_estimates(scene: Scene) -> Mapping[str, TermEstimate]:
    """Estimates of all terms of a scene, by term."""
    return MappingProxyType({**_steady(steady(scene)), **injection_estimates(scene)})


@lru_cache(maxsize=32)
def _steady(scene: Scene) -> Mapping[str, TermEstimate]:
    return {**_chamber(scene), **_tube(scene)}


def _by_term(scene: Scene, *rows: Row) -> dict[str, TermEstimate]:
    return {
        term: TermEstimate(
            term=term, contribution=value, formula=formula, tolerance=scene.tolerance, time=time
        )
        for term, value, formula, time in rows
    }


def _chamber(scene: Scene) -> dict[str, TermEstimate]:
    closed, found = chamber_fills(scene), range_contributions(scene)
    fills = closed if closed.size else range_fills(scene)
    pressure, moment = ({t: c.value or 0.0 for t, c in found[p].items()} for p in ("pressures", "moments"))
    capillary = float(np.max(capillary_share(scene, fills)["pressures"]))
    layers, ekman = wall_layers(scene, fills[-1])
    return _by_term(
        scene,
        (PLATES, pressure[PLATES], "1 - V/(B theta (R2^2 - R1^2)/2)", None),
        (
            MEAN,
            mean_gravity(scene),
            "free surface |r + g/omega^2| = b against a concentric one, at the worst fill of the range",
            None,
        ),
        (
            RIPPLE_AND_SLOSHING,
            max(part[RIPPLE] + part[SLOSHING] for part in (pressure, moment)),
            _sloshing_formula(scene, fills),
            None,
        ),
        (SURFACE_TENSION, capillary, "sigma (2/B + 1/(a alpha) + 1/a)/P, an inverse Bond number", None),
        (
            WALL_FRICTION,
            float(layers),
            f"g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2) = {ekman:.1e}",
            None,
        ),
    )


def _sloshing_formula(scene: Scene, fills: np.ndarray) -> str:
    if scene.environment.shaft == "vertical":
        return "on a vertical shaft gravity does not turn in the disc's frame"
    largest = float(np.max(amplification(scene, fills)))
    return (
        "first order in g/(omega^2 a), times 1 + 2 max(1, n) in the wall pressure, where the liquid's swing "
        f"at 1x makes n = |1/(1 - 1/s^2)| up to {largest:.2g} over the range of fills, at every speed"
    )


def _tube(scene: Scene) -> dict[str, TermEstimate]:
    crest = None if scene.tube.hump_radius is None else crest_contribution(scene)
    return _by_term(
        scene,
        (
            CREST,
            None if crest is None else crest.value,
            "the scene gives no hump_radius" if crest is None else crest.formula,
            None,
        ),
        _loss(scene, TUBE_LOSS, CONSTANT_MODELS),
        *(_loss(scene, term, without(part)) for term, part in PART_TERMS.items()),
    )


def _loss(scene: Scene, term: str, models: TubeModels) -> Row:
    if scene.tube.drag_coefficient is not None or not flows(scene):
        return term, None, "the scene prescribes k" if flows(scene) else "nothing flows", None
    u = range_velocities(scene)
    simpler = "k = 50" if models.constant else "leaving it out"
    return (
        term,
        loss_effect(scene, models).k,
        f"{simpler} changes k, or the head up to the siphon crest, over {u[0]:.2g} to {u[-1]:.2g} m/s",
        None,
    )


def injection_estimates(scene: Scene) -> Mapping[str, TermEstimate]:
    """Estimates of what goes beyond the quasi-steady flow law in an injection.

    Returns: Tube inertia, gas filling, valve lag and liquid held in the tube, by term; relative to the liquid
        that the deciding injection moves, at most 1.
    Source: `time_scales`.
    """
    flow, deciding = range_flow(steady(scene)), injection_time(scene)
    within = f"in the shortest injection that matters, {1e3 * deciding:.3g} ms"
    slow, fast = line_ends(scene)[0], line_ends(scene)[-1]
    found = _by_term(
        scene,
        _inertia(scene, flow, deciding, within),
        _gas_filling(scene, slow, fast, deciding, within),
        _lag(slow, fast, deciding, within),
        _held(scene, flow, deciding, within),
    )
    times = {FILLING: (_slower(scene, fast), _slower(scene, slow)), LAG: (fast.valve_lag, slow.valve_lag)}
    given = {FILLING: scene.gas.conductance, LAG: scene.gas.valve_lag}
    return {
        term: estimate
        if given.get(term, 0.0) is not None
        else replace(
            estimate,
            contribution=None,
            time=None,
            default_range=(min(times[term][0] / deciding, 1.0), min(times[term][1] / deciding, 1.0)),
        )
        for term, estimate in found.items()
    }


def _held(scene: Scene, flow: RangeFlow, deciding: float, within: str) -> Row:
    """What is lifted to the crest and falls back, as in a run, at the lowest level of the range."""
    tube, slowest = scene.tube, float(np.min(flow.velocity[flow.starts], initial=np.inf))
    if tube.hump_radius is None:
        return HELD, 0.0, "a tube without a crest stays full", None
    if not np.isfinite(slowest):
        return HELD, None, "nothing flows", None
    level = float(surface_radius(disc=scene.disc, fill_ratio=SHARES[0] * scene.disc.max_fill_ratio))
    near = share_at_radius(tube=tube, radius=level, far_leg=False)
    length = tube.length * (crest_middle(tube) - near)
    formula = (
        f"at most what fills {1e3 * length:.3g} mm of tube, from the level to the crest's middle, falls back "
        f"after venting, over the liquid moved {within}, at the worst fill"
    )
    time = length / max(slowest, 1e-300)
    return HELD, min(time / deciding, 1.0), formula, time


def _chamber_gas(scene: Scene) -> float:
    """Gas volume of a chamber without liquid, m^3."""
    return chamber_volume(disc=scene.disc) + (scene.gas.dead_volume or 0.0)


def _slower(scene: Scene, end: LineEnd) -> float:
    """The longer of filling and venting, s."""
    volume, supply = _chamber_gas(scene), end.line.supply_pressure
    filling = float(end.line.filling_time(supply, volume=volume))
    return max(filling, float(end.line.venting_time(supply, volume=volume)))


def _lag(slow: LineEnd, fast: LineEnd, deciding: float, within: str) -> Row:
    low, high = 1e3 * fast.valve_lag, 1e3 * slow.valve_lag
    lag = f"{high:.3g} ms" if low == high else f"{low:.3g} to {high:.3g} ms"
    return LAG, min(slow.valve_lag / deciding, 1.0), f"{lag} {within}", slow.valve_lag


def injection_time(scene: Scene) -> float:
    """Valve-open time of the injection that decides on a scene's estimates, s.

    Returns: s, of `deciding_gas_time` with the flow at equal fills.
    """
    equal = by_closed_form(scene, scene.disc.max_fill_ratio / 2)
    area = scene.tube.area
    flow = scene.liquid.density * area * equal_velocity(steady(scene))
    arm = scene.disc.moment_factor * equal.moment_per_mass
    return deciding_gas_time(scene, rate=scene.rotor.influence_coefficient * arm * flow)


def _inertia(scene: Scene, flow: RangeFlow, deciding: float, within: str) -> Row:
    if not np.any(flow.starts):
        return INERTIA, None, "nothing flows", None
    u, nu = equal_velocity(scene), scene.liquid.kinematic_viscosity
    re = reynolds_number(velocity=u, bore=scene.tube.bore, kinematic_viscosity=nu)
    laminar = float(1 - turbulent_share(reynolds=re))
    times = [
        start_up_time(
            density=scene.liquid.density,
            length=scene.tube.length,
            velocity=float(u),
            driving_pressure=float(p),
        )
        for u, p in zip(flow.velocity[flow.starts], flow.driving_pressure[flow.starts], strict=True)
    ]
    # A column that never moves costs nothing to start.
    slowest = max(max(times), 1e-12)
    lost = start_up_loss(start_up=slowest, gas_time=deciding, laminar=laminar)
    formula = f"start-up time 2 L/((k + 1) u) up to {1e3 * slowest:.3g} ms over the range of fills, {within}"
    return INERTIA, lost, formula, long_start_up_loss(slowest, laminar=laminar)


def _gas_filling(scene: Scene, slow: LineEnd, fast: LineEnd, deciding: float, within: str) -> Row:
    volume, supply = _chamber_gas(scene), slow.line.supply_pressure
    lines = [end.line for end in dict.fromkeys((fast, slow))]
    filling = " to ".join(f"{1e3 * float(line.filling_time(supply, volume=volume)):.3g}" for line in lines)
    venting = " to ".join(f"{1e3 * float(line.venting_time(supply, volume=volume)):.3g}" for line in lines)
    longest = _slower(scene, slow)
    formula = f"an empty chamber fills in {filling} ms and vents in {venting} ms, {within}"
    return FILLING, min(longest / deciding, 1.0), formula, longest
