"""What each thing that a model of the tube's flow may leave out is worth, before the flow is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final, Literal

import numpy as np

from ringbalance.physics.tube.state import tube_state
from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.terms import MEAN, PLATES, chamber_contributions
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.reduced_model.selection.range_flow import (
    CONSTANT_MODELS,
    MODELS,
    ROTATING,
    SHARES,
    flows,
    range_ends,
    range_flow,
    range_velocities,
    steady,
)
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.reduced_model.tube.heads import crest_head
from ringbalance.reduced_model.tube.regime import SiphonCrest
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import FINEST
from ringbalance.scene.tube_models import CORRELATION, FINEST_MODELS, LEFT_OUT, Fidelity, TubeModels

TUBE_LOSS: Final = "loss of the tube"
ROTATION: Final = "friction by rotation"
ROUGHNESS: Final = "roughness of the tube's wall"
BENDS: Final = "bends of the tube"
ENDS: Final = "entrance and exit of the tube"
FINITE_ELEMENTS: Final = "finite elements for rotation and ends"
CREST: Final = "priming over the siphon crest"
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
class _LossEffect:
    """What simpler models of the tube's loss change at worst over the scene's velocities, relative."""

    k: float
    """Of k under the same pressure, or of the head up to the siphon crest."""
    velocity: float
    """Under the same pressure."""


def loss_effect(scene: Scene, models: TubeModels) -> _LossEffect:
    """Compare simpler models of the loss with the finest; without an effect where the scene prescribes k."""
    if scene.tube.drag_coefficient is not None:
        return _LossEffect(k=0.0, velocity=0.0)
    (k, *heads), (finest_k, *finest_heads) = _heads(scene, models), _heads(scene, FINEST_MODELS)
    log_u = np.log(range_velocities(scene))
    ratios = np.array(heads) / np.array(finest_heads)
    # The same head drives another velocity, at which k is another: fully so in laminar flow.
    slopes = np.array([np.gradient(np.log(head), log_u) for head in finest_heads])
    velocity = np.abs(ratios ** (-1 / slopes) - 1)
    own = np.abs(k / finest_k - 1) + np.abs(np.gradient(np.log(finest_k), log_u)) * velocity[0]
    return _LossEffect(k=float(np.max([own, *np.abs(ratios[1:] - 1)])), velocity=float(np.max(velocity)))


@lru_cache(maxsize=64)
def _heads(scene: Scene, models: TubeModels) -> tuple[FloatArray, ...]:
    """k, and the heads of the full tube and, where it has a crest, up to there."""
    tube, u = replace(scene.tube, models=models), range_velocities(scene)
    state = tube_state(scene, u, tube=tube)
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
    if scene.tolerance == FINEST or prescribed or not flows(scene):
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


LOSS_STEPS: Final = MappingProxyType(
    {
        TUBE_LOSS: (CONSTANT_MODELS, "k = 50 against k by finite elements and correlations"),
        ROTATION: (without("rotation"), "k without rotation against that"),
        FINITE_ELEMENTS: (MODELS[ROTATING], "correlations alone against that"),
    }
)
"""What each of `LOSSES` adds to the one before it, with a loss that lacks that, and how it is estimated."""
LEVEL_STEPS: Final = (PLATES, MEAN)
"""What the closed form adds to Eq. 12, and the integrals over the tilted liquid to that."""


def loss_contributions(scene: Scene, *, of: Literal["k", "velocity"] = "k") -> Mapping[str, Contribution]:
    """What the models of the loss leave out, relative, by name; zero where the scene prescribes k.

    Rough, because none counts where the tube is blocked.
    """
    return {
        term: Contribution(
            term=term,
            value=getattr(loss_effect(scene, models), of),
            formula=formula,
            source="over the range of velocities",
            rough=True,
        )
        for term, (models, formula) in LOSS_STEPS.items()
    }


def flow_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the models of the flow leave out, relative to the velocity, by name.

    Source: stands with each; u^2 is proportional to the head over k + 1.
    """
    fills = scene.disc.max_fill_ratio * np.array(SHARES)
    chamber = chamber_contributions(scene, fills[closed_ring(scene, fills)])["pressures"]
    lever = _lever(scene)
    levels = {
        term: replace(
            chamber[term],
            value=(chamber[term].value or 0.0) * lever,
            formula=f"({chamber[term].formula}) |P_A - P_C|/(2 (p + P_A - P_C))",
            rough=True,
        )
        for term in LEVEL_STEPS
    }
    return {**loss_contributions(scene, of="velocity"), **levels, CREST: crest_contribution(scene)}


def _lever(scene: Scene) -> float:
    """How far a relative error of the wall pressures reaches the velocity."""
    ends = range_ends(scene)
    driving = ends.driving_pressure()
    flows = driving > 0
    if not np.any(flows):
        return 1.0
    difference = np.abs(ends.upstream_hydrostatic - ends.downstream_hydrostatic)
    return float(np.max(difference[flows] / (2 * driving[flows])))


def crest_contribution(scene: Scene) -> Contribution:
    """What a full siphon in place of the regimes over the crest leaves out, relative to the velocity."""
    crest = tube_path(scene).crest
    return Contribution(
        term=CREST,
        value=0.0 if crest is None else _lost_at_crest(scene, crest),
        formula="1 - u_separated/u_siphon, or 1 where the column to the siphon crest outweighs the gas",
        source="energy balance up to the siphon crest",
        rough=True,
    )


def _lost_at_crest(scene: Scene, crest: SiphonCrest[FloatArray]) -> float:
    flow = range_flow(scene)
    flows = flow.driving_pressure > 0
    if np.any(flows & ~np.asarray(crest.primes(range_ends(scene)))):
        return 1.0
    lost = 1 - flow.separated[flows] / flow.siphon[flows]
    return float(np.max(np.maximum(lost, 0.0), initial=0.0))
