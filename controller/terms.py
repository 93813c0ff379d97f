"""What a run models beyond its flow law: the registry's list, and the plant's terms made from it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ringbalance.physics.gas import GasLine
from ringbalance.reduced_model.injection.dynamics import Dynamics, gives_forces
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import (
    FILLING,
    HELD,
    IN_INJECTIONS,
    INERTIA,
    LAG,
    ModelUsed,
    models_used,
)
from ringbalance.scene.models import Scene


def run_models(
    *, scene: Scene, model: BalancerModel, asked: Collection[str] | None = None
) -> tuple[ModelUsed, ...]:
    """Model of every term in a run; under the calibrated law the same list as `calibrate` gives.

    Args: `model`: the balancer; a law that gives no forces can carry no term of an injection. `asked`: names
        of the terms to model instead; None: all.
    Raises: ValueError: a term that is not known, or that the scene or the law gives no numbers for.
    """
    _check(scene, model, asked or ())
    return models_used(scene, law=model.name, obstacles=_obstacles(model), asked=asked)


def terms_modelled(used: Sequence[ModelUsed]) -> tuple[str, ...]:
    """Names of the terms that a run carries beyond its flow law."""
    return tuple(row.term for row in used if row.term in IN_INJECTIONS and row.modelled)


def dynamics_of(
    *,
    scene: Scene,
    model: BalancerModel,
    modelled: Collection[str],
    residual_fill: float = 0.0,
    checked: bool = False,
) -> Dynamics:
    """What moves the liquid: the flow law, and beyond it the modelled terms.

    Args: `residual_fill`: of a driven chamber. `checked`: whether the terms are known to have numbers, as
        for the many scenes of a fit that differ in values alone.
    Raises: ValueError: a term that is not known, or that the scene or the law gives no numbers for.
    """
    if not checked:
        _check(scene, model, modelled)
    return Dynamics.of(
        scene,
        model,
        inertia=INERTIA in modelled,
        line=GasLine.of(scene.gas) if FILLING in modelled else None,
        valve_lag=(scene.gas.valve_lag or 0.0) if LAG in modelled else 0.0,
        lifts=HELD in modelled,
        residual=residual_fill,
    )


def _check(scene: Scene, model: BalancerModel, asked: Collection[str]) -> None:
    for term in asked:
        if term not in IN_INJECTIONS:
            raise ValueError(f"no term {term!r}; there are {', '.join(IN_INJECTIONS)}")
        gas = scene.gas
        unknown = (term == FILLING and gas.conductance is None) or (term == LAG and gas.valve_lag is None)
        no_crest = term == HELD and isinstance(model.flow, PaperLaw)
        if unknown or no_crest or not gives_forces(model.flow):
            raise ValueError(f"{term} cannot be modelled: the scene or the law gives no numbers for it")


def _obstacles(model: BalancerModel) -> dict[str, str]:
    """Why the law cannot carry a term, by term."""
    if not gives_forces(model.flow):
        return dict.fromkeys(IN_INJECTIONS, "this law gives velocities and no forces")
    if isinstance(model.flow, PaperLaw):
        return {
            INERTIA: "the paper's law has no mass in the tube",
            HELD: "the paper's law has no crest",
        }
    return {}
