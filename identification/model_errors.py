"""Errors of a scene's models, as inputs of a fit that are held and uncertain.

Each cause of k's uncertainty is a random function of Re, of two parts (`with_errors`).  What clears the crest
and the pressure of the cavity there are known within the spans of `reduced_model.tube.regime`.  The start of
the flow has no measurements to compare with: the column's inertia, a valve that does not open as fast as it
closes, and to which side liquid runs that stands on the crest when the gas is shut, up to half of the tube.
The time L/2u in which the flow passes that half is taken for their expanded uncertainty (95 %).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from ringbalance.physics.tube.uncertainty import MODEL_CAUSES
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import CAVITY_ERROR, CLEARING_ERROR, START_ERROR

_OF_FLOW: Final = {
    f"model: {cause}": (cause, 1.0, 0.0) for cause in (START_ERROR, CLEARING_ERROR, CAVITY_ERROR)
}
_OF_LOSS: Final = {
    f"model: {cause}, {part}": (cause, even, 1.0 - even)
    for cause in MODEL_CAUSES
    for part, even in (("even", 1.0), ("odd", 0.0))
}
MODEL_ERRORS: Final = {**_OF_FLOW, **_OF_LOSS}
"""One standard deviation of each, by name."""


def model_errors(scene: Scene) -> tuple[str, ...]:
    """Names of those that a scene has: a prescribed k has no model."""
    return tuple(MODEL_ERRORS if scene.tube.drag_coefficient is None else _OF_FLOW)


def with_model_error(scene: Scene, name: str, change: float) -> Scene:
    """The scene with one error of its models larger. Args: `change`: in standard deviations."""
    cause, even, odd = MODEL_ERRORS[name]
    models = scene.tube.models
    errors = (*models.errors, (cause, change * even, change * odd))
    return replace(scene, tube=replace(scene.tube, models=replace(models, errors=errors)))


def causes(names: Iterable[str]) -> list[str]:
    """Causes of the errors of models among the names of inputs."""
    return list(dict.fromkeys(MODEL_ERRORS[name][0] for name in names if name in MODEL_ERRORS))
