"""Space of the designs: axes from the scene's table [design], and dependent dimensions of the tube."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.design.axes import Point, Range, SweepAxis, plan_of_texts
from ringbalance.design.choices import with_valves
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import COMMAND_LINE, Fault, SceneError
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.toml import toml_text

BORES_M: Final = (0.3e-3, 3e-3)
"""Default range of the bore: drawn tubes on the market that can be cleaned."""
_LEAST_FRACTION: Final = 0.1
"""Default lower end of width or pressure over its largest value; for R2 - R1 twice as much."""
_DIGITS: Final = 3
"""Significant digits of a tried value, as in a drawing."""
_HASTY_FACTOR: Final = 2.0
"""Run time over the required settling time: any later settling is too late."""
VALVE: Final = "valve"
LIQUID: Final = "liquid"
"""Names of all keys of a valve or a liquid together."""
OF_SCENE: Final = "as in the scene"
"""Name of the scene's valve among those on sale."""
VALVE_KEYS: Final = ("conductance", "critical_ratio", "valve_lag")
_VALVE: Final = tuple(f"gas.{key}" for key in VALVE_KEYS)
_LIQUID_KEYS: Final = ("name", "density", "kinematic_viscosity", "vapour_pressure", "temperature")
_LIQUID: Final = tuple(f"liquid.{key}" for key in _LIQUID_KEYS)


@dataclass(frozen=True, kw_only=True)
class Space:
    """Space of possible designs, a unit cube."""

    scene: Scene
    axes: tuple[SweepAxis, ...]

    @classmethod
    def of(cls, scene: Scene) -> Space:
        """Make the space of [design]. Raises: SceneError: nothing may vary, or a key cannot be used."""
        if scene.design.valve_file is not None:
            scene = _with_valve_file(scene, scene.design.valve_file)
        keys = scene.design
        axes = [*_listed(scene), *_valves(scene), *_liquids(scene)]
        taken = {path for axis in axes for path in axis.paths}
        for path, (low, high, log) in _ranges(scene).items():
            if path not in taken:
                axes.append(SweepAxis(ranges={path: Range(low=low, high=high, log=log)}))
        if not any((keys.outer_radius, keys.axial_width, keys.pressure, taken)):
            allowed = (
                "a table [design] with the space (outer_radius, axial_width), the highest pressure, valves, "
                "valve_file, liquids or vary; for a given disc, --in-place, or `ringbalance tune` for its "
                "controller"
            )
            raise SceneError.of_file(scene.file, "[design] leaves nothing to choose", allowed)
        return cls(scene=scene, axes=tuple(axes))

    @cached_property
    def hasty(self) -> SceneFile:
        """Scene with runs that end soon after the required settling time, with equal verdicts on devices."""
        required = self.scene.requirement.settling_time
        if required is None or _HASTY_FACTOR * required >= self.scene.run.time_limit:
            return self.scene
        return self.scene.with_values({"run.time_limit": _HASTY_FACTOR * required})

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the keys that vary."""
        return tuple(path for axis in self.axes for path in axis.paths)

    @property
    def sized(self) -> bool:
        """True if the disc's size varies."""
        return any(path in ("disc.outer_radius", "disc.axial_width") for path in self.paths)

    @property
    def sets_controller(self) -> bool:
        """True if keys of the controller vary; then no other settings are searched."""
        return any(path.startswith("controller.") for path in self.paths)

    def points(self, shares: FloatArray) -> list[Point]:
        """Changes of the scene at coordinates in the unit cube, shape (n, axes), dependent keys included."""
        columns = [axis.at(column) for axis, column in zip(self.axes, shares.T, strict=True)]
        points = []
        for row in zip(*columns, strict=True):
            # Rounded as in a drawing; the data of a valve are not rounded.
            point = {
                path: float(f"{value:.{_DIGITS}g}")
                if isinstance(value, float) and path not in (*_VALVE, *_LIQUID)
                else value
                for part in row
                for path, value in part.items()
            }
            points.append(self.followed(point))
        return points

    def followed(self, point: Point) -> Point:
        """Point with the tube adapted to its disc.

        Constant are the distance of the port from the outer wall, the fill at which a free surface reaches
        the crest, and the ratio of the length to the shortest path; keys of the point itself take precedence.
        """
        disc, tube = self.scene.disc, self.scene.tube
        outer = float(point.get("disc.outer_radius", disc.outer_radius))
        inner = float(point.get("disc.inner_radius", disc.inner_radius))
        if (outer, inner) == (disc.outer_radius, disc.inner_radius) or disc.geometry is not None:
            return point
        port = outer - (disc.outer_radius - tube.port_radius)
        follows: dict[str, Any] = {"tube.port_radius": _up(port)}
        crest = tube.hump_radius
        if crest is not None:
            share = (crest**2 - disc.inner_radius**2) / (disc.outer_radius**2 - disc.inner_radius**2)
            crest = math.sqrt(max(inner**2 + share * (outer**2 - inner**2), inner**2))
            follows["tube.hump_radius"] = round(crest, 5)
        crest = point.get("tube.hump_radius", follows.get("tube.hump_radius"))
        stretch = _path(follows["tube.port_radius"], crest) / _path(tube.port_radius, tube.hump_radius)
        follows["tube.length"] = _up(max(stretch, 0.0) * tube.length)
        return {**follows, **point}

    def size(self, point: Point) -> float:
        """Volume of the cylinder around the chambers, pi R2^2 B, m^3."""
        disc = self.scene.disc
        outer = float(point.get("disc.outer_radius", disc.outer_radius))
        return math.pi * outer**2 * float(point.get("disc.axial_width", disc.axial_width))

    def sized_at(self, shares: FloatArray, size: float) -> FloatArray:
        """Coordinates in the unit cube of a design scaled to another size, m^3, within its range: by the
        width if that varies, else by the outer radius."""
        moved = shares.copy()
        for i, axis in enumerate(self.axes):
            for path, power in (("disc.axial_width", 1.0), ("disc.outer_radius", 0.5)):
                if path in axis.ranges and (power == 1.0 or "disc.axial_width" not in self.paths):
                    (point,) = self.points(moved[np.newaxis])
                    value = float(point[path]) * (size / self.size(point)) ** power
                    moved[i] = axis.ranges[path].share(value)
        return moved

    def coordinates(self, shares: FloatArray) -> FloatArray:
        """Coordinates of the surface from those in the unit cube; entries of a list are equidistant."""
        return np.concatenate(
            [
                column[:, np.newaxis]
                if axis.ranges
                else 0.5 * np.eye(count)[np.minimum((column * count).astype(int), count - 1)]
                for axis, column in zip(self.axes, shares.T, strict=True)
                for count in (len(axis.choices),)
            ],
            axis=1,
        )

    def combinations(self, shares: FloatArray) -> IntArray:
        """Number of the combination of the lists' entries at coordinates in the unit cube."""
        numbers = np.zeros(len(shares), dtype=np.intp)
        for axis, column in zip(self.axes, shares.T, strict=True):
            if count := len(axis.choices):
                numbers = count * numbers + np.minimum((column * count).astype(np.intp), count - 1)
        return numbers

    @property
    def parts(self) -> dict[str, SweepAxis]:
        """Axes with named choices, by what they choose: "valve" or "liquid"."""
        return {
            LIQUID if axis.paths[0].startswith("liquid.") else VALVE: axis
            for axis in self.axes
            if any(axis.names)
        }

    def names(self, point: Point) -> dict[str, str]:
        """Name of each part of a point, by what it is: its valve, its liquid."""
        return {part: axis.name_of(point) for part, axis in self.parts.items()}

    def wider(self, path: str, *, low: bool) -> str | None:
        """`vary` with a range extended beyond an end, as TOML; None: the scene gives this end."""
        if any(path in axis.paths for axis in _listed(self.scene)) or not (low or path == "tube.bore"):
            return None
        (ends,) = (axis.ranges[path] for axis in self.axes if path in axis.ranges)
        floor = self.scene.disc.inner_radius if path == "disc.outer_radius" else 0.0
        first, last = ((ends.low + floor) / 2, ends.high) if low else (ends.low, 2 * ends.high)
        text = f"{path}={setting_text(path, first)}:{setting_text(path, last)}{':log' * ends.log}"
        return "[{}]".format(", ".join(f'"{each}"' for each in (*self.scene.design.vary, text)))

    def range_text(self, path: str) -> str:
        """Range or choices of a key, in its usual unit."""
        (axis,) = (each for each in self.axes if path in each.paths)
        if path in axis.ranges:
            ends = axis.ranges[path]
            return f"{setting_text(path, ends.low)} to {setting_text(path, ends.high)}"
        return ", ".join(dict.fromkeys(setting_text(path, each.get(path)) for each in axis.choices))


def _path(port: float, crest: float | None) -> float:
    if crest is not None and crest >= port:
        return 2 * port
    return shortest_path(port_radius=port, hump_radius=crest, separation=math.pi)


def _up(length: float) -> float:
    """Round up to a hundredth of a millimetre: no tube is shorter than its path."""
    return math.ceil(length * 1e5 - 1e-6) / 1e5


def _listed(scene: Scene) -> tuple[SweepAxis, ...]:
    """Axes of `vary`."""
    folder = scene.checked.folder if scene.checked is not None else None
    try:
        return plan_of_texts(scene, scene.design.vary, folder=folder).axes
    except SceneError as error:
        # Errors within a file of an axis are unchanged.
        raise SceneError(
            replace(each, file=scene.file, table="design", key="vary") if each.file == COMMAND_LINE else each
            for each in error.faults
        ) from error


def _with_valve_file(scene: Scene, file: str) -> Scene:
    """The scene with the valves of its file in place of their list."""
    folder = scene.checked.folder if scene.checked is not None else Path()
    if not (folder / file).is_file():
        fault = Fault(
            file=scene.file,
            table="design",
            key="valve_file",
            value=toml_text(file),
            problem="there is no such file",
            allowed="a CSV file beside the scene",
        )
        raise SceneError([fault])
    return liquid_ring_scene(with_valves(scene, folder / file))


def _valves(scene: Scene) -> tuple[SweepAxis, ...]:
    """One axis with all available valves; empty if there are none."""
    keys = scene.design
    if not keys.valves:
        return ()
    choices = tuple(
        dict(zip(_VALVE, (*valve.iso_6358, valve.lag), strict=True))
        for valve in (each.completed for each in keys.valves)
    )
    return (SweepAxis(ranges={}, choices=choices, names=tuple(valve.name for valve in keys.valves)),)


def _liquids(scene: Scene) -> tuple[SweepAxis, ...]:
    """One axis with all available liquids; empty if there are none.

    A value that an entry does not state is that of the known liquid, at the scene's temperature.
    """
    liquids = scene.design.liquids
    if not liquids:
        return ()
    choices = [
        {path: getattr(each, key) for path, key in zip(_LIQUID, _LIQUID_KEYS, strict=True)}
        for each in liquids
    ]
    for number, choice in enumerate(choices, 1):
        if choice["liquid.temperature"] is None:
            choice["liquid.temperature"] = scene.liquid.temperature
        try:
            scene.with_values(choice)
        except SceneError as error:
            faults = [
                replace(each, table="design", key=f"liquids[{number}].{each.key}") for each in error.faults
            ]
            raise SceneError(faults) from error
    return (SweepAxis(ranges={}, choices=tuple(choices), names=tuple(each.name for each in liquids)),)


def _ranges(scene: Scene) -> dict[str, tuple[float, float, bool]]:
    """Lower and upper end by path, and True for a logarithmic range."""
    keys, disc = scene.design, scene.disc
    ranges: dict[str, tuple[float, float, bool]] = {"tube.bore": (*BORES_M, True)}
    if keys.outer_radius is not None:
        low = disc.inner_radius + 2 * _LEAST_FRACTION * (keys.outer_radius - disc.inner_radius)
        if low <= disc.inner_radius:
            fault = Fault(
                file=scene.file,
                table="design",
                key="outer_radius",
                value=toml_text(f"{1e3 * keys.outer_radius:g} mm"),
                problem="no chamber has room there",
                allowed=f"above inner_radius of [disc], {1e3 * disc.inner_radius:g} mm",
            )
            raise SceneError([fault])
        ranges["disc.outer_radius"] = (low, keys.outer_radius, False)
    if keys.axial_width is not None:
        ranges["disc.axial_width"] = (_LEAST_FRACTION * keys.axial_width, keys.axial_width, True)
    if keys.pressure is not None:
        ranges["gas.pressure"] = (_LEAST_FRACTION * keys.pressure, keys.pressure, True)
    return ranges
