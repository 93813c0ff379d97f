"""What a fit asks of a scene, whichever balancer it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.eccentric_parameters import (
    eccentric_parameter,
    eccentric_shifted,
    eccentric_widths,
    fitted_names,
)
from ringbalance.identification.model_errors import MODEL_ERRORS, model_errors, with_model_error
from ringbalance.identification.parameters import FitError, Parameter, scene_parameter
from ringbalance.identification.predict.device import Models, models_of
from ringbalance.identification.predict.kinds import PREDICTED
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.uncertain import (
    NORMAL_95,
    UNCERTAIN_QUANTITIES,
    eccentric_value,
    half_widths,
    nominal_value,
    shifted,
)

_LITTLE: Final = 1e-4
"""Of a quantity, or in SI units where it is zero."""


def models_for(scene: AnyScene) -> Models | None:
    """Models that predictions take; None where there is but one."""
    return models_of(scene) if isinstance(scene, Scene) else None


def parameters_for(scene: AnyScene, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Parameters by name. Raises: FitError: a name that cannot be fitted, or twice the same, or none."""
    if not names or len(set(names)) < len(names):
        raise FitError("name at least one parameter, and each once")
    if isinstance(scene, Scene):
        return tuple(scene_parameter(scene, name) for name in names)
    return tuple(eccentric_parameter(scene, name) for name in names)


def informed(scene: AnyScene, data: Sequence[Observations]) -> list[str]:
    """Parameters that data inform; a prescribed k stands in for the loss that it leaves out."""
    names = dict.fromkeys(name for each in data for name in PREDICTED[each.kind].informs(each))
    prescribed = isinstance(scene, Scene) and scene.tube.drag_coefficient is not None
    return ["drag_coefficient" if prescribed and name == "extra_loss" else name for name in names]


def held_for(scene: AnyScene, fitted: Sequence[str]) -> dict[str, float]:
    """Standard deviation, SI, of every uncertain quantity of the scene that is not fitted, and of what its
    models may be off by."""
    inputs = {name: width / NORMAL_95 for name, width in _widths(scene).items() if name not in fitted}
    return inputs | (dict.fromkeys(model_errors(scene), 1.0) if isinstance(scene, Scene) else {})


def _widths(scene: AnyScene) -> Mapping[str, float]:
    """Expanded uncertainties (95 %), SI."""
    return half_widths(scene) if isinstance(scene, Scene) else eccentric_widths(scene)


def _values(scene: AnyScene) -> dict[str, float]:
    """Value, SI, of every quantity that may be uncertain and that the scene has."""
    if not isinstance(scene, Scene):
        return {name: eccentric_value(scene, name) for name in fitted_names(scene)}
    values = {name: nominal_value(scene=scene, quantity=name) for name in UNCERTAIN_QUANTITIES}
    return {name: value for name, value in values.items() if value is not None}


def both_sides(scene: AnyScene, name: str, change: float) -> tuple[AnyScene, AnyScene]:
    """The scene with one of these lower and higher by a change, SI, as far as a device can have it."""
    # Errors of models are nearly linear, and there are many of them.
    low = scene if name in MODEL_ERRORS else _changed(scene, name, -change)
    return low, _changed(scene, name, change)


def _changed(scene: AnyScene, name: str, change: float) -> AnyScene:
    if not isinstance(scene, Scene):
        return eccentric_shifted(scene, name, change)
    if name in MODEL_ERRORS:
        return with_model_error(scene, name, change)
    return shifted(scene=scene, quantity=name, change=change)


def nearby(scene: AnyScene, name: str) -> AnyScene:
    """The scene with one of its quantities a little lower, or a little above zero."""
    value = _values(scene)[name]
    return _changed(scene, name, -_LITTLE * abs(value) if value else _LITTLE)


def exact_for(scene: AnyScene, fitted: Sequence[str]) -> list[str]:
    """Quantities that are neither fitted nor stated as uncertain."""
    known = {*_widths(scene), *fitted}
    return [name for name in _values(scene) if name not in known]
