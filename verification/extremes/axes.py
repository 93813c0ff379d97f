"""The axes along which a scene is taken to its extremes, the scene at a point on them, and a designed set.

A new input is one more axis, with the keys that it changes in `_CHANGES`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from ringbalance.design.sobol import sobol
from ringbalance.mesh.geometry import liquid_first_moment, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.changes import document_of
from ringbalance.scene.models import Scene

Point = Mapping[str, float]
"""Values in the units of the axes, by axis."""
Changes = Mapping[str, Any]
"""Values by path, for `SceneFile.with_values`."""
_MAX_PERIODS: Final = 20
"""Number of controller periods in the time limit of a point's closed loop."""
_GAS_TIME_S: Final = 0.2
"""Time limit beyond these periods, s, so that long valve-open times need no higher number of periods."""
_ON_SHAFT_FROM: Final = 0.5
"""Value of the axis "place" from which the gas pressure is that on the shaft."""
_USUAL_FRACTION: Final = 0.75
"""Fraction of the coordinates in the usual range; with fewer, most points would be refused."""


@dataclass(frozen=True)
class InputAxis:
    """One input, over a range that exceeds the usual one of discs."""

    name: str
    title: str
    unit: str
    low: float
    high: float
    usual: tuple[float, float]
    """Ends of the usual range of discs; the rest of the axis lies beyond it on one or both sides."""
    spacing: Literal["log", "linear"] = "log"

    def share(self, value: float) -> float:
        """Fraction of the way along the axis at a value in `unit`, within [0, 1]."""
        if self.spacing == "linear":
            return (value - self.low) / (self.high - self.low)
        return math.log(value / self.low) / math.log(self.high / self.low)

    def at(self, share: npt.ArrayLike) -> FloatArray:
        """Values in `unit` at fractions of the way along the axis."""
        s = np.asarray(share, dtype=np.float64)
        if self.spacing == "linear":
            return np.asarray(self.low + s * (self.high - self.low), dtype=np.float64)
        return np.asarray(self.low * (self.high / self.low) ** s, dtype=np.float64)


AXES: Final = (
    InputAxis("speed", "speed", "rpm", 1.0, 3e5, usual=(300.0, 6e4)),
    InputAxis("fill", "largest fill ratio", "1", 1e-6, 1.0, usual=(0.05, 0.9)),
    InputAxis("angle", "central angle", "deg", 5.0, 89.0, usual=(10.0, 85.0), spacing="linear"),
    InputAxis(
        "plate", "plate thickness over that which closes the chamber", "1", 0.0, 1.05, (0.0, 0.8), "linear"
    ),
    InputAxis("viscosity", "kinematic viscosity", "m^2/s", 1e-7, 1e-2, usual=(1e-7, 1e-3)),
    InputAxis("bore", "bore", "mm", 0.1, 20.0, usual=(0.3, 6.0)),
    InputAxis("roughness", "roughness over bore", "1", 1e-7, 0.06, usual=(1e-6, 0.02)),
    InputAxis(
        "pressure", "gas pressure over the column to the siphon crest", "1", 0.0, 4.0, (0.8, 3.0), "linear"
    ),
    InputAxis(
        "place", "gas pressure on the shaft from a half up", "1", 0.0, 1.0, usual=(0.0, 0.4), spacing="linear"
    ),
    InputAxis("unbalance", "unbalance over what one pair can carry", "1", 0.01, 1.5, usual=(0.05, 0.9)),
    InputAxis("gain", "controller gain over the scene's", "1", 1e-4, 1e3, usual=(0.01, 10.0)),
    InputAxis("noise", "sensor noise over the limit", "1", 1e-4, 10.0, usual=(1e-3, 0.5)),
    InputAxis("period", "controller period", "s", 1e-3, 100.0, usual=(0.05, 5.0)),
    InputAxis("tolerance", "tolerance", "1", 1e-10, 0.1, usual=(1e-4, 0.1)),
    # Without gravity there is a closed form to compare the half-widths with.
    InputAxis("gravity", "gravity over standard gravity", "1", 0.0, 2.0, usual=(0.0, 0.0), spacing="linear"),
)
"""Axes that a designed set varies together."""


def scene_at(scene: Scene, point: Point) -> Scene:
    """The scene with some axes set, checked as a file is.

    Dependent values follow: four chambers for any central angle, bends that the bore allows, a tube that
    reaches over the crest, and a rotor matched to the disc: a disc with less liquid has a lighter rotor, with
    a larger influence coefficient, so that all liquid of a pair makes the same vibration, and limit, gain and
    noise keep their meaning.
    Raises: SceneError: no scene can have these values.
    """
    rotor, control = scene.rotor, scene.controller
    period = point.get("period", control.period)
    disc_changes: dict[str, Any] = {"run.time_limit": _MAX_PERIODS * period + _GAS_TIME_S}
    for name, value in point.items():
        if name in _CHANGES:
            disc_changes |= _CHANGES[name](scene, float(value), point)
    disc = scene.with_values(disc_changes)
    lighter = _capacity(scene) / _capacity(disc)
    noise = point.get("noise", scene.sensor.amplitude_noise / control.limit)
    unbalance = point["unbalance"] * _capacity(scene) if "unbalance" in point else rotor.initial_amplitude
    changes: dict[str, Any] = {
        "rotor.influence_coefficient": lighter * rotor.influence_coefficient,
        "rotor.initial_vibration": {"amplitude": unbalance, "phase": rotor.initial_phase},
        "controller.proportional": point.get("gain", 1.0) * control.proportional,
        "sensor.amplitude_noise": noise * control.limit,
    }
    if "assumed_influence_coefficient" in document_of(scene).get("controller", {}):
        assumed = lighter * control.assumed_influence_coefficient
        changes["controller.assumed_influence_coefficient"] = assumed
    return disc.with_values(changes)


def _capacity(scene: Scene) -> float:
    """Vibration that a pair balances with all its liquid in one chamber, m."""
    a = surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio)
    moment = (
        scene.liquid.density * scene.disc.axial_width * liquid_first_moment(disc=scene.disc, surface_radius=a)
    )
    return float(scene.rotor.influence_coefficient * moment)


def _plate(scene: Scene, value: float, point: Point) -> Changes:
    angle = math.radians(point["angle"]) if "angle" in point else scene.disc.central_angle
    closing = scene.disc.inner_radius * math.sin(min(angle, math.pi) / 2)
    return {"disc.plate_thickness": value * closing}


def _viscosity(scene: Scene, value: float, _: Point) -> Changes:
    liquid = scene.liquid
    properties = {"density": liquid.density, "vapour_pressure": liquid.vapour_pressure}
    return {"liquid": properties | {"kinematic_viscosity": value}}


def _bore(scene: Scene, value: float, _: Point) -> Changes:
    bore = 1e-3 * value
    bends = [{"angle": bend.angle, "radius": max(bend.radius, bore)} for bend in scene.tube.bends]
    # Two right-angled bends of that radius need no more than this beside the legs.
    return {"tube.bore": bore, "tube.bends": bends, "tube.length": scene.tube.length + 4 * bore}


def _roughness(scene: Scene, value: float, point: Point) -> Changes:
    bore = 1e-3 * point["bore"] if "bore" in point else scene.tube.bore
    return {"tube.roughness": value * bore}


def _pressure(scene: Scene, value: float, point: Point) -> Changes:
    speed = math.pi / 30 * point["speed"] if "speed" in point else scene.rotor.speed
    crest = scene.tube.hump_radius or scene.disc.inner_radius
    column = scene.liquid.density * speed**2 * (scene.disc.outer_radius**2 - crest**2) / 2
    return {"gas.pressure": value * column}


_CHANGES: Final[Mapping[str, Callable[[Scene, float, Point], Changes]]] = MappingProxyType(
    {
        "speed": lambda _, value, __: {"rotor.speed": f"{value!r} rpm"},
        "fill": lambda _, value, __: {"disc.max_fill_ratio": value, "disc.initial_fill": value / 2},
        "angle": lambda _, value, __: {
            "disc.central_angle": f"{value!r} deg",
            "disc.chambers": 4,
            "controller.sequence": None,
        },
        "plate": _plate,
        "viscosity": _viscosity,
        "bore": _bore,
        "roughness": _roughness,
        "pressure": _pressure,
        "place": lambda _, value, __: {"gas.measured_at": "chamber" if value < _ON_SHAFT_FROM else "shaft"},
        "period": lambda _, value, __: {"controller.period": value},
        "tolerance": lambda _, value, __: {"accuracy.tolerance": f"{100 * value!r} %"},
        "gravity": lambda _, value, __: {"environment.gravity": 9.80665 * value},
    }
)
"""Changed keys by axis, as functions of scene, value and point; `scene_at` sets the remaining axes."""


def designed_set(*, count: int, seed: int) -> tuple[Point, ...]:
    """Points spread evenly over all axes at once; a longer set begins with a shorter one.

    On each axis most values lie in the usual range.
    Source: Sobol's sequence, scrambled after Owen, as in scipy.stats.qmc.
    """
    columns = sobol(2 * len(AXES), count, seed=seed).T
    values = {}
    for axis, share, kind in zip(AXES, columns[: len(AXES)], columns[len(AXES) :], strict=True):
        low, high = (axis.share(end) for end in axis.usual)
        shares: list[float] = np.where(kind < _USUAL_FRACTION, low + share * (high - low), share).tolist()
        values[axis.name] = [float(axis.at(each)) for each in shares]
    return tuple(dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True))
