"""Parameters of a fit: quantities of a scene, each on a scale on which its effect is nearly linear.

Positive quantities are fitted by their logarithm, ln x.  A loss coefficient acts through k + 1, so it is
fitted by ln g (x + c): c = 1 for a prescribed k; for an extra loss such that it is ln(k + 1) to first order.
Angles, positions and the pressure of the cavity are linear.  The prior of a parameter is the scene's
[uncertainty]: a normal distribution of the quantity itself, of standard deviation U/1.96, which enters each
fit once.  Where the scene states none of the factor on lambda, it is what the geometry tells: moments are
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
from ringbalance.reduced_model.chamber.values import drawing_shares
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
    nominal_value,
    shifted,
    with_value,
)


class FitError(ValueError):
    """A fit that cannot be made; the text says why, and what to change."""

    @classmethod
    def unknown(cls, name: str, allowed: Sequence[str]) -> FitError:
        """The error for a name that cannot be fitted."""
        hint = did_you_mean(name, allowed)
        return cls(f'"{name}" cannot be fitted{hint}; allowed: {", ".join(allowed)}')


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One quantity that is fitted, t = ln(x + offset) or t = x/scale."""

    name: str
    symbol: str
    """In a combination, such as "(k + 1)"."""
    start: float
    """Value of the scene, SI."""
    lowest: float
    """SI."""
    highest: float
    prior: float | None
    """Standard deviation, SI, of what is known beforehand; None: nothing is."""
    by_geometry: bool = False
    """True where that follows from the geometry, and the scene states nothing."""
    offset: float = 0.0
    """c of ln(x + c), SI."""
    gain: float = 1.0
    """g of ln g (x + c)."""
    scale: float | None = None
    """Scale of a linear parameter, SI; None: logarithmic."""
    change: Callable[[Any, float], Any]
    """The scene with another value."""

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
        """A quantity of a liquid-ring scene as a parameter.

        Raises: FitError: no such quantity, or one that the scene gives no value to start from.
        """
        if name in START:
            # Of the vibration without trial weight nothing is known beforehand.
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
            # That of a mesh has facets, too.
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
"""Factor up to which a logarithmic parameter is looked for."""
_RANGE_FACTOR: Final = 30.0
_ANGLE: Final = "rad"
_AMPLITUDE_FACTOR: Final = 1000.0
"""Factor up to which the amplitude of a vibration is looked for."""
START: Final = ("initial_amplitude", "initial_phase")
"""Parameters that belong to the measurement and not to the device."""
_LOSS_STEP: Final = 0.01
_GEOMETRY: Final = 0.05
"""Relative expanded uncertainty (95 %) of lambda by a geometry of exact dimensions: fillets, ports and plates
that no key has, liquid in the legs of the tube, and gravity, which `calibrate` puts at 0.1 % for the bundled
discs. Tolerances of the dimensions are inputs of their own, and in all intervals."""


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
    """Smallest and largest value that the scene's rules allow, or within reach of the start."""
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
    """Quantities of a scene that a fit may move, through its `Balancer`, by their paths, such as
    "rotor.damping" and "masses.friction_arm[0]"."""

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    @cached_property
    def inputs(self) -> Mapping[str, Input]:
        """Quantities that may be uncertain and that the scene has, by name."""
        return {each.path: each for each in balancer_of(self.scene).inputs()}

    @property
    def models(self) -> Models | None:
        """Models that predictions take; None where there is but one."""
        return None

    @cached_property
    def errors(self) -> Mapping[str, Uncertainty]:
        """Errors of the models of what was built, by name."""
        return {}

    def named(self, name: str) -> Sequence[str]:
        """Its own names of what kinds of data inform, as the liquid ring names that."""
        return [path for path in self.inputs if name in (path, path.rpartition(".")[2])]

    def parameter(self, name: str) -> Parameter:
        """Raises: FitError: a name that cannot be fitted."""
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
        """Parameters by name. Raises: FitError: a name that cannot be fitted, or twice the same, or none."""
        if not names or len(set(names)) < len(names):
            raise FitError("name at least one parameter, and each once")
        return tuple(self.parameter(name) for name in names)

    def informed(self, data: Sequence[Observations]) -> list[str]:
        """Parameters that data inform."""
        names = (name for each in data for name in KINDS[each.kind].informs(each))
        return list(dict.fromkeys(path for name in names for path in self.named(name)))

    def held(self, fitted: Sequence[str]) -> dict[str, float]:
        """Standard deviation, SI, of every uncertain quantity that is not fitted, and of what models may be
        off by."""
        widths = {n: each.half_width / NORMAL_95 for n, each in self.inputs.items() if n not in fitted}
        return {name: sd for name, sd in widths.items() if sd} | dict.fromkeys(self.errors, 1.0)

    def changed(self, name: str, change: float) -> SceneFile:
        """The scene with one uncertain quantity changed, SI, as far as a device can have it.

        Of a model's error in its standard deviations.
        """
        quantity = self.inputs[name]
        lowest = -math.inf if quantity.unit == _ANGLE else 0.1 * quantity.value
        moved: SceneFile = with_values_at(self.scene, {name: max(quantity.value + change, lowest)})
        return moved

    def both_sides(self, name: str, change: float) -> tuple[SceneFile, SceneFile]:
        """The scene with one of these lower and higher by a change; or as it is, where one side will do."""
        return self.changed(name, -change), self.changed(name, change)


class _LiquidRingInputs(_SceneInputs):
    """Quantities go by their keys, such as "bore"."""

    scene: Scene

    @cached_property
    def inputs(self) -> Mapping[str, Input]:
        by_key = {key: each for path, each in super().inputs.items() if (key := path.partition(".")[2])}
        # A mesh has no plates, and may not be stretched by all of its dimensions.
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
        """A prescribed k stands in for the loss that it leaves out."""
        prescribed = self.scene.tube.drag_coefficient is not None
        return ["drag_coefficient" if prescribed and name == "extra_loss" else name]

    def parameter(self, name: str) -> Parameter:
        return Parameter.of(self.scene, name)

    def changed(self, name: str, change: float) -> SceneFile:
        if name in self.errors:
            return self.errors[name].moved(self.scene, change)
        return shifted(scene=self.scene, quantity=name, change=change)

    def both_sides(self, name: str, change: float) -> tuple[SceneFile, SceneFile]:
        error = self.errors.get(name)
        # Errors of models are nearly linear, and there are many, but a crest's arc has two different ends.
        if error is None or error.group == f"{MODEL}{CREST_ERROR}":
            return super().both_sides(name, change)
        # All have the places of all, so that they differ in numbers alone.
        return self.scene, error.moved(with_places(self.scene, self.errors.values()), change)


_INPUTS: Final[Mapping[str, type[_SceneInputs]]] = {Scene.balancer: _LiquidRingInputs}
"""By the name of the balancer; the others have nothing but their `Balancer`."""


def inputs_of(scene: SceneFile) -> _SceneInputs:
    """Quantities of a scene that a fit may move."""
    return _INPUTS.get(scene.balancer, _SceneInputs)(scene)


def path_of(name: str) -> str:
    """Place in the scene of what fits name "bore"; of eccentric masses the name is one."""
    table = UNCERTAIN_QUANTITIES.get(name)
    return name if table is None else f"{table}.{name}"
