"""From a scene's words to the control algorithm that they name."""

from __future__ import annotations

from ringbalance.controller.algorithms.built_in import BuiltIn, TargetVector, Trial
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.reduced_model.injection.dynamics import RELATIVE_ERROR
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene


def controller_of(scene: Scene, model: BalancerModel, *, relative_error: float = RELATIVE_ERROR) -> BuiltIn:
    """The control algorithm that a scene asks for. Args: as `LawBased.of`, for that alone."""
    kind = scene.controller.kind
    if kind == "law_based":
        return LawBased.of(scene, model, relative_error=relative_error)
    return TargetVector.of(scene) if kind == "target_vector" else Trial.of(scene)
