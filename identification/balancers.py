"""What a fit asks of a balancer: its quantities, their priors, and errors of its models.

One side for each balancer that has kinds of data (`data.kinds`); a further one is one more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final, Protocol

import numpy as np

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.identification.device import Models
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.kinds.registry import KINDS
from ringbalance.identification.parameters import FitError, Parameter
from ringbalance.identification.result import FitResult
from ringbalance.physics.tube.loss import BUILT_CAUSES, MODEL_CAUSES
from ringbalance.scene.fitted import CAVITY_ERROR, CLEARING_ERROR, START_ERROR
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.paths import value_at, with_values_at
from ringbalance.scene.uncertain import (
    NORMAL_95,
    UNCERTAIN_QUANTITIES,
    half_widths,
    nominal_value,
    shifted,
    with_model_error,
)

_LITTLE: Final = 1e-4
"""Of a quantity, or in SI units where it is zero."""
_REACH: Final = 30.0
"""Factor up to which a value is looked for."""
_PHASE: Final = "imbalance.phase"
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


class _Side(Protocol):
    """What a fit asks of the scenes of one balancer."""

    def models(self, scene: Any) -> Models | None:
        """Models that predictions take; None where there is but one."""
        ...

    def instead(self, scene: Any) -> Mapping[str, str]:
        """Names of parameters that stand in for others."""
        ...

    def parameter(self, scene: Any, name: str) -> Parameter:
        """Raises: FitError: a name that cannot be fitted."""
        ...

    def widths(self, scene: Any) -> Mapping[str, float]:
        """Expanded uncertainties (95 %), SI, by name; only those above zero."""
        ...

    def values(self, scene: Any) -> dict[str, float]:
        """Value, SI, of every quantity that may be uncertain and that the scene has."""
        ...

    def moved(self, scene: Any, name: str, change: float) -> SceneFile:
        """The scene with one uncertain quantity changed, SI, as far as a device can have it."""
        ...

    def errors(self, scene: Any) -> tuple[str, ...]:
        """Names of the errors of its models, of `MODEL_ERRORS`."""
        ...


class _LiquidRing:
    def models(self, scene: Scene) -> Models:
        return Models.of(scene)

    def instead(self, scene: Scene) -> Mapping[str, str]:
        """A prescribed k stands in for the loss that it leaves out."""
        return {} if scene.tube.drag_coefficient is None else {"extra_loss": "drag_coefficient"}

    def parameter(self, scene: Scene, name: str) -> Parameter:
        return Parameter.of(scene, name)

    def widths(self, scene: Scene) -> Mapping[str, float]:
        return half_widths(scene)

    def values(self, scene: Scene) -> dict[str, float]:
        values = {name: nominal_value(scene=scene, quantity=name) for name in UNCERTAIN_QUANTITIES}
        return {name: value for name, value in values.items() if value is not None}

    def moved(self, scene: Scene, name: str, change: float) -> Scene:
        return shifted(scene=scene, quantity=name, change=change)

    def errors(self, scene: Scene) -> tuple[str, ...]:
        """A prescribed k has no model."""
        return tuple(MODEL_ERRORS if scene.tube.drag_coefficient is None else _OF_FLOW)


class _EccentricMasses:
    """Quantities go by their paths, such as "rotor.damping" and "masses.friction_arm[0]"."""

    def models(self, _: EccentricScene) -> None:
        return None

    def instead(self, _: EccentricScene) -> Mapping[str, str]:
        return {}

    def parameter(self, scene: EccentricScene, name: str) -> Parameter:
        values, is_angle = self.values(scene), name == _PHASE
        if name not in values:
            raise FitError.unknown(name, tuple(values))
        start = values[name]
        if start <= 0 and not is_angle:
            raise FitError(f"{name} is zero: give a value above zero to fit it")
        width = self.widths(scene).get(name)
        low, high = (start - math.pi, start + math.pi) if is_angle else (start / _REACH, start * _REACH)
        return Parameter(
            name=name,
            symbol=name,
            start=start,
            lowest=low,
            highest=high,
            prior=width / NORMAL_95 if width else None,
            scale=1.0 if is_angle else None,
            change=partial(_with_value, name),
        )

    def widths(self, scene: EccentricScene) -> Mapping[str, float]:
        inputs = balancer_of(scene).inputs()
        return {each.path: each.half_width for each in inputs if each.half_width > 0}

    def values(self, scene: EccentricScene) -> dict[str, float]:
        return {each.path: each.value for each in balancer_of(scene).inputs()}

    def moved(self, scene: EccentricScene, name: str, change: float) -> EccentricScene:
        value = value_at(scene, name)
        moved = value + change if name == _PHASE else max(value + change, 0.1 * value)
        return with_values_at(scene, {name: moved})

    def errors(self, _: EccentricScene) -> tuple[str, ...]:
        return ()


def _with_value(path: str, scene: EccentricScene, value: float) -> EccentricScene:
    return with_values_at(scene, {path: value})


_SIDES: Final[Mapping[str, _Side]] = MappingProxyType(
    {"liquid_ring": _LiquidRing(), "eccentric_mass": _EccentricMasses()}
)


def _side(scene: SceneFile) -> _Side:
    if scene.balancer not in _SIDES:
        raise FitError(f"no kind of data tells of the balancer {scene.balancer}")
    return _SIDES[scene.balancer]


def models_for(scene: SceneFile) -> Models | None:
    """Models that predictions take; None where there is but one."""
    return _side(scene).models(scene)


def parameters_for(scene: SceneFile, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Parameters by name. Raises: FitError: a name that cannot be fitted, or twice the same, or none."""
    if not names or len(set(names)) < len(names):
        raise FitError("name at least one parameter, and each once")
    return tuple(_side(scene).parameter(scene, name) for name in names)


def informed(scene: SceneFile, data: Sequence[Observations]) -> list[str]:
    """Parameters that data inform."""
    names = dict.fromkeys(name for each in data for name in KINDS[each.kind].informs(each))
    instead = _side(scene).instead(scene)
    return [instead.get(name, name) for name in names]


def held_for(scene: SceneFile, fitted: Sequence[str]) -> dict[str, float]:
    """Standard deviation, SI, of every uncertain quantity of the scene that is not fitted, and of what its
    models may be off by."""
    side = _side(scene)
    inputs = {name: width / NORMAL_95 for name, width in side.widths(scene).items() if name not in fitted}
    return inputs | dict.fromkeys(side.errors(scene), 1.0)


def model_errors(scene: SceneFile) -> tuple[str, ...]:
    """Names of the errors of a scene's models, of `MODEL_ERRORS`."""
    return _side(scene).errors(scene)


def value_of(scene: SceneFile, name: str) -> float:
    """Value, SI, of an uncertain quantity that the scene has."""
    return _side(scene).values(scene)[name]


def both_sides(scene: SceneFile, name: str, change: float) -> tuple[SceneFile, SceneFile]:
    """The scene with one of these lower and higher by a change, SI, as far as a device can have it."""
    # Errors of models are nearly linear, and there are many of them.
    low = scene if name in MODEL_ERRORS else changed(scene, name, -change)
    return low, changed(scene, name, change)


def changed(scene: SceneFile, name: str, change: float) -> SceneFile:
    """The scene with one uncertain quantity changed, SI, or an error of a model, in standard deviations."""
    if name in MODEL_ERRORS:
        return with_model_error(liquid_ring_scene(scene), name, change)
    return _side(scene).moved(scene, name, change)


def exact_inputs(result: FitResult) -> list[str]:
    """Quantities that the predictions depend on, and that are neither fitted nor stated as uncertain."""
    problem, t = result.optimum.residuals.problem, result.optimum.t
    scene, predicted = problem.scene, problem.at(t)
    known = {*_side(scene).widths(scene), *(parameter.name for parameter in result.parameters)}
    found = []
    for name, value in _side(scene).values(scene).items():
        nearby = changed(scene, name, -_LITTLE * abs(value) if value else _LITTLE)
        if name not in known and np.any(replace(problem, scene=nearby).at(t) != predicted):
            found.append(name)
    return found
