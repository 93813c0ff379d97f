"""From a scene's words to the control algorithm that they name."""

from __future__ import annotations

from dataclasses import replace

from ringbalance.controller.algorithms.built_in import BuiltIn, TargetVector, Trial
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.liquid_ring.plant import LiquidRing
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.injection.dynamics import RELATIVE_ERROR
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.models import Scene


def controller_of(
    scene: Scene, model: BalancerModel | None = None, *, relative_error: float = RELATIVE_ERROR
) -> BuiltIn:
    """The control algorithm that a scene asks for; `model` is the balancer as the law-based one assumes it.

    Args: `relative_error`: that one allows to a step of the liquid that it follows.
    Raises: ValueError: the law-based algorithm without a model.
    """
    kind = scene.controller.kind
    if kind == "target_vector":
        return target_vector_of(scene)
    if kind == "trial":
        return _trial_of(scene)
    if model is None:
        raise ValueError("the law-based algorithm needs a model, such as calibrate(scene).model")
    return law_based_of(scene, model, relative_error=relative_error)


def target_vector_of(scene: Scene) -> TargetVector:
    """The target-vector algorithm with a scene's settings."""
    settings = scene.controller
    return TargetVector(
        chambers=scene.disc.chambers,
        lag_angle=settings.assumed_lag_angle,
        limit=settings.limit,
        proportional=settings.proportional,
        integral_time=settings.integral_time,
        derivative_time=settings.derivative_time,
        minimum_gas_time=settings.minimum_gas_time,
        maximum_gas_time=settings.maximum_gas_time,
        offsets=settings.offsets(scene.disc.chambers),
    )


def _trial_of(scene: Scene) -> Trial:
    """The one-by-one trial algorithm with a scene's settings."""
    settings, letters = scene.controller, chamber_letters(scene.disc.chambers)
    return Trial(
        chambers=scene.disc.chambers,
        sequence=tuple(letters.index(letter) for letter in settings.sequence),
        limit=settings.limit,
        first_trial=settings.first_trial,
        long_step=settings.long_step,
        short_step=settings.short_step,
        fine_below=settings.fine_below,
        minimum_gas_time=settings.minimum_gas_time,
        maximum_gas_time=settings.maximum_gas_time,
    )


def law_based_of(scene: Scene, model: BalancerModel, *, relative_error: float = RELATIVE_ERROR) -> LawBased:
    """The law-based algorithm with a scene's settings; its model need not be the one that is controlled."""
    settings = scene.controller
    dynamics = dynamics_of(
        scene=scene,
        model=model,
        modelled=(),
        residual_fill=residual_fill_ratio(scene, law=model.flow),
    )
    return LawBased(
        ring=LiquidRing(
            model=model,
            chambers=scene.disc.chambers,
            total=2 * scene.disc.initial_fill,
            dynamics=replace(dynamics, relative_error=relative_error),
        ),
        influence=settings.assumed_influence,
        limit=settings.limit,
        amplitude_noise=scene.sensor.amplitude_noise,
        phase_noise=scene.sensor.phase_noise,
        probe=settings.period,
        minimum_gas_time=settings.minimum_gas_time,
        maximum_gas_time=settings.maximum_gas_time,
        offsets=settings.offsets(scene.disc.chambers),
    )
