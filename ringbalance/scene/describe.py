"""A scene in words and engineering units, for the report and for messages about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import Key, Shown, descriptions_of, keys_of
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.models import Bend, Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.registry import balancers
from ringbalance.scene.toml import toml_text
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES
from ringbalance.scene.units import DIMENSIONS, format_quantity, shortest_quantity


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
    """What the value means; may be empty."""
    origin: str
    """"given", "inferred", "assumed", "measured" or "default"."""
    uncertainty: str
    """Expanded (95 %), with its unit; empty where none is stated."""
    path: str
    """Of the value in the scene, such as "tube.bore"."""


@dataclass(frozen=True, kw_only=True)
class _SceneLine:
    path: str
    shown: Shown
    dimension: str
    """Empty without unit."""


_EXACT = 15
"""Digits of a number whose last place does not matter."""
_GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "Disc": ("disc",),
        "Liquid": ("liquid",),
        "Connecting tube": ("tube",),
        "Gas": ("gas",),
        "Rotor": ("rotor.speed", "environment", "rotor", "sensor"),
        "Controller": ("controller",),
        "Requirement": ("requirement",),
        "Run": ("run", "tolerance"),
    }
)
"""Tables, and single paths, of which the groups consist."""


def _declared() -> Iterator[_SceneLine]:
    for name, table in LIQUID_RING.tables.items():
        if table.record is not None:
            keys = keys_of(table.record)
            for key, entry in descriptions_of(table.record).items():
                yield _line(f"{name}.{key}", entry, keys.get(key))
    for key, entry in descriptions_of(Scene).items():
        yield _line(key, entry, None)


def _line(path: str, entry: Shown, key: Key | None) -> _SceneLine:
    dimension = key.takes.dimension if key is not None else None
    return _SceneLine(path=path, shown=entry, dimension=entry.dimension or dimension or "")


_LINES: Mapping[str, _SceneLine] = MappingProxyType({line.path: line for line in _declared()})


def scene_table(scene: Scene) -> tuple[Row, ...]:
    """A scene line by line, in groups; a value that the file does not give has the origin "default"."""
    return tuple(
        row
        for group, parts in _GROUPS.items()
        for line in _lines_of(parts)
        if line.shown.only_for in ("", scene.controller.kind)
        for row in _rows(scene, group, line)
    )


def _lines_of(parts: tuple[str, ...]) -> Iterator[_SceneLine]:
    paths = (path for part in parts for path in _LINES if path == part or path.startswith(f"{part}."))
    return (_LINES[path] for path in dict.fromkeys(paths))


def _line_at(path: str) -> _SceneLine:
    """Description of a value of any kind of scene; by its path where its declaration has no name for it."""
    if path in _LINES:
        return _LINES[path]
    table, _, key = path.split("[")[0].partition(".")
    for kind in map(scene_kind, balancers()):
        keys = kind.schema.tables[table].keys if table in kind.schema.tables else {}
        takes = keys[key].takes if key in keys else None
        if takes is not None and takes.dimension:
            unit = kind.usual_units.get(takes.dimension, DIMENSIONS[takes.dimension].si_unit)
            return _SceneLine(path=path, shown=Shown(path, unit), dimension=takes.dimension)
    return _SceneLine(path=path, shown=Shown(path), dimension="")


def usual_unit(path: str) -> str:
    """Unit in which a value of a scene is described; empty without one."""
    return _line_at(path).shown.unit


def si_unit(path: str) -> str:
    """SI unit of a value of a scene, such as "kg m"; "1" for a number without one."""
    dimension = _line_at(path).dimension
    return DIMENSIONS[dimension].si_unit.replace("*", " ") if dimension else "1"


def usual_name(path: str) -> str:
    """Name of a value of a scene, such as "bore d"; its path where it has none."""
    return _line_at(path).shown.name


def in_usual_unit(path: str, value: float) -> float:
    """A value of a scene, SI, in its usual unit."""
    line = _line_at(path)
    if not line.dimension:
        return value
    return float(format_quantity(value, line.dimension, line.shown.unit, digits=_EXACT).split(" ")[0])


def setting_text(path: str, value: object) -> str:
    """A value of a scene, SI, as a reader knows it."""
    if value is None:
        return "none"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(setting_text(path, each) for each in value)
    if isinstance(value, float | int):
        line = _line_at(path)
        if line.dimension:
            return format_quantity(value, line.dimension, _suited_unit(line, value), digits=4)
        # Whole numbers count something, or are a seed: every digit counts.
        number = value if isinstance(value, int) else format(value, ".4g")
        return f"{number} {line.shown.unit}".rstrip()
    return str(value)


def _suited_unit(line: _SceneLine, *values: float) -> str:
    """The usual unit; seconds where minutes would need many digits."""
    unit = line.shown.unit
    texts = [shortest_quantity(each, unit) for each in values if each] if unit == "min" else []
    return "s" if any(text.endswith(" s") for text in texts) else unit


def scene_fault(scene: Scene, path: str, *, problem: str, allowed: str) -> Fault:
    """The error about a value of a loaded scene that only a later room finds; raise `SceneError` with it."""
    table, key = path.split(".")
    written = toml_text(_written(_line_at(path), _value(scene, path)))
    return Fault(file=scene.file, table=table, key=key, value=written, problem=problem, allowed=allowed)


def scene_lines(scene: AnyScene) -> Iterator[str]:
    """Main values of a scene with their keys, for its text in a terminal."""
    for paths in scene_kind(scene.balancer).main:
        yield ", ".join(f"{path} {setting_text(path, _value(scene, path))}" for path in paths)


def _rows(scene: Scene, group: str, line: _SceneLine) -> Iterator[Row]:
    value = _value(scene, line.path)
    if value is None and not line.shown.absent:
        return
    written = line.shown.absent if value is None else _written(line, value)
    source = scene.liquid.source if line.path == "liquid.name" else ""
    yield Row(
        group=group,
        quantity=line.shown.name,
        value=written,
        note="; ".join(note for note in (line.shown.note, source) if note),
        origin=scene.origin_of(line.path),
        uncertainty=_spread(scene, line),
        path=line.path,
    )


def _value(scene: AnyScene, path: str) -> Any:
    value: Any = scene
    for part in path.split("."):
        value = getattr(value, part)
    return value


def _written(line: _SceneLine, value: Any) -> str:
    if line.dimension:
        values = value if isinstance(value, tuple) else (value,)
        unit = _suited_unit(line, *values)
        return ", ".join(format_quantity(each, line.dimension, unit) for each in values)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return ", ".join(_bend(item) if isinstance(item, Bend) else str(item) for item in value) or "none"
    return str(value)


def _bend(bend: Bend) -> str:
    radius = format_quantity(bend.radius, "length", "mm")
    return f"{format_quantity(bend.angle, 'angle', 'deg')} on {radius}"


def _spread(scene: Scene, line: _SceneLine) -> str:
    given = [
        each
        for each in scene.uncertainty
        if f"{UNCERTAIN_QUANTITIES[each.quantity]}.{each.quantity}" == line.path
    ]
    if given and not given[0].relative:
        width = given[0].half_width
        shown_width = format_quantity(width, line.dimension, line.shown.unit) if line.dimension else ""
        return shown_width or f"{width:g}"
    relative = {
        "liquid.density": scene.liquid.density_uncertainty,
        "liquid.kinematic_viscosity": scene.liquid.viscosity_uncertainty,
    }.get(line.path, given[0].half_width if given else 0.0)
    return f"{100 * relative:.3g} %" if relative else ""
