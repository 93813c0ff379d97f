"""A scene in words and engineering units, for the report and for messages about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import Shown, descriptions_of, keys_of
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.models import Bend, Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.registry import known_balancers
from ringbalance.scene.toml import toml_text
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES
from ringbalance.scene.units import DIMENSIONS, format_quantity, shortest_quantity


@dataclass(frozen=True, kw_only=True)
class _SceneLine:
    path: str
    shown: Shown
    dimension: str
    """Kind of quantity, such as "length"; empty without unit."""


_EXACT_DIGITS = 15
"""Significant digits of a value converted to its usual unit."""
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
"""Tables and single paths of each group."""


def _described_lines() -> Iterator[_SceneLine]:
    for name, table in LIQUID_RING.tables.items():
        keys = keys_of(table.record) if table.record is not None else {}
        for key, shown in descriptions_of(table.record).items() if table.record is not None else ():
            dimension = shown.dimension or (keys[key].takes.dimension if key in keys else None)
            yield _SceneLine(path=f"{name}.{key}", shown=shown, dimension=dimension or "")
    for path, shown in descriptions_of(Scene).items():
        yield _SceneLine(path=path, shown=shown, dimension=shown.dimension or "")


_LINES: Mapping[str, _SceneLine] = MappingProxyType({line.path: line for line in _described_lines()})


def scene_table(scene: Scene) -> list[dict[str, str]]:
    """A scene line by line, in groups, as texts by name; expanded uncertainties (95 %).

    A value that the file does not give has the origin "default".
    """
    liquid = scene.liquid
    sources = {"liquid.name": liquid.source}
    relative = {
        "liquid.density": liquid.density_uncertainty,
        "liquid.kinematic_viscosity": liquid.viscosity_uncertainty,
    }
    stated = {f"{UNCERTAIN_QUANTITIES[each.quantity]}.{each.quantity}": each for each in scene.uncertainty}
    rows = []
    for group, parts in _GROUPS.items():
        paths = (path for part in parts for path in _LINES if path == part or path.startswith(f"{part}."))
        for path in dict.fromkeys(paths):
            line, value = _LINES[path], _value(scene, path)
            if line.shown.only_for not in ("", scene.controller.kind) or (
                value is None and not line.shown.absent
            ):
                continue
            width = stated.get(path)
            if width is not None and not width.relative and line.dimension:
                uncertainty = format_quantity(width.half_width, line.dimension, line.shown.unit)
            elif width is not None and not width.relative:
                uncertainty = f"{width.half_width:g}"
            else:
                fraction = relative.get(path, width.half_width if width is not None else 0.0)
                uncertainty = f"{100 * fraction:.3g} %" if fraction else ""
            rows.append(
                {
                    "group": group,
                    "quantity": line.shown.name,
                    "value": line.shown.absent if value is None else _written(line, value),
                    "note": "; ".join(note for note in (line.shown.note, sources.get(path, "")) if note),
                    "origin": scene.origin_of(path),
                    "uncertainty": uncertainty,
                    "path": path,
                }
            )
    return rows


def _line_at(path: str) -> _SceneLine:
    """Description of a value of any kind of scene; named by its path where its declaration gives no name."""
    if path in _LINES:
        return _LINES[path]
    table, _, key = path.split("[")[0].partition(".")
    for kind in map(scene_kind, known_balancers()):
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
    return float(format_quantity(value, line.dimension, line.shown.unit, digits=_EXACT_DIGITS).split(" ")[0])


def setting_text(path: str, value: object) -> str:
    """Text of a scene value, given in SI, with its usual unit."""
    if value is None:
        return "none"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(setting_text(path, each) for each in value)
    if isinstance(value, float | int):
        line = _line_at(path)
        if line.dimension:
            return format_quantity(value, line.dimension, _suited_unit(line, value), digits=4)
        # Integers are counts or seeds: all digits matter.
        number = value if isinstance(value, int) else format(value, ".4g")
        return f"{number} {line.shown.unit}".rstrip()
    return str(value)


def _suited_unit(line: _SceneLine, *values: float) -> str:
    """The usual unit; seconds where minutes would need many digits."""
    unit = line.shown.unit
    texts = [shortest_quantity(each, unit) for each in values if each] if unit == "min" else []
    return "s" if any(text.endswith(" s") for text in texts) else unit


def scene_fault(scene: Scene, path: str, *, problem: str, allowed: str) -> Fault:
    """Error in a value of a loaded scene, detected after reading; to be raised in a `SceneError`."""
    table, key = path.split(".")
    written = toml_text(_written(_line_at(path), _value(scene, path)))
    return Fault(file=scene.file, table=table, key=key, value=written, problem=problem, allowed=allowed)


def scene_lines(scene: AnyScene) -> Iterator[str]:
    """Main values of a scene with their paths, as lines of text."""
    for paths in scene_kind(scene.balancer).main:
        yield ", ".join(f"{path} {setting_text(path, _value(scene, path))}" for path in paths)


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
        texts = [
            f"{format_quantity(each.angle, 'angle', 'deg')} on {format_quantity(each.radius, 'length', 'mm')}"
            if isinstance(each, Bend)
            else str(each)
            for each in value
        ]
        return ", ".join(texts) or "none"
    return str(value)
