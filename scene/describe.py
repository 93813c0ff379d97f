"""A scene in words and engineering units, for the report and for messages about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ringbalance.scene.faults import Fault, toml_text
from ringbalance.scene.models import Bend, Scene
from ringbalance.scene.uncertain import UNCERTAIN
from ringbalance.scene.units import format_quantity


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table of a scene."""

    group: str
    """Such as "Disc"."""
    quantity: str
    """Such as "outer radius R2"."""
    value: str
    """With its unit."""
    note: str
    """Where the value comes from, or what it means; may be empty."""


@dataclass(frozen=True, kw_only=True)
class _Line:
    path: str
    quantity: str
    dimension: str = ""
    unit: str = ""
    note: str = ""
    absent: str = ""
    """What is said when the scene has no such value; empty: no line."""


_DISC = (
    _Line(path="disc.outer_radius", quantity="outer radius R2", dimension="length", unit="mm"),
    _Line(path="disc.inner_radius", quantity="inner radius R1", dimension="length", unit="mm"),
    _Line(path="disc.axial_width", quantity="axial width B", dimension="length", unit="mm"),
    _Line(path="disc.central_angle", quantity="central angle of a chamber", dimension="angle", unit="deg"),
    _Line(path="disc.chambers", quantity="chambers"),
    _Line(
        path="disc.plate_thickness",
        quantity="plate thickness t",
        dimension="length",
        unit="mm",
        note="on each side of a chamber",
    ),
    _Line(
        path="disc.max_fill_ratio",
        quantity="greatest fill ratio",
        note="liquid of a pair, per chamber volume",
    ),
    _Line(path="disc.initial_fill", quantity="fill ratio at the start"),
)
_LIQUID = (
    _Line(path="liquid.name", quantity="liquid"),
    _Line(
        path="liquid.temperature",
        quantity="temperature",
        dimension="temperature",
        unit="degC",
        absent="not given",
    ),
    _Line(path="liquid.density", quantity="density", dimension="density", unit="kg/m^3"),
    _Line(
        path="liquid.kinematic_viscosity",
        quantity="kinematic viscosity",
        dimension="kinematic_viscosity",
        unit="mm^2/s",
    ),
    _Line(
        path="liquid.vapour_pressure",
        quantity="vapour pressure",
        dimension="pressure",
        unit="kPa",
        note="absolute",
    ),
)
_TUBE = (
    _Line(path="tube.bore", quantity="bore d", dimension="length", unit="mm"),
    _Line(path="tube.port_radius", quantity="port radius", dimension="length", unit="mm"),
    _Line(
        path="tube.hump_radius",
        quantity="hump radius",
        dimension="length",
        unit="mm",
        absent="none: always a full siphon",
    ),
    _Line(path="tube.hump_position", quantity="hump position", note="share of the path"),
    _Line(path="tube.hump_gas", quantity="gas beyond the hump"),
    _Line(path="tube.length", quantity="length", dimension="length", unit="mm", note="bends included"),
    _Line(path="tube.roughness", quantity="roughness", dimension="length", unit="um"),
    _Line(path="tube.entrance", quantity="entrance"),
    _Line(path="tube.bends", quantity="bends"),
    _Line(path="tube.extra_loss", quantity="further loss coefficient"),
    _Line(path="tube.drag_coefficient", quantity="drag coefficient k", absent="calculated"),
)
_GAS = (
    _Line(path="gas.pressure", quantity="gas pressure", dimension="pressure", unit="MPa", note="gauge"),
    _Line(
        path="gas.ambient_pressure",
        quantity="ambient pressure",
        dimension="pressure",
        unit="kPa",
        note="absolute",
    ),
    _Line(path="gas.temperature", quantity="gas temperature", dimension="temperature", unit="degC"),
    _Line(
        path="gas.conductance",
        quantity="sonic conductance C",
        dimension="conductance",
        unit="l/(s*bar)",
        absent="none: the chamber fills at once",
    ),
    _Line(path="gas.critical_ratio", quantity="critical pressure ratio b"),
    _Line(path="gas.dead_volume", quantity="dead volume", dimension="volume", unit="ml"),
    _Line(path="gas.valve_lag", quantity="valve lag", dimension="time", unit="ms"),
    _Line(path="gas.process", quantity="gas in the chambers", note="matters with a conductance only"),
)
_ROTOR = (
    _Line(path="rotor.speed", quantity="speed", dimension="speed", unit="rpm"),
    _Line(path="environment.shaft", quantity="shaft"),
    _Line(path="environment.gravity", quantity="gravity", dimension="acceleration", unit="m/s^2"),
    _Line(
        path="rotor.influence_coefficient",
        quantity="influence coefficient",
        dimension="influence_coefficient",
        unit="um/(g*mm)",
    ),
    _Line(path="rotor.lag_angle", quantity="lag angle", dimension="angle", unit="deg"),
    _Line(
        path="rotor.initial_amplitude",
        quantity="vibration at the start",
        dimension="length",
        unit="um",
        note="zero-to-peak",
    ),
    _Line(path="rotor.initial_phase", quantity="its phase", dimension="angle", unit="deg"),
    _Line(path="sensor.amplitude_noise", quantity="amplitude noise", dimension="length", unit="um"),
    _Line(path="sensor.phase_noise", quantity="phase noise", dimension="angle", unit="deg"),
)
_CONTROLLER = (
    _Line(path="controller.kind", quantity="algorithm"),
    _Line(path="controller.limit", quantity="limit", dimension="length", unit="um"),
    _Line(path="controller.period", quantity="period", dimension="time", unit="s"),
    _Line(path="controller.proportional", quantity="proportional gain Kc", dimension="gain", unit="s/um"),
    _Line(
        path="controller.integral_time",
        quantity="integral time Ti",
        dimension="time",
        unit="min",
        absent="no integral part",
    ),
    _Line(path="controller.derivative_time", quantity="derivative time Td", dimension="time", unit="min"),
    _Line(path="controller.minimum_gas_time", quantity="shortest gas time", dimension="time", unit="ms"),
    _Line(path="controller.maximum_gas_time", quantity="longest gas time", dimension="time", unit="s"),
    _Line(
        path="controller.assumed_influence_coefficient",
        quantity="influence coefficient believed",
        dimension="influence_coefficient",
        unit="um/(g*mm)",
    ),
    _Line(path="controller.assumed_lag_angle", quantity="lag angle believed", dimension="angle", unit="deg"),
)
_TRIAL = (
    _Line(path="controller.sequence", quantity="order of trials"),
    _Line(path="controller.first_trial", quantity="first trial", dimension="time", unit="ms"),
    _Line(path="controller.long_step", quantity="long step", dimension="time", unit="ms"),
    _Line(path="controller.short_step", quantity="short step", dimension="time", unit="ms"),
    _Line(path="controller.fine_below", quantity="short steps below", dimension="length", unit="um"),
)
_RUN = (
    _Line(path="run.seed", quantity="seed"),
    _Line(path="run.time_limit", quantity="time limit", dimension="time", unit="s"),
    _Line(path="tolerance", quantity="tolerance", dimension="share", unit="%"),
)
_ALL = (*_DISC, *_LIQUID, *_TUBE, *_GAS, *_ROTOR, *_CONTROLLER, *_TRIAL, *_RUN)


def scene_table(scene: Scene) -> tuple[Row, ...]:
    """Describe a scene line by line.

    Args:
        scene: the scene.

    Returns:
        Rows in groups; a value that the file does not give carries the note "default".
    """
    trial = _TRIAL if scene.controller.kind == "trial" else ()
    groups = {
        "Disc": _DISC,
        "Liquid": _LIQUID,
        "Connecting tube": _TUBE,
        "Gas": _GAS,
        "Rotor": _ROTOR,
        "Controller": (*_CONTROLLER, *trial),
        "Run": _RUN,
    }
    return tuple(
        row for group, lines in groups.items() for line in lines for row in _rows(scene, group, line)
    )


def scene_fault(*, scene: Scene, table: str, key: str, problem: str, allowed: str) -> Fault:
    """Make a fault about a loaded scene, for what only a later room can tell.

    Args:
        scene: the scene.
        table: of the value to be changed, such as "rotor".
        key: of the value to be changed, such as "speed".
        problem: what is wrong.
        allowed: what would be accepted.

    Returns:
        The fault; raise `SceneError` with it.
    """
    line = next(
        (line for line in _ALL if line.path == f"{table}.{key}"), _Line(path=f"{table}.{key}", quantity=key)
    )
    shown = toml_text(_shown(line, _value(scene, line.path)))
    return Fault(file=scene.source, table=table, key=key, value=shown, problem=problem, allowed=allowed)


def _rows(scene: Scene, group: str, line: _Line) -> Iterator[Row]:
    value = _value(scene, line.path)
    if value is None and not line.absent:
        return
    shown = line.absent if value is None else _shown(line, value)
    notes = [line.note, _origin(scene, line.path), _spread(scene, line)]
    yield Row(
        group=group, quantity=line.quantity, value=shown, note="; ".join(note for note in notes if note)
    )


def _value(scene: Scene, path: str) -> Any:
    value: Any = scene
    for part in path.split("."):
        value = getattr(value, part)
    return value


def _shown(line: _Line, value: Any) -> str:
    if line.dimension:
        return format_quantity(value, line.dimension, line.unit)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return ", ".join(_bend(item) if isinstance(item, Bend) else str(item) for item in value) or "none"
    return str(value)


def _bend(bend: Bend) -> str:
    radius = format_quantity(bend.radius, "length", "mm")
    return f"{format_quantity(bend.angle, 'angle', 'deg')} on {radius}"


def _origin(scene: Scene, path: str) -> str:
    if path == "liquid.name":
        return scene.liquid.source
    names = {
        "rotor.initial_amplitude": "rotor.initial_vibration",
        "rotor.initial_phase": "rotor.initial_vibration",
        "tolerance": "accuracy.tolerance",
    }
    return "default" if names.get(path, path) in scene.defaulted else ""


def _spread(scene: Scene, line: _Line) -> str:
    given = [
        each for each in scene.uncertainty if f"{UNCERTAIN[each.quantity].table}.{each.quantity}" == line.path
    ]
    if given and not given[0].relative:
        width = format_quantity(given[0].half_width, line.dimension, line.unit) if line.dimension else ""
        return f"give or take {width or f'{given[0].half_width:g}'} (95 %)"
    relative = {
        "liquid.density": scene.liquid.density_uncertainty,
        "liquid.kinematic_viscosity": scene.liquid.viscosity_uncertainty,
    }.get(line.path, given[0].half_width if given else 0.0)
    return f"give or take {100 * relative:.3g} % (95 %)" if relative else ""
