"""From a scene's words to the control algorithm that they name."""

from __future__ import annotations

from typing import Any

from ringbalance.controller.algorithm import Controller
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.target_vector import TargetVector
from ringbalance.controller.trial import Trial
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene


def controller_of(scene: Scene) -> Controller[Any]:
    """The control algorithm that a scene asks for.

    Args:
        scene: the scene.

    Returns:
        Controller, with the scene's settings.

    Raises:
        SceneError: an algorithm that this program does not have.
    """
    kind = scene.controller.kind
    if kind == "target_vector":
        return target_vector_of(scene)
    if kind == "trial":
        return trial_of(scene)
    fault = scene_fault(
        scene=scene,
        table="controller",
        key="kind",
        problem="this version does not simulate this algorithm",
        allowed='"target_vector", "trial"',
    )
    raise SceneError([fault])


def target_vector_of(scene: Scene) -> TargetVector:
    """The target-vector algorithm with a scene's settings.

    Args:
        scene: the scene.

    Returns:
        TargetVector.
    """
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
    )


def trial_of(scene: Scene) -> Trial:
    """The one-by-one trial algorithm with a scene's settings.

    Args:
        scene: the scene.

    Returns:
        Trial.
    """
    settings, letters = scene.controller, chamber_letters(scene.disc.chambers)
    return Trial(
        sequence=tuple(letters.index(letter) for letter in settings.sequence),
        limit=settings.limit,
        first_trial=settings.first_trial,
        long_step=settings.long_step,
        short_step=settings.short_step,
        fine_below=settings.fine_below,
        minimum_gas_time=settings.minimum_gas_time,
        maximum_gas_time=settings.maximum_gas_time,
    )
