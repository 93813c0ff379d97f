"""Read a file into a scene, or report all its errors."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, replace
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path, PurePath
from typing import Any, Final

from ringbalance.scene.faults import Fault, SceneError, did_you_mean
from ringbalance.scene.keys.reading import SceneInput, SceneReading
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import VECTOR_KEYS, CheckedValues, InputUncertainty, ShownOrigin
from ringbalance.scene.platform.display import LOG
from ringbalance.scene.platform.files import read_bounded
from ringbalance.scene.registry import has_balancer, installed_balancers, known_balancers
from ringbalance.scene.rules.fitted import fitted_faults
from ringbalance.scene.toml import read_toml, toml_text

_LARGEST_FILE_BYTES = 2**20
_DECIDE_NOTHING = ("requirement.", "design.", "measured.", "rotor.mass", "liquid.source", "gas.valve_source")
"""Values that no result depends on."""
CHANGED: Final = ", changed"
"""Suffix of `source` for a scene whose values were changed after reading."""


def load_scene(path: str | PathLike[str]) -> AnyScene:
    """The scene of a scene file (TOML), in SI, with its units, defaults and cross-checks.

    Raises: SceneError: a file that cannot be read, or all errors in it together.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> scene.tube.bore
        0.0015
    """
    return read_scene(path)[0]


def read_scene(path: str | PathLike[str]) -> tuple[AnyScene, str]:
    """The scene of a file and the file's own text, read once: a pipe gives its bytes only once.

    Raises: SceneError: as `load_scene`.
    """
    name, bundled = str(path), _bundled()
    # A file of the user's own precedes a scene of its name that comes with the program.
    location = Path(name)
    if (of_program := bundled.get(name.removesuffix(".toml"))) and not location.exists():
        name, location = of_program.name, of_program
    file = name if name.isprintable() else toml_text(name)
    content, problem = read_bounded(location, what="scene file", most=_LARGEST_FILE_BYTES)
    if problem:
        other = f"{location.name}.toml"
        hint = f' (as "{other}")' if location.name in bundled else did_you_mean(name, bundled)
        names = ", ".join(bundled)
        raise SceneError.of_file(
            file, problem, f"a TOML file, or a scene that comes with the program: {names}{hint}"
        )
    scene = scene_from(content=content, file=file, folder=location.parent)
    if scene.remark:
        LOG.warning("%s: %s", file, scene.remark)
    return scene, content.decode("utf-8-sig")


def scene_from(*, content: bytes, file: str, folder: Path | None = None) -> AnyScene:
    """The scene of a scene file's bytes, in SI; `file` is its name, for messages and the scene's `source`.

    Args: `folder`: folder of the files that the scene names; default that of `file`.
    Raises: SceneError: all errors in the file.
    """
    try:
        document = read_toml(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = f"line {line} is not UTF-8 text; save the file with UTF-8 encoding"
        raise SceneError.of_file(file, problem) from error
    except (ValueError, RecursionError) as error:
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise SceneError.of_file(file, f"this is not TOML: {' '.join(reason.split())}") from error
    mesh_folder = (Path(file).parent if folder is None else folder).absolute()
    return scene_of(
        SceneInput(document=document, file=file, folder=mesh_folder),
        source=PurePath(file).name,
        sha256=lambda: hashlib.sha256(content).hexdigest(),
    )


def scene_of(
    content: SceneInput, *, source: str, sha256: Callable[[], str], before: CheckedValues | None = None
) -> AnyScene:
    """The scene of a document.

    Args: `sha256`: called if there is no error. `before`: checked values of the scene whose document was
        changed.
    Raises: SceneError: all errors in the document.
    """
    reading = _checked_reading(content, before)
    decisive = {
        path: value.digest if path == "disc.geometry" else value
        for path, value in reading.values.items()
        if path != "name"
        and not path.startswith("disc.mesh")
        and not path.endswith(f".{ORIGIN}")
        and not path.startswith(_DECIDE_NOTHING)
    }
    following = reading.derived | reading.converted
    # Properties looked up for a known liquid are not defaults.
    defaulted = tuple(
        path
        for path in reading.values
        if not reading.given(path)
        and path not in following
        and (not path.startswith("liquid.") or path == "liquid.dissolved_gas")
    )
    origins: list[tuple[str, ShownOrigin]] = []
    for name, table in reading.schema.tables.items():
        stated = reading.values.get(f"{name}.{ORIGIN}", {})
        for key in (key for key in table.keys if key != ORIGIN):
            absent: ShownOrigin = "derived" if (path := f"{name}.{key}") in following else "default"
            absent = "assumed" if path in reading.assumed else absent
            origins.append((path, stated.get(key, "given") if reading.given(path) else absent))
    parts: dict[str, Any] = {
        **_records(reading, before),
        "name": reading.values["name"],
        "source": source,
        "file": content.file,
        "sha256": sha256(),
        "values_sha256": hashlib.sha256(repr(sorted(decisive.items())).encode()).hexdigest(),
        "defaulted": defaulted,
        "origins": tuple(origins),
    }
    of_mesh = {path: reading.values[path] for path in reading.derived}
    checked = CheckedValues(
        document=content.document, folder=content.folder, parts=parts, derived=of_mesh, tables=reading.tables
    )
    scene: AnyScene = reading.schema.scene(**parts, checked=checked)
    return scene


def nameless_scene(content: SceneInput, before: CheckedValues) -> AnyScene:
    """Make a scene as `scene_of` does, without names, hashes and origins: several times faster."""
    reading = _checked_reading(content, before)
    names = dict.fromkeys(("name", "source", "sha256"), "")
    scene: AnyScene = reading.schema.scene(**_records(reading, before), **names, file=content.file)
    return scene


def _checked_reading(content: SceneInput, before: CheckedValues | None) -> SceneReading:
    """Checked values of a document.

    Raises: SceneError: errors in the order of the reference of the scene file, unknown keys last.
    """
    kind, file = _kind(content), content.file
    if before and before.document.get("balancer") == content.document.get("balancer"):
        content = replace(content, before=before.tables)
    reading, read_faults = scene_kind(kind).read(content)
    schema, faults = reading.schema, list(read_faults)
    faulty = {(fault.table, fault.key) for fault in faults}
    for name in schema.tables:
        table = reading.tables[name].content
        for key, origin in reading.values.get(f"{name}.{ORIGIN}", {}).items():
            if key not in table and (name, key) not in faulty:
                fault = Fault(
                    file=file,
                    table=name,
                    key=f"{ORIGIN}.{key}",
                    value=toml_text(origin),
                    problem=f"the file gives no {key}, so it has no origin",
                    allowed=f"a table with {key}, or no origin of it",
                )
                faults.append(fault)
    faults += fitted_faults(reading)
    if faults:
        keys = {"": schema.names_at(()), **{name: list(each.keys) for name, each in schema.tables.items()}}

        def rank(fault: Fault) -> tuple[int, int]:
            names, key = keys.get(fault.table, []), fault.key.split("[")[0].split(".")[0]
            table = list(keys).index(fault.table) if fault.table in keys else len(keys)
            return table, names.index(key) if key in names else len(names)

        raise SceneError(sorted(faults, key=rank))
    return reading


def _records(reading: SceneReading, before: CheckedValues | None) -> dict[str, Any]:
    """Values that results depend on: tolerance, uncertainties, and a record of each table.

    A record's fields are named after keys; an absent key has the default or None.  A table with the values of
    `before` keeps that record, so that comparing thousands of scenes costs little.
    """
    values: dict[str, Any] = dict(reading.values)
    for field_path, key in VECTOR_KEYS.items():
        if (vector := values.get(key)) is not None:
            values[field_path] = getattr(vector, field_path.rpartition("_")[2])
    parts_before = before.parts if before else {}
    records = {}
    for name, table in reading.schema.tables.items():
        if (kind := table.record) is None:
            continue
        field_values = {field: values.get(path, absent) for field, path, absent in _fields(kind, name)}
        record = parts_before.get(name)
        # Anything but a float, such as a mesh, is compared by identity alone.
        if type(record) is not kind or not all(
            value is (other := getattr(record, key))
            or (type(value) is type(other) is float and value == other)
            for key, value in field_values.items()
        ):
            record = kind(**field_values)
        records[name] = record
    result = {**records, "tolerance": values["accuracy.tolerance"]}
    if before is not None and before.tables.get("uncertainty") is reading.tables["uncertainty"]:
        return {**result, "uncertainty": parts_before["uncertainty"]}
    uncertainty = []
    for key in reading.schema.tables["uncertainty"].keys:
        stated = values.get(f"uncertainty.{key}")
        if stated is None or key == ORIGIN:
            continue
        # Names are "table.key" where [uncertainty] has a subtable for each table.
        of_table = isinstance(stated, dict)
        widths = {f"{key}.{name}": each for name, each in stated.items()} if of_table else {key: stated}
        for quantity, (width, relative) in widths.items():
            uncertainty.append(InputUncertainty(quantity=quantity, half_width=width, relative=relative))
    return {**result, "uncertainty": tuple(uncertainty)}


@cache
def _fields(kind: type, table: str) -> tuple[tuple[str, str, Any], ...]:
    """Name, path and value of an absent key for each field of a table's record."""
    return tuple(
        (each.name, f"{table}.{each.name}", None if each.default is MISSING else each.default)
        for each in fields(kind)
    )


def _kind(content: SceneInput) -> str:
    """Kind of balancer: the file's word, or the default."""
    if "balancer" not in content.document:
        return known_balancers()[0]
    return balancer_name(content.document["balancer"], file=content.file)


def balancer_name(word: object, *, file: str, key: str = "balancer") -> str:
    """The word of a key or an option that names an installed balancer.

    Raises: SceneError: none of that name is installed; what else the file holds cannot be judged then.
    """
    if isinstance(word, str) and has_balancer(word):
        return word
    packages = installed_balancers()
    names = dict.fromkeys([*known_balancers(), *packages])
    fault = Fault(
        file=file,
        key=key,
        value=toml_text(word),
        problem="no balancer of this name is installed"
        + (did_you_mean(word, names) if isinstance(word, str) else ""),
        allowed=", ".join(
            f'"{name}"' + (f" (of {packages[name]})" if name in packages else "") for name in names
        ),
    )
    raise SceneError([fault])


def bundled_scene(name: str) -> Path:
    """Path of a scene that comes with the program, such as "liquid_ring_paper". Raises: SceneError.

    Example:
        >>> rb.bundled_scene("six_chamber").name
        'six_chamber.toml'
    """
    stem, bundled = name.removesuffix(".toml"), _bundled()
    if stem not in bundled:
        problem = f"no scene of that name comes with the program{did_you_mean(stem, bundled)}"
        raise SceneError.of_file(name, problem, ", ".join(bundled))
    return bundled[stem]


@cache
def _bundled() -> Mapping[str, Path]:
    """Scenes that come with the program, by name."""
    folder = Path(str(resources.files("ringbalance.scenes")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
