"""What a fit asks of a scene, whichever balancer it has: parameters, held inputs, errors of its models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.inputs import eccentric_value, eccentric_with
from ringbalance.controller.eccentric_mass.scene_records import (
    ECCENTRIC_MASS,
    EccentricScene,
    eccentric_scene,
)
from ringbalance.identification.data.measurements import Observations
from ringbalance.identification.parameters import FitError, Parameter
from ringbalance.identification.predict.device import Models
from ringbalance.identification.predict.kinds import PREDICTED
from ringbalance.identification.result import FitResult
from ringbalance.physics.tube.uncertainty import BUILT_CAUSES, MODEL_CAUSES
from ringbalance.scene.joint import with_model_error
from ringbalance.scene.model_errors import CAVITY_ERROR, CLEARING_ERROR, START_ERROR
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.uncertain import NORMAL_95, UNCERTAIN_QUANTITIES, half_widths, nominal_value, shifted

_LITTLE: Final = 1e-4
"""Of a quantity, or in SI units where it is zero."""
_REACH: Final = 30.0
"""Factor up to which a value is looked for."""
_OF_FLOW: Final = {
    f"model: {cause}": (cause, 1.0, 0.0) for cause in (START_ERROR, CLEARING_ERROR, CAVITY_ERROR)
}
_OF_LOSS: Final = {
    f"model: {cause}, {part}": (cause, even, 1.0 - even)
    for cause in (*MODEL_CAUSES, *BUILT_CAUSES)
    for part, even in (("even", 1.0), ("odd", 0.0))
}
MODEL_ERRORS: Final = {**_OF_FLOW, **_OF_LOSS}
"""One standard deviation of each error of a scene's models, by name: inputs of a fit, held and uncertain.

Each cause of k's uncertainty is a random function of Re, of two parts (`with_errors`): those of the
correlations, and those of a tube as it was built, which give the shape of k(u) freedom of its own. What
clears the crest and the pressure of the cavity there are known within the spans of
`reduced_model.tube.regime`. The start of the flow has no measurements to compare with: the column's inertia,
a valve that does not open as fast as it closes, and to which side liquid runs that stands on the crest when
the gas is shut, up to half of the tube. The time L/2u in which the flow passes that half is taken for their
expanded uncertainty (95 %).
"""


def models_for(scene: AnyScene) -> Models | None:
    """Models that predictions take; None where there is but one."""
    return Models.of(scene) if isinstance(scene, Scene) else None


def parameters_for(scene: AnyScene, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Parameters by name. Raises: FitError: a name that cannot be fitted, or twice the same, or none."""
    if not names or len(set(names)) < len(names):
        raise FitError("name at least one parameter, and each once")
    if isinstance(scene, Scene):
        return tuple(Parameter.of(scene, name) for name in names)
    return tuple(_eccentric_parameter(eccentric_scene(scene), name) for name in names)


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
    return half_widths(scene) if isinstance(scene, Scene) else _eccentric_widths(eccentric_scene(scene))


def _values(scene: AnyScene) -> dict[str, float]:
    """Value, SI, of every quantity that may be uncertain and that the scene has."""
    if not isinstance(scene, Scene):
        driven = eccentric_scene(scene)
        return {name: eccentric_value(driven, name) for name in _fitted_names(driven)}
    values = {name: nominal_value(scene=scene, quantity=name) for name in UNCERTAIN_QUANTITIES}
    return {name: value for name, value in values.items() if value is not None}


def both_sides(scene: AnyScene, name: str, change: float) -> tuple[AnyScene, AnyScene]:
    """The scene with one of these lower and higher by a change, SI, as far as a device can have it."""
    # Errors of models are nearly linear, and there are many of them.
    low = scene if name in MODEL_ERRORS else changed(scene, name, -change)
    return low, changed(scene, name, change)


def changed(scene: AnyScene, name: str, change: float) -> AnyScene:
    """The scene with one uncertain quantity changed, SI, or an error of a model, in standard deviations."""
    if not isinstance(scene, Scene):
        return _eccentric_shifted(eccentric_scene(scene), name, change)
    if name in MODEL_ERRORS:
        return with_model_error(scene, name, change)
    return shifted(scene=scene, quantity=name, change=change)


def _nearby(scene: AnyScene, name: str) -> AnyScene:
    """The scene with one of its quantities a little lower, or a little above zero."""
    value = _values(scene)[name]
    return changed(scene, name, -_LITTLE * abs(value) if value else _LITTLE)


def _exact_for(scene: AnyScene, fitted: Sequence[str]) -> list[str]:
    """Quantities that are neither fitted nor stated as uncertain."""
    known = {*_widths(scene), *fitted}
    return [name for name in _values(scene) if name not in known]


def exact_inputs(result: FitResult) -> list[str]:
    """Quantities that the predictions depend on, and that are neither fitted nor stated as uncertain."""
    problem, t = result.optimum.residuals.problem, result.optimum.t
    fitted, predicted = [parameter.name for parameter in result.parameters], problem.at(t)
    return [
        name
        for name in _exact_for(problem.scene, fitted)
        if np.any(replace(problem, scene=_nearby(problem.scene, name)).at(t) != predicted)
    ]


def _fitted_names(scene: EccentricScene) -> tuple[str, ...]:
    """All that can be fitted."""
    found: list[str] = []
    for table, content in ECCENTRIC_MASS.tables.items():
        for key in (name for name, declared in content.keys.items() if declared.uncertain):
            value = getattr(getattr(scene, table), key)
            found += (
                [f"{table}.{key}[{i}]" for i in (0, 1)] if isinstance(value, tuple) else [f"{table}.{key}"]
            )
    return tuple(found)


def _eccentric_parameter(scene: EccentricScene, name: str) -> Parameter:
    """A quantity by its path, such as "rotor.damping"; a list's entries by "masses.friction_arm[0]".

    Raises: FitError: no such quantity, or a value that is zero.
    """
    if name not in _fitted_names(scene):
        raise FitError.unknown(name, _fitted_names(scene))
    start, is_angle = eccentric_value(scene, name), name == "imbalance.phase"
    if start <= 0 and not is_angle:
        raise FitError(f"{name} is zero: give a value above zero to fit it")
    width = _eccentric_widths(scene).get(name)
    low, high = (start - math.pi, start + math.pi) if is_angle else (start / _REACH, start * _REACH)
    return Parameter(
        name=name,
        symbol=name,
        start=start,
        lowest=low,
        highest=high,
        prior=width / NORMAL_95 if width else None,
        scale=1.0 if is_angle else None,
        change=partial(eccentric_with, name=name),
    )


def _eccentric_widths(scene: EccentricScene) -> dict[str, float]:
    """Expanded uncertainties (95 %) that the scene states, SI."""
    stated = {each.quantity: each for each in scene.uncertainty}
    widths = {
        name: stated[path].absolute(eccentric_value(scene, name))
        for name in _fitted_names(scene)
        if (path := name.split("[")[0]) in stated
    }
    return {name: width for name, width in widths.items() if width > 0}


def _eccentric_shifted(scene: EccentricScene, name: str, change: float) -> EccentricScene:
    """The scene with one value changed, as far as a machine can have it."""
    value = eccentric_value(scene, name)
    moved = value + change if name == "imbalance.phase" else max(value + change, 0.1 * value)
    return eccentric_with(scene, moved, name=name)


def model_errors(scene: Scene) -> tuple[str, ...]:
    """Names of those that a scene has: a prescribed k has no model."""
    return tuple(MODEL_ERRORS if scene.tube.drag_coefficient is None else _OF_FLOW)
