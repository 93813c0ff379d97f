"""Changed scenes: the document gets other values and is read again with all checks of a file.

A record that was changed in any other way still has the hash, the origins and the derived defaults of its
file, and nothing has checked it: `checked_scene` refuses it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Final

from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.keys.declaration import Entries, Key, descriptions_of
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.keys.reading import SceneInput
from ringbalance.scene.keys.schema import ORIGIN, Schema
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.loader import CHANGED, nameless_scene, scene_of
from ringbalance.scene.loop_models import ControllerSettings
from ringbalance.scene.narrowing import AnyScene, Kind, scene_as
from ringbalance.scene.origins import KEY_OF_FIELD, CheckedValues, Origin, SceneFile, raw_value_at
from ringbalance.scene.toml import toml_bytes, toml_text
from ringbalance.scene.uncertain import NORMAL_95
from ringbalance.scene.units import DIMENSIONS, plain_number, written_like
from ringbalance.scene.valves import FLOWS, find_valve

_OF_MESH: Final = ("disc", "accuracy.tolerance")
"""Paths on which reading a mesh, or meshing a solid, depends."""
_OF_CHECKS: Final = (*_OF_MESH, "tube.port_radius", "gas.inlet_radius", "disc.gas_hole_radius")
"""Paths whose values a mesh is checked against when it is read."""


def with_values(scene: SceneFile, values: Mapping[str, object], *, origin: Origin = "given") -> AnyScene:
    """The scene whose document has other values.

    Args: `values`: by path, see `SceneFile.with_values`. `origin`: of all these values.
    Raises: SceneError: all errors of the result, or a scene that `checked_scene` refuses.
    """
    return _changed(scene, _known(checked_scene(scene)), values, origin)


def _changed(
    scene: SceneFile, checked: CheckedValues, values: Mapping[str, object], origin: Origin
) -> AnyScene:
    document = _changed_document(scene, checked, values, origin)
    if document == checked.document:
        return scene
    changed = scene_of(
        _input(scene, checked, document, values),
        source=scene.source.removesuffix(CHANGED) + CHANGED,
        sha256=lambda: _digest(document, checked),
        before=checked,
    )
    return _with_same_mesh(scene, changed, values)


def nameless(scene: Kind, values: Mapping[str, object]) -> tuple[Kind, str]:
    """The scene of `with_values` without names, hashes and origins, and the SHA-256 that it would have.

    For thousands of designs: unchanged tables are neither read nor built again.
    Args: `scene`: one that `checked_scene` passes. `values`: see `SceneFile.with_values`.
    Raises: SceneError: as `with_values`.
    """
    checked = _known(scene)
    document = _changed_document(scene, checked, values, "given")
    changed = nameless_scene(_input(scene, checked, document, values), checked)
    digest = scene.sha256 if document == checked.document else _digest(document, checked)
    return scene_as(type(scene), _with_same_mesh(scene, changed, values)), digest


def _input(
    scene: SceneFile, checked: CheckedValues, document: Mapping[str, Any], values: Iterable[str]
) -> SceneInput:
    derived = {} if _concerned(_OF_CHECKS, values) else checked.derived
    return SceneInput(document=document, file=scene.file, folder=checked.folder, derived=derived)


def _digest(document: Mapping[str, Any], checked: CheckedValues) -> str:
    return hashlib.sha256(toml_bytes(document, checked.texts)).hexdigest()


def _changed_document(
    scene: SceneFile, checked: CheckedValues, values: Mapping[str, object], origin: Origin
) -> dict[str, Any]:
    """The document with other values; unchanged tables stay the same objects."""
    schema, document = scene_kind(scene.balancer).schema, dict(checked.document)
    for path, value in values.items():
        if not isinstance(path, str):
            raise TypeError(f'a value is named by its path, such as "tube.bore", and not by {path!r}')
        _place(document, path, value, schema=schema, origin=origin)
        flows = {f"gas.{key}" for key in (*FLOWS, "valve")}
        if path not in flows or value is None:
            continue
        # A named valve brings its own critical ratio and lag; any other flow keeps those of the valve before.
        valve, left = find_valve(str(value)) if path == "gas.valve" else None, "valve" in document["gas"]
        for key in ("critical_ratio", "valve_lag"):
            if values.get(f"gas.{key}") is not None:
                continue
            if valve is not None and (key == "critical_ratio" or getattr(valve, key) is not None):
                _place(document, f"gas.{key}", None, schema=schema, origin=origin)
            elif left and (number := raw_value_at(scene, f"gas.{key}")) is not None:
                stays = scene.origin_of(f"gas.{key}") == "assumed"
                _place(document, f"gas.{key}", number, schema=schema, origin="assumed" if stays else origin)
        for other in sorted(flows - {path}):
            _place(document, other, None, schema=schema, origin=origin)
    return document


def _with_same_mesh(scene: SceneFile, changed: AnyScene, values: Mapping[str, object]) -> AnyScene:
    """The changed scene. Raises: SceneError: the mesh file has changed since the scene was read."""
    if not _concerned(_OF_MESH, values) and changed.mesh_digest != scene.mesh_digest:
        fault = Fault(
            file=scene.file,
            table="disc",
            key="mesh",
            value=toml_text(_known(scene).document["disc"]["mesh"]),
            problem="the file has changed since the scene was read",
            allowed="ringbalance.load_scene(path) again",
        )
        raise SceneError([fault])
    return changed


def _concerned(concern: Iterable[str], values: Iterable[str]) -> bool:
    return any(path == each or path.startswith(f"{each}.") for path in values for each in concern)


def rechecked(scene: AnyScene) -> AnyScene:
    """A scene changed by a calculation, such as tuning, read again and checked as by `with_values`.

    The changed values have the origin "inferred".
    Raises: SceneError: a changed value that no scene file could have.
    """
    values = dict(_changed_values(scene))
    return _changed(scene, _known(scene), values, "inferred") if values else scene


def checked_scene(scene: SceneFile) -> AnyScene:
    """Refuse a scene whose values are not those that were checked as it was read or changed.

    Raises: SceneError: a record made or changed in another way; one error for each value that differs.
    Raises: TypeError: no scene.
    """
    if not isinstance(scene, SceneFile):
        what = type(scene).__name__
        raise TypeError(f"a scene is needed, such as ringbalance.load_scene(path), and not {what}")
    faults = []
    for path, value in _changed_values(scene):
        table, _, key = path.rpartition(".")
        plain = value is None or isinstance(value, str | float | int)
        problem = "the record was changed, so nothing has checked it and its hash is that of another scene"
        allowed = f'scene.with_values({{"{path}": ...}}), which checks as a file is checked'
        shown = toml_text(value if plain else str(value))
        fault = Fault(file=scene.file, table=table, key=key, value=shown, problem=problem, allowed=allowed)
        faults.append(fault)
    if faults:
        raise SceneError(faults)
    return scene


def document_of(scene: SceneFile) -> Mapping[str, Any]:
    """The scene's document, parsed from TOML. Raises: SceneError: a scene that was made without checks."""
    return _known(scene).document


def file_text(scene: SceneFile, *, to: Path, all_keys: bool = False) -> bytes:
    """Bytes of a scene file for a folder; the path of a mesh becomes relative to that folder.

    Args: `all_keys`: True to keep settings that only another control algorithm reads.
    Raises: SceneError: a scene made without the checks of a file.
    """
    checked = _known(scene)
    document = deepcopy(dict(checked.document))
    if mesh := document.get("disc", {}).get("mesh"):
        document["disc"]["mesh"] = Path(os.path.relpath(checked.folder / mesh, to)).as_posix()
    settings = checked.parts.get("controller")
    if isinstance(settings, ControllerSettings) and not all_keys:
        content = document.get("controller", {})
        for key, shown in descriptions_of(ControllerSettings).items():
            if shown.only_for not in ("", settings.kind):
                content.pop(key, None)
                content.get(ORIGIN, {}).pop(key, None)
    return toml_bytes(document)


def _known(scene: SceneFile) -> CheckedValues:
    """Checked values of a scene. Raises: SceneError: a scene made without the checks of a file."""
    if scene.checked is None:
        allowed = "ringbalance.load_scene(path), and with_values to change what it gives"
        raise SceneError.of_file(scene.file, "this scene was made without the checks of a file", allowed)
    return scene.checked


def _changed_values(scene: SceneFile) -> Iterator[tuple[str, object]]:
    """Path and value of each key that differs from its checked value."""
    for name, before in _known(scene).parts.items():
        now = getattr(scene, name)
        if now is before:
            continue
        if is_dataclass(now) and type(now) is type(before):
            for field in fields(now):
                path, value = f"{name}.{field.name}", getattr(now, field.name)
                # Meshes compare by their digest alone, whatever their nodes: only identity counts.
                comparable = not isinstance(value, ChamberGeometry)
                checked = getattr(before, field.name)
                if value is not checked and not (comparable and value == checked):
                    yield KEY_OF_FIELD.get(path, path), value
        elif now != before:
            yield KEY_OF_FIELD.get(name, name), now


def _place(document: dict[str, Any], path: str, value: object, *, schema: Schema, origin: Origin) -> None:
    """Put a value into a document, or remove it for None; values that no key takes are refused on reading.

    Tables on the path are copied, since other documents may share them.
    """
    *steps, name = path.split(".")
    content, keys = document, schema.top
    for count, step in enumerate(steps):
        default = keys[step].presence.default if step in keys else None
        keys = schema.keys_in(steps[: count + 1])
        inside = content.get(step, default if isinstance(default, Mapping) else {})
        if not isinstance(inside, Mapping):
            content[".".join((*steps[count:], name))] = value
            return
        content[step] = dict(inside)
        content = content[step]
    if value is None and (name in keys or path in schema.tables):
        content.pop(name, None)
    else:
        takes = (
            schema.tables[path].keys if path in schema.tables else keys[name].takes if name in keys else None
        )
        dimension = takes.dimension if isinstance(takes, ValueReader) else None
        try:
            value, deviation = plain_number(value, DIMENSIONS[dimension].si_unit if dimension else "")
        except ValueError:
            # A quantity that no key takes is kept as text, so that reading reports the error.
            value, deviation = str(value), 0.0
        content[name] = _written(value, takes, like=content.get(name, _as_usual(keys.get(name))))
        if deviation:
            width = _written(NORMAL_95 * deviation, takes)
            _place(document, f"uncertainty.{name}", width, schema=schema, origin=origin)
    if steps and ORIGIN not in (name, *steps[1:]):
        # The origin of the changed value replaces that of the previous value.
        table, key = document[steps[0]], (*steps[1:], name)[0]
        before = table.pop(ORIGIN, {})
        stated = (
            {other: each for other, each in before.items() if other != key}
            if isinstance(before, Mapping)
            else {}
        )
        if value is not None and origin != "given":
            stated[key] = origin
        if stated:
            # An unchanged table of origins stays the same object and is not read again.
            table[ORIGIN] = before if stated == before else stated


def _as_usual(key: Key | None) -> str | None:
    """One unit of a key as text, such as "1 mm"; None without a usual unit."""
    return f"1 {key.usual_unit}" if key is not None and key.usual_unit else None


def _written(
    value: Any, takes: ValueReader | Entries | Mapping[str, Key] | None, *, like: object = None
) -> Any:
    """A value as a scene file states it; a plain number for a quantity with a unit is in SI.

    Args: `like`: present or usual text of the quantity, whose unit is kept.
    """
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, Mapping):
        keys = takes.keys if isinstance(takes, Entries) else takes if isinstance(takes, Mapping) else {}
        return {
            name: _written(each, key.takes if (key := keys.get(name)) else None, like=_as_usual(key))
            for name, each in value.items()
        }
    if isinstance(value, list | tuple):
        each_written = [_written(each, takes, like=like) for each in value]
        single = isinstance(takes, ValueReader) and takes.one_for_all and len(value) == 1
        return each_written[0] if single else each_written
    dimension = takes.dimension if isinstance(takes, ValueReader) else None
    if dimension is None or isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return written_like(value, like, dimension)
