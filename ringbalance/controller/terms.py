"""Composition of a run: the terms that it models, and checks that scene and balancer can be run at all."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.gas import GasLine
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.injection.dynamics import Dynamics, gives_forces
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import FILLING, HELD, IN_INJECTIONS, INERTIA, LAG, ModelUsed, models_used
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene

VOLUME_TOLERANCE: Final = 0.05
"""Relative tolerance of a chamber's volume: a flat-strip formula and an input's uncertainty stay within it,
another disc does not."""


def run_models(
    *, scene: Scene, model: BalancerModel, terms: Collection[str] | None = None
) -> tuple[ModelUsed, ...]:
    """Model of every term in a run; under the calibrated law the same list as `calibrate` gives.

    Args: `model`: the balancer; a law that gives no forces can carry no term of an injection. `terms`: names
        of those to model; None: all.
    Raises: ValueError: a term that is not known, or that the scene or the law gives no numbers for.
    """
    _check(scene, model, terms or ())
    return models_used(scene, law=model.name, obstacles=_obstacles(model), selected=terms)


def terms_modelled(used: Sequence[ModelUsed]) -> tuple[str, ...]:
    """Names of the terms that a run carries beyond its flow law."""
    return tuple(row.term for row in used if row.term in IN_INJECTIONS and row.modelled)


def run_terms(*, scene: Scene, model: BalancerModel) -> tuple[str, ...]:
    """Names of the terms that runs of a scene model, without estimates for chamber and tube."""
    used = models_used(scene, law=model.name, obstacles=_obstacles(model), injections_only=True)
    return terms_modelled(used)


def dynamics_of(
    *,
    scene: Scene,
    model: BalancerModel,
    modelled: Collection[str],
    residual_fill: float = 0.0,
    checked: bool = False,
) -> Dynamics:
    """Dynamics that move the liquid: the flow law, and beyond it the modelled terms.

    Args: `residual_fill`: of a driven chamber. `checked`: true if the terms are known to have numbers, as
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


def _check(scene: Scene, model: BalancerModel, terms: Collection[str]) -> None:
    for term in terms:
        if term not in IN_INJECTIONS:
            raise ValueError(f"no term {term!r}; there are {', '.join(IN_INJECTIONS)}")
        gas = scene.gas
        unknown = (term == FILLING and gas.conductance is None) or (term == LAG and gas.valve_lag is None)
        no_crest = term == HELD and isinstance(model.flow, PaperLaw)
        if unknown or no_crest or not gives_forces(model.flow):
            raise ValueError(f"{term} cannot be modelled: the scene or the law gives no numbers for it")


def _obstacles(model: BalancerModel) -> dict[str, str]:
    """Reasons for which the law cannot carry a term, by term."""
    if not gives_forces(model.flow):
        return dict.fromkeys(IN_INJECTIONS, "this law gives velocities and no forces")
    if isinstance(model.flow, PaperLaw):
        return {
            INERTIA: "the paper's law has no mass in the tube",
            HELD: "the paper's law has no crest",
        }
    return {}


def check_fit(scene: Scene, model: BalancerModel) -> None:
    """Refuse a model that was made for another disc.

    Raises: SceneError: largest fill or chamber volume of the scene and of the model do not agree.
    """
    faults: list[Fault] = []
    largest = model.flow.max_fill_ratio
    if abs(scene.disc.max_fill_ratio - largest) > 1e-9:
        problem = f"the {model.name} law was made for another fill"
        faults.append(scene_fault(scene, "disc.max_fill_ratio", problem=problem, allowed=f"{largest:.6g}"))
    # Eq. 4 omits rib, fillet and gas tube of an imported chamber, which can be a large part of it.
    by_paper = isinstance(model.flow, PaperLaw) and scene.disc.geometry is not None
    volume = (paper.chamber_volume_paper if by_paper else chamber_volume)(disc=scene.disc)
    if abs(model.chamber_volume / volume - 1) > VOLUME_TOLERANCE:
        problem = (
            f"a chamber holds {volume * 1e6:.4g} ml here, {model.chamber_volume * 1e6:.4g} ml for the "
            f"{model.name} law: that was made for another disc"
        )
        allowed = "that disc, or a law made for this one"
        faults.append(scene_fault(scene, "disc.axial_width", problem=problem, allowed=allowed))
    if faults:
        raise SceneError(faults)


def least_period(scene: Scene, model: BalancerModel) -> float:
    """Wait, s, in which an injection dies out, at equal fills: lag and time to vent a chamber.

    After a shorter one gas of the injection before still pushes as the next begins, and liquid runs back.
    """
    line, lag = GasLine.of(scene.gas), scene.gas.valve_lag or 0.0
    if line is None:
        return lag
    volume = (1.0 - scene.disc.initial_fill) * model.chamber_volume + (scene.gas.dead_volume or 0.0)
    return lag + float(line.venting_time(line.supply_pressure, volume=volume))


def dead_time(scene: Scene, model: BalancerModel, *, rate: float) -> float:
    """Dead time, s, at equal fills of an injection that corrects an amplitude at the limit.

    Gas fills the chamber and the liquid rises over the crest; at least the valve's lag and its shortest
    opening.
    """
    modelled, total = run_terms(scene=scene, model=model), 2 * scene.disc.initial_fill
    least = max(scene.gas.valve_lag or 0.0, scene.controller.minimum_gas_time)
    if not modelled or rate <= 0.0:
        return least
    dynamics = dynamics_of(scene=scene, model=model, modelled=modelled, checked=True)
    injections = Injections.of(dynamics, model, fill=scene.disc.initial_fill, total=total)
    lost = injections.dead_time(scene.controller.limit / rate * injections.steady)
    return max(lost or 0.0, least)
