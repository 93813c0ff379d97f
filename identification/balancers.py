"""What a fit asks of a scene, whichever balancer it has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ringbalance.identification import eccentric_parameters as eccentric
from ringbalance.identification import parameters as ring
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.model_errors import MODEL_ERRORS, model_errors, with_model_error
from ringbalance.identification.parameters import Parameter
from ringbalance.identification.predict.device import Models, models_of
from ringbalance.identification.predict.kinds import PREDICTED
from ringbalance.reduced_model.chamber.inputs import half_widths, shifted
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, eccentric_value, nominal_value

_LITTLE: Final = 1e-4
"""Of a quantity, or in SI units where it is zero."""


def models_for(scene: AnyScene) -> Models | None:
    """Models that predictions take; None where there is but one."""
    return models_of(scene) if isinstance(scene, Scene) else None


def parameters_for(scene: AnyScene, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Parameters by name. Raises: FitError: a name that cannot be fitted, or twice the same, or none."""
    if isinstance(scene, Scene):
        return ring.scene_parameters(scene, names)
    return eccentric.eccentric_parameters(scene, names)


def informed(scene: AnyScene, data: Sequence[Observations]) -> list[str]:
    """Parameters that data inform; a prescribed k stands in for the loss that it leaves out."""
    names = dict.fromkeys(name for each in data for name in PREDICTED[each.kind].informs(each))
    prescribed = isinstance(scene, Scene) and scene.tube.drag_coefficient is not None
    return ["drag_coefficient" if prescribed and name == "extra_loss" else name for name in names]


def held_for(scene: AnyScene, fitted: Sequence[str]) -> dict[str, float]:
    """Standard deviation, SI, of every uncertain quantity of the scene that is not fitted, and of what its
    models may be off by."""
    if isinstance(scene, Scene):
        return {**ring.held_inputs(scene, fitted), **dict.fromkeys(model_errors(scene), 1.0)}
    return eccentric.eccentric_held(scene, fitted)


def both_sides(scene: AnyScene, name: str, change: float) -> tuple[AnyScene, AnyScene]:
    """The scene with one of these lower and higher by a change, SI, as far as a device can have it."""
    low, high = (_changed(scene, name, side * change) for side in (-1, 1))
    return low, high


def _changed(scene: AnyScene, name: str, change: float) -> AnyScene:
    if not isinstance(scene, Scene):
        return eccentric.eccentric_shifted(scene, name, change)
    if name in MODEL_ERRORS:
        return with_model_error(scene, name, change)
    return shifted(scene=scene, quantity=name, change=change)


def nearby(scene: AnyScene, name: str) -> AnyScene:
    """The scene with one of its quantities a little lower, or a little above zero."""
    if isinstance(scene, Scene):
        value = nominal_value(scene=scene, quantity=name)
    else:
        value = eccentric_value(scene, name)
    return both_sides(scene, name, _LITTLE * abs(value) if value else -_LITTLE)[0]


def exact_for(scene: AnyScene, fitted: Sequence[str]) -> list[str]:
    """Quantities that are neither fitted nor stated as uncertain."""
    if not isinstance(scene, Scene):
        known = {*eccentric.eccentric_held(scene, fitted), *fitted}
        return [name for name in eccentric.fitted_names(scene) if name not in known]
    known = {*half_widths(scene), *fitted}
    return [
        name
        for name in UNCERTAIN_QUANTITIES
        if name not in known and nominal_value(scene=scene, quantity=name) is not None
    ]
