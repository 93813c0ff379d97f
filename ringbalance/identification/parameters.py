"""Parameters of a fit: quantities of a scene, each on a scale with a nearly linear effect.

Positive quantities are fitted by their logarithm, ln x.  A loss coefficient acts through k + 1, so it is
fitted by ln g (x + c): c = 1 for a prescribed k; for an extra loss such that it is ln(k + 1) to first order.
Angles, positions and the pressure of the cavity are linear.  The prior of a parameter is the scene's
[uncertainty]: a normal distribution of the quantity itself, of standard deviation U/1.96, which enters each
fit once.  Without a stated uncertainty of the lambda factor its prior follows from the geometry: moments are
hydrostatics of a known chamber.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Input, balancer_of
from ringbalance.identification.device import ModelledDevice, Models
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS
from ringbalance.mesh.faceting import drawing_shares
from ringbalance.reduced_model.tube.regime import driving_pressure
from ringbalance.scene.errors import Uncertainty, model_uncertainties, with_places
from ringbalance.scene.faults import did_you_mean
from ringbalance.scene.fitted import CREST_ERROR, MODEL
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import SceneFile, with_values_at
from ringbalance.scene.uncertain import (
    NORMAL_95,
    SHAPE,
    UNCERTAIN_QUANTITIES,
    half_widths,
    moved,
    nominal_value,
    with_value,
)


class FitError(ValueError):
    """Fit that is not possible; the text gives the reason and the remedy."""

    @classmethod
    def unknown(cls, name: str, allowed: Sequence[str]) -> FitError:
        """Error for a name that cannot be fitted."""
        hint = did_you_mean(name, allowed)
        return cls(f'"{name}" cannot be fitted{hint}; allowed: {", ".join(allowed)}')


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One quantity that is fitted, t = ln gain (x + offset) or t = x/scale."""

    name: str
    symbol: str
    """Symbol in a combination, such as "(k + 1)"."""
    start: float
    """Value of the scene, SI."""
    lowest: float
    """Lower bound, SI."""
    highest: float
    prior: float | None
    """Standard deviation of the prior, SI; None: no prior."""
    by_geometry: bool = False
    """True if the prior follows from the geometry, without a statement in the scene."""
    offset: float = 0.0
    """c of ln g (x + c), SI."""
    gain: float = 1.0
    """g of ln g (x + c)."""
    scale: float | None = None
    """Scale of a linear parameter, SI; None: logarithmic."""
    change: Callable[[Any, float], Any]
    """Function from a scene and a value, SI, to the scene with that value."""

    def inner(self, value: float) -> float:
        """t of a value, SI."""
        return math.log(self.gain * (value + self.offset)) if self.scale is None else value / self.scale

    def value(self, inner: float) -> float:
        """Value, SI, of t."""
        return math.exp(inner) / self.gain - self.offset if self.scale is None else inner * self.scale

    def slope(self, inner: float) -> float:
        """dx/dt."""
        return math.exp(inner) / self.gain if self.scale is None else self.scale

    @classmethod
    def of(cls, scene: Scene, name: str) -> Parameter:
        """Quantity of a liquid-ring scene as a parameter.

        Raises: FitError: no such quantity, or no value in the scene to start from.
        """
        if name in START:
            # No prior for the vibration without trial weight.
            start, is_angle = float(getattr(scene.rotor, name)), name == "initial_phase"
            ends = (
                (start - math.pi, start + math.pi)
                if is_angle
                else (start / _AMPLITUDE_FACTOR, start * _AMPLITUDE_FACTOR)
            )
            return cls(
                name=name,
                symbol=name,
                start=start,
                lowest=ends[0],
                highest=ends[1],
                prior=None,
                scale=1.0 if is_angle else None,
                change=partial(_with_start, name),
            )
        if name not in UNCERTAIN_QUANTITIES:
            raise FitError.unknown(name, sorted((*UNCERTAIN_QUANTITIES, *START)))
        path, disc = path_of(name), scene.disc
        if disc.geometry is not None and name in SHAPE:
            raise FitError(f"{name} follows from the mesh of the chamber; fit lambda_factor in its place")
        value = nominal_value(scene=scene, quantity=name)
        if value is None and name == "lambda_factor":
            value = 1.0
        if value is None:
            raise FitError(f"the scene has no {path}: give a value to start from to fit it")
        width, by_geometry = half_widths(scene).get(name), False
        if width is None and name == "lambda_factor":
            # A mesh adds the error of its facets.
            facets = drawing_shares(disc, np.array([disc.initial_fill])).moment
            width, by_geometry = value * math.hypot(_GEOMETRY, float(facets[0])), True
        (offset, gain), ambient = _loss_scale(scene, name), scene.gas.ambient_pressure
        linear = {"lag_angle": 1.0, "hump_position": 1.0}
        scale = (linear | {"vapour_pressure": ambient, "ambient_pressure": ambient}).get(name)
        if offset == 0 and scale is None and value <= 0:
            raise FitError(f"{path} is zero: give a value above zero to fit it")
        low, high = _range(scene, name, value, offset)
        return cls(
            name=name,
            symbol=_SYMBOLS.get(name, name),
            start=value,
            lowest=low,
            highest=high,
            prior=None if width is None else width / NORMAL_95,
            by_geometry=by_geometry,
            offset=offset,
            gain=gain,
            scale=scale,
            change=partial(_with_quantity, name),
        )


_SYMBOLS: Final = {
    "lambda_factor": "lambda",
    "drag_coefficient": "(k + 1)",
    "extra_loss": "(k + 1)",
    "influence_coefficient": "kappa",
}
_REACH: Final = {"bore": 3.0, "outer_radius": 1.1, "inner_radius": 1.1, "central_angle": 1.1, "speed": 1.1}
"""Largest factor between a logarithmic parameter and its start."""
_RANGE_FACTOR: Final = 30.0
_ANGLE: Final = "rad"
_AMPLITUDE_FACTOR: Final = 1000.0
"""Largest factor between the amplitude of a vibration and its start."""
START: Final = ("initial_amplitude", "initial_phase")
"""Parameters of the measurement, not of the device."""
_LOSS_STEP: Final = 0.01
_GEOMETRY: Final = 0.05
"""Relative expanded uncertainty (95 %) of lambda from exact dimensions.

It covers fillets, ports and plates without a key, liquid in the legs of the tube, and gravity, 0.1 % by
`calibrate` for the bundled discs. Tolerances of the dimensions are separate inputs, included in all
intervals.
"""


def _with_quantity(name: str, scene: Scene, value: float) -> Scene:
    return with_value(scene=scene, quantity=name, value=value)


def _with_start(name: str, scene: Scene, value: float) -> Scene:
    return replace(scene, rotor=replace(scene.rotor, **{name: value}))


def _loss_scale(scene: Scene, name: str) -> tuple[float, float]:
    """Offset and gain of a loss coefficient, so that t is ln(k + 1) at equal fills under the scene's gas.

    k + 1 = 2 H/u^2 by definition, whatever the regime: d ln(k + 1) = -2 d ln u.
    """
    if name == "drag_coefficient":
        return 1.0, 1.0
    if name != "extra_loss":
        return 0.0, 1.0
    loss = scene.tube.extra_loss
    speeds = [
        Models.of(with_value(scene=scene, quantity=name, value=loss + step)).velocity
        for step in (0.0, _LOSS_STEP)
    ]
    if speeds[1] <= 0 or speeds[0] <= speeds[1]:
        return 1.0, 1.0
    apart = _LOSS_STEP / (-2 * math.log(speeds[1] / speeds[0]))
    fill, law = scene.disc.initial_fill, ModelledDevice.of(scene, Models.of(scene)).law
    ends = law.ends(fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=scene.gas.pressure)
    head = float(driving_pressure(law.path, ends)) / scene.liquid.density
    return apart - loss, head * 2 / speeds[0] ** 2 / apart


def _range(scene: Scene, name: str, start: float, offset: float) -> tuple[float, float]:
    """Lower and upper bound, SI, by the rules of the scene or by a factor on the start."""
    tube, disc, ambient = scene.tube, scene.disc, scene.gas.ambient_pressure
    fixed = {
        "lag_angle": (start - math.pi, start + math.pi),
        "hump_position": (0.02, 0.98),
        "vapour_pressure": (0.0, ambient),
        "ambient_pressure": (0.5 * ambient, 2 * ambient),
        "extra_loss": (0.0, _RANGE_FACTOR * (offset + start)),
        "drag_coefficient": (1e-3, _RANGE_FACTOR * (offset + start)),
        "hump_radius": (0.5 * start, tube.port_radius),
        "port_radius": (tube.hump_radius or 0.5 * start, disc.outer_radius),
        "length": (max(0.2 * start, sum(b.angle * b.radius for b in tube.bends)), 5 * start),
        "critical_ratio": (0.02, 0.98),
        "roughness": (start / _RANGE_FACTOR, min(_RANGE_FACTOR * start, 0.04 * tube.bore)),
        "plate_thickness": (start / 3, 2 * start),
    }
    if name in fixed:
        return fixed[name]
    reach = _REACH.get(name, _RANGE_FACTOR)
    return start / reach, start * reach


class _SceneInputs:
    """Quantities of a scene that a fit may vary, from its `Balancer`, by path, such as "rotor.damping" and
    "masses.friction_arm[0]"."""

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    @cached_property
    def inputs(self) -> Mapping[str, Input]:
        """Quantities of the scene that may be uncertain, by name."""
        return {each.path: each for each in balancer_of(self.scene).inputs()}

    @property
    def models(self) -> Models | None:
        """Models for predictions; None if there is no choice of models."""
        return None

    @cached_property
    def errors(self) -> Mapping[str, Uncertainty]:
        """Model errors of the built device, by name."""
        return {}

    def named(self, name: str) -> Sequence[str]:
        """Names in this scene of a quantity that a kind of data informs, given by its liquid-ring name."""
        return [path for path in self.inputs if name in (path, path.rpartition(".")[2])]

    def parameter(self, name: str) -> Parameter:
        """Parameter by name. Raises: FitError: a name that cannot be fitted."""
        if name not in self.inputs:
            raise FitError.unknown(name, tuple(self.inputs))
        quantity = self.inputs[name]
        start, is_angle = quantity.value, quantity.unit == _ANGLE
        if start <= 0 and not is_angle:
            raise FitError(f"{name} is zero: give a value above zero to fit it")
        return Parameter(
            name=name,
            symbol=name,
            start=start,
            lowest=start - math.pi if is_angle else start / _RANGE_FACTOR,
            highest=start + math.pi if is_angle else start * _RANGE_FACTOR,
            prior=quantity.half_width / NORMAL_95 or None,
            scale=1.0 if is_angle else None,
            change=lambda scene, value: with_values_at(scene, {name: value}),
        )

    def parameters(self, names: Sequence[str]) -> tuple[Parameter, ...]:
        """Parameters by name. Raises: FitError: no name, a repeated one, or one that cannot be fitted."""
        if not names or len(set(names)) < len(names):
            raise FitError("name at least one parameter, and each once")
        return tuple(self.parameter(name) for name in names)

    def informed(self, data: Sequence[Observations]) -> list[str]:
        """Names of the parameters that data inform."""
        names = (name for each in data for name in KINDS[each.kind].informs(each))
        return list(dict.fromkeys(path for name in names for path in self.named(name)))

    def held(self, fitted: Sequence[str]) -> dict[str, float]:
        """Standard deviation of every uncertain quantity that is not fitted, SI, and of model errors, 1."""
        widths = {n: each.half_width / NORMAL_95 for n, each in self.inputs.items() if n not in fitted}
        return {name: sd for name, sd in widths.items() if sd} | dict.fromkeys(self.errors, 1.0)

    def changed(self, name: str, change: float) -> SceneFile:
        """Scene with one uncertain quantity changed, within physical limits.

        Args: `change`: SI; for a model error, in its standard deviations.
        """
        quantity = self.inputs[name]
        lowest = -math.inf if quantity.unit == _ANGLE else 0.1 * quantity.value
        moved: SceneFile = with_values_at(self.scene, {name: max(quantity.value + change, lowest)})
        return moved

    def both_sides(self, name: str, change: float) -> tuple[SceneFile, SceneFile]:
        """Scene with one quantity lower, or unchanged if one side suffices, and higher by a change."""
        return self.changed(name, -change), self.changed(name, change)


class _LiquidRingInputs(_SceneInputs):
    """Quantities of a liquid-ring scene by key, such as "bore"."""

    scene: Scene

    @cached_property
    def inputs(self) -> Mapping[str, Input]:
        by_key = {key: each for path, each in super().inputs.items() if (key := path.partition(".")[2])}
        # A mesh has no plates, and some of its dimensions cannot be changed.
        return {
            key: by_key[key] for key in by_key if nominal_value(scene=self.scene, quantity=key) is not None
        }

    @property
    def models(self) -> Models:
        return Models.of(self.scene)

    @cached_property
    def errors(self) -> Mapping[str, Uncertainty]:
        return {each.name: each for each in model_uncertainties(self.scene, built=True)}

    def named(self, name: str) -> Sequence[str]:
        """Name in the scene: a prescribed k replaces the extra loss."""
        prescribed = self.scene.tube.drag_coefficient is not None
        return ["drag_coefficient" if prescribed and name == "extra_loss" else name]

    def parameter(self, name: str) -> Parameter:
        return Parameter.of(self.scene, name)

    def changed(self, name: str, change: float) -> SceneFile:
        if name in self.errors:
            return self.errors[name].moved(self.scene, change)
        return moved(self.scene, {name: change})

    def both_sides(self, name: str, change: float) -> tuple[SceneFile, SceneFile]:
        error = self.errors.get(name)
        # Model errors are many and nearly linear: one side suffices, except for the arc at the crest.
        if error is None or error.group == f"{MODEL}{CREST_ERROR}":
            return super().both_sides(name, change)
        # All have the places of all, so that they differ in numbers alone.
        return self.scene, error.moved(with_places(self.scene, self.errors.values()), change)


_INPUTS: Final[Mapping[str, type[_SceneInputs]]] = {Scene.balancer: _LiquidRingInputs}
"""Class by name of the balancer; `_SceneInputs` for all others."""


def inputs_of(scene: SceneFile) -> _SceneInputs:
    """Quantities of a scene that a fit may vary."""
    return _INPUTS.get(scene.balancer, _SceneInputs)(scene)


def path_of(name: str) -> str:
    """Path in the scene of a parameter, such as "tube.bore" of "bore"; names that are paths are unchanged."""
    table = UNCERTAIN_QUANTITIES.get(name)
    return name if table is None else f"{table}.{name}"
