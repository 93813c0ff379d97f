"""What each thing that a model of the tube's flow may leave out is worth, before the flow is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.numbers import reynolds_number, rotation_reynolds_number
from ringbalance.physics.tube.state import tube_state
from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.terms import MEAN, PLATES, chamber_contributions
from ringbalance.reduced_model.chamber.values import by_closed_form
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.reduced_model.law.building import tube_path
from ringbalance.reduced_model.selection.loss_models import (
    CONSTANT_MODELS,
    CORRELATIONS,
    MODELS,
    ROTATING,
    velocity_under_head,
)
from ringbalance.reduced_model.tube.heads import crest_head
from ringbalance.reduced_model.tube.regime import SiphonCrest, TubeEnds, can_flow, column_flow
from ringbalance.scene.accuracy import FINEST
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import CORRELATION, FINEST_MODELS, LEFT_OUT, Fidelity, TubeModels

SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""

LOSS: Final = "k as a function of velocity"
ROTATION: Final = "friction by rotation"
ROUGHNESS: Final = "roughness of the tube's wall"
BENDS: Final = "bends of the tube"
ENDS: Final = "entrance and exit of the tube"
TABLE: Final = "finite elements for rotation and ends"
LEVEL: Final = "plates, in the level of a chamber"
GRAVITY: Final = "gravity, in the level of a chamber"
NO_PRESSURE: Final = 1.0
"""Gauge, Pa, at or below which the gas drives nothing."""
HUMP: Final = "priming and separation over the siphon crest"
_LEAST_HEAD: Final = 1e-16
"""H without loss at 1e-8 m/s, the slowest flow that is looked for, m^2/s^2."""
_VELOCITIES: Final = 13
PARTS: Final[Mapping[str, tuple[Fidelity, ...]]] = {
    "roughness": (LEFT_OUT,),
    "rotation": (LEFT_OUT, CORRELATION),
    "bends": (LEFT_OUT, CORRELATION),
    "ends": (LEFT_OUT, CORRELATION),
}
"""Parts of the loss, with the models simpler than the finest in order of cost."""
PART_TERMS: Final = {ROUGHNESS: "roughness", ROTATION: "rotation", BENDS: "bends", ENDS: "ends"}
"""Part of the loss by the term's name."""


@dataclass(frozen=True, kw_only=True)
class FlowEstimate:
    """The tube's flow at equal fills as the correlations have it, a full siphon."""

    velocity: float
    """m/s; zero without gas pressure."""
    reynolds: float
    rotation_reynolds: float
    laminar_share: float
    """1 laminar, 0 turbulent."""


@lru_cache(maxsize=8)
def flow_estimate(scene: Scene) -> FlowEstimate:
    """Estimate the flow at equal fills from the gas pressure alone.

    Source: (k + 1) u^2/2 = p/rho with the correlations' k.
    """
    tube, nu = scene.tube, scene.liquid.kinematic_viscosity
    head, u, re, laminar = scene.gas.pressure / scene.liquid.density, 0.0, 0.0, 1.0
    if head >= _LEAST_HEAD:
        u = float(velocity_under_head(scene, loss=CORRELATIONS, head=head))
        re = float(reynolds_number(velocity=u, bore=tube.bore, kinematic_viscosity=nu))
        laminar = float(1 - turbulent_share(reynolds=re))
    return FlowEstimate(
        velocity=u,
        reynolds=re,
        rotation_reynolds=rotation_reynolds_number(
            angular_velocity=scene.rotor.speed, bore=tube.bore, kinematic_viscosity=nu
        ),
        laminar_share=laminar,
    )


@dataclass(frozen=True, kw_only=True)
class RangeFlow:
    """The tube's flow over the fills of `SHARES` by correlations with rotation; arrays along the fills."""

    driving_pressure: FloatArray
    """On the full column, Pa."""
    siphon: FloatArray
    """Velocity of a full siphon, m/s; zero without a driving pressure."""
    separated: FloatArray
    """Velocity of a column separated at the crest, m/s, of one that spills where gas stays there; infinite
    without a crest, zero where it blocks."""
    starts: BoolArray
    """Whether the gas starts a flow in an unprimed tube."""

    @property
    def velocity(self) -> FloatArray:
        """The smaller of both, m/s."""
        return np.minimum(self.siphon, self.separated)


@lru_cache(maxsize=8)
def range_flow(scene: Scene) -> RangeFlow:
    """Estimate the flow over the range of fills, the opposite chamber with the rest of the pair's liquid.

    Source: `tube_regime`, with closed-form chambers and a loss from correlations.
    """
    ends, crest, rho = _ends(scene), tube_path(scene).crest, scene.liquid.density
    driving = ends.driving_pressure()
    separated = np.full(driving.shape, np.inf)
    if crest is not None:
        separated = column_flow(
            ends=ends,
            crest=crest,
            primed=False,
            allowed=True,
            siphon=lambda pressure, flows: _velocities(scene, flows * pressure / rho, to_crest=False),
            separation=lambda pressure, flows: _velocities(scene, flows * pressure / rho, to_crest=True),
        ).separation_velocity
    can = can_flow(ends=ends, crest=crest, primed=False)
    return RangeFlow(
        driving_pressure=driving,
        siphon=_velocities(scene, driving / rho, to_crest=False),
        separated=separated,
        starts=np.asarray(can & (scene.gas.pressure > NO_PRESSURE)),
    )


def _velocities(scene: Scene, head: FloatArray, *, to_crest: bool) -> FloatArray:
    """m/s; zero where no head drives."""
    found = np.zeros(head.shape)
    drives = head > 0
    found[drives] = velocity_under_head(scene, loss=ROTATING, head=head[drives], to_crest=to_crest)
    return found


def steady(scene: Scene) -> Scene:
    """The scene with fixed values of what no steady flow depends on, tuning and draws of a loop, and without
    a choice of models."""
    return replace(
        scene,
        tube=replace(scene.tube, models=FINEST_MODELS),
        rotor=replace(scene.rotor, influence_coefficient=1.0, lag_angle=0.0),
        controller=replace(scene.controller, proportional=1.0),
        run=replace(scene.run, seed=0, time_limit=1.0),
    )


@dataclass(frozen=True, kw_only=True)
class LossEffect:
    """What simpler models of the tube's loss change at worst over the scene's velocities, relative."""

    k: float
    """Of k, or of the head up to the siphon crest."""
    velocity: float
    """Under one of these heads."""


def range_velocities(scene: Scene) -> FloatArray:
    """Velocities at which the loss is judged, m/s: from a quarter of the slowest flow, full or separated,
    over the range of fills to twice the fastest; none where nothing flows."""
    flow = range_flow(scene)
    if not np.any(flow.velocity > 0):
        return np.zeros(0)
    found = np.concatenate([flow.siphon, flow.separated])
    found = np.log(found[(found > 0) & np.isfinite(found)])
    return np.exp(np.linspace(np.min(found) - np.log(4), np.max(found) + np.log(2), _VELOCITIES))


def loss_effect(scene: Scene, models: TubeModels) -> LossEffect:
    """Compare simpler models of the loss with the finest; without an effect where the scene prescribes k."""
    if scene.tube.drag_coefficient is not None:
        return LossEffect(k=0.0, velocity=0.0)
    (k, *heads), (finest_k, *finest_heads) = _heads(scene, models), _heads(scene, FINEST_MODELS)
    ratios = np.array([own / finest for own, finest in zip(heads, finest_heads, strict=True)])
    changed = np.abs(np.array([k / finest_k, *ratios[1:]]) - 1)
    return LossEffect(
        k=float(np.max(changed, initial=0.0)),
        velocity=float(np.max(np.abs(ratios**-0.5 - 1), initial=0.0)),
    )


@lru_cache(maxsize=64)
def _heads(scene: Scene, models: TubeModels) -> tuple[FloatArray, ...]:
    """k, and the heads of the full tube and, where it has a crest, up to there."""
    tube, u = replace(scene.tube, models=models), range_velocities(scene)
    state = tube_state(tube=tube, liquid=scene.liquid, angular_velocity=scene.rotor.speed, velocity=u)
    full = state.k, (state.k + 1) * u**2 / 2
    if tube.hump_radius is None:
        return full
    return (*full, crest_head(scene=scene, tube=tube, state=state, velocity=u))


@lru_cache(maxsize=8)
def tube_models(scene: Scene) -> TubeModels:
    """Models of the tube's loss that the scene's tolerance asks for.

    One part after the other, the least first, takes the cheapest model with which all that is left out
    together keeps the tolerance; nothing is left out at tolerance zero, or where nothing flows.
    """
    scene = steady(scene)
    prescribed = scene.tube.drag_coefficient is not None
    if scene.tolerance == FINEST or prescribed or not range_velocities(scene).size:
        return FINEST_MODELS
    if loss_effect(scene, CONSTANT_MODELS).k <= scene.tolerance:
        return CONSTANT_MODELS
    chosen = FINEST_MODELS
    for part in sorted(PARTS, key=lambda part: loss_effect(scene, without(part)).k):
        trials = (replace(chosen, **{part: model}) for model in PARTS[part])  # type: ignore[arg-type]
        chosen = next((t for t in trials if loss_effect(scene, t).k <= scene.tolerance), chosen)
    return chosen


def without(part: str) -> TubeModels:
    """The finest models but for one part, which is left out."""
    return replace(FINEST_MODELS, **{part: LEFT_OUT})  # type: ignore[arg-type]


def with_tube_models(scene: Scene) -> Scene:
    """The scene with those models of its tube's loss that its tolerance asks for."""
    return replace(scene, tube=replace(scene.tube, models=tube_models(scene)))


_LACKING: Final = (
    (LOSS, CONSTANT_MODELS, "k = 50 against k by finite elements and correlations"),
    (ROTATION, without("rotation"), "k without rotation against that"),
    (TABLE, MODELS[ROTATING], "correlations alone against that"),
)
"""What the models of the loss may lack, and models that lack it."""


def loss_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the models of the loss leave out, relative to k, by name; zero where the scene prescribes k."""
    return {
        term: _contribution(term, loss_effect(scene, models).k, formula) for term, models, formula in _LACKING
    }


def flow_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the models of the flow leave out, relative to the velocity, by name.

    Source: stands with each; u^2 is proportional to the head over k + 1.
    """
    losses = {
        term: _contribution(term, loss_effect(scene, models).velocity, formula)
        for term, models, formula in _LACKING
    }
    fills = scene.disc.max_fill_ratio * np.array(SHARES)
    chamber = chamber_contributions(scene, _closed(scene, fills))["pressures"]
    lever = _lever(scene)
    levels = {
        name: Contribution(
            term=name,
            value=None if chamber[of].value is None else chamber[of].value * lever,  # type: ignore[operator]
            formula=f"({chamber[of].formula}) |P_A - P_C|/(2 (p + P_A - P_C))",
            source=chamber[of].source,
            rough=True,
        )
        for name, of in ((LEVEL, PLATES), (GRAVITY, MEAN))
    }
    return losses | levels | {HUMP: _hump(scene)}


def _contribution(term: str, value: float, formula: str) -> Contribution:
    """Rough, because none counts where the tube is blocked."""
    return Contribution(
        term=term, value=value, formula=formula, source="over the range of velocities", rough=True
    )


def _closed(scene: Scene, fills: np.ndarray) -> np.ndarray:
    closed = closed_ring(scene, fills)
    return np.asarray(fills[closed])


def _ends(scene: Scene) -> TubeEnds[FloatArray]:
    """Pressures at the tube's ends at the points, by the closed form."""
    own = np.array([by_closed_form(scene, scene.disc.max_fill_ratio * x).wall_pressure for x in SHARES])
    return TubeEnds(
        upstream_gas=np.full_like(own, scene.gas.pressure),
        downstream_gas=np.zeros_like(own),
        upstream_hydrostatic=own,
        downstream_hydrostatic=own[::-1],
        port_pressure=tube_path(scene).port_pressure,
    )


def _lever(scene: Scene) -> float:
    """How far a relative error of the wall pressures reaches the velocity."""
    ends = _ends(scene)
    driving = ends.driving_pressure()
    flows = driving > 0
    if not np.any(flows):
        return 1.0
    difference = np.abs(ends.upstream_hydrostatic - ends.downstream_hydrostatic)
    return float(np.max(difference[flows] / (2 * driving[flows])))


def _hump(scene: Scene) -> Contribution:
    crest = tube_path(scene).crest
    return Contribution(
        term=HUMP,
        value=0.0 if crest is None else _crest_contribution(scene, crest),
        formula="1 - u_separated/u_siphon, or 1 where the column to the siphon crest outweighs the gas",
        source="energy balance up to the siphon crest",
        rough=True,
    )


def _crest_contribution(scene: Scene, crest: SiphonCrest[FloatArray]) -> float:
    flow = range_flow(scene)
    flows = flow.driving_pressure > 0
    if np.any(flows & ~np.asarray(crest.primes(_ends(scene)))):
        return 1.0
    lost = 1 - flow.separated[flows] / flow.siphon[flows]
    return float(np.max(np.maximum(lost, 0.0), initial=0.0))
