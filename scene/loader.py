"""From a file to a scene, or to everything that is wrong with it."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from importlib import resources
from os import PathLike
from pathlib import Path, PurePath
from typing import Any

from ringbalance.scene.build import built
from ringbalance.scene.checks import cross_faults
from ringbalance.scene.defaults import completed
from ringbalance.scene.eccentric import built_eccentric, read_eccentric
from ringbalance.scene.eccentric_schema import EccentricTables
from ringbalance.scene.faults import Fault, SceneError, closest, did_you_mean, toml_text
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.reading import Reading, Schema, read_document, table_names
from ringbalance.scene.requirements import missing_faults
from ringbalance.scene.schema import BALANCERS
from ringbalance.scene.working_liquid import with_liquid

_LARGEST_FILE = 2**20


def load_scene(path: str | PathLike[str]) -> AnyScene:
    """Read a scene file (TOML), with its units, defaults and cross-checks.

    Args:
        path: the file.

    Returns:
        The scene, in SI.

    Raises:
        SceneError: the file cannot be read, or anything in it is wrong; all of it is said at once.
    """
    name = str(path)
    file = name if name.isprintable() else toml_text(name)
    return scene_from(content=_content(name, file), file=file)


def scene_from(*, content: bytes, file: str) -> AnyScene:
    """Make a scene from the bytes of a scene file.

    Args:
        content: the file's bytes, UTF-8.
        file: its name, for messages and the scene's `source`.

    Returns:
        The scene, in SI.

    Raises:
        SceneError: anything in it is wrong; all of it is said at once.
    """
    document = _document(content, file)
    reading, found = _READ[_kind(document)](document, file=file)
    if found:
        raise SceneError(sorted(found, key=lambda fault: _place(fault, reading.schema)))
    source, sha256 = PurePath(file).name, hashlib.sha256(content).hexdigest()
    if reading.schema is EccentricTables:
        return built_eccentric(reading, source=source, sha256=sha256)
    return built(reading, source=source, sha256=sha256)


def _read_liquid_ring(document: Mapping[str, Any], *, file: str) -> tuple[Reading, tuple[Fault, ...]]:
    reading, faults = read_document(document, file=file)
    reading, liquid_faults = with_liquid(completed(reading))
    return reading, (*faults, *missing_faults(reading), *liquid_faults, *cross_faults(reading))


_READ = {"liquid_ring": _read_liquid_ring, "eccentric_mass": read_eccentric}


def _kind(document: Mapping[str, Any]) -> str:
    """The kind of balancer that the file names, or was meant to name."""
    word = document.get("balancer")
    return (closest(word, BALANCERS) if isinstance(word, str) else "") or BALANCERS[0]


def bundled_scene(name: str) -> Path:
    """Find a scene that comes with the program.

    Args:
        name: such as "liquid_ring_paper".

    Returns:
        Path of the file.

    Raises:
        SceneError: there is no scene of that name.
    """
    folder = Path(str(resources.files("ringbalance.scenes")))
    names = sorted(path.stem for path in folder.glob("*.toml"))
    stem = name.removesuffix(".toml")
    if stem not in names:
        problem = f"no scene of that name comes with the program{did_you_mean(stem, names)}"
        raise SceneError([_whole(name, problem, ", ".join(names))])
    return folder / f"{stem}.toml"


def _place(fault: Fault, schema: Schema) -> tuple[int, int]:
    """Faults stand in the order of the reference of the scene file; what it does not know comes last."""
    tables = ("", *table_names(schema))
    table = tables.index(fault.table) if fault.table in tables else len(tables)
    model: Any = schema if not fault.table else None
    if fault.table in tables[1:]:
        model = schema.model_fields[fault.table].annotation
    keys = list(model.model_fields) if model is not None else []
    key = fault.key.split("[")[0].split(".")[0]
    return table, keys.index(key) if key in keys else len(keys)


def _whole(file: str, problem: str, allowed: str = "", *, key: str = "", value: str = "") -> Fault:
    return Fault(file=file, table="", key=key, value=value, problem=problem, allowed=allowed)


def _content(name: str, file: str) -> bytes:
    try:
        with open(name, "rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except FileNotFoundError as error:
        raise SceneError([_whole(file, "there is no such file")]) from error
    except IsADirectoryError as error:
        raise SceneError([_whole(file, "this is a folder, not a scene file", "a TOML file")]) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise SceneError([_whole(file, f"the file cannot be read: {reason}")]) from error
    if len(content) > _LARGEST_FILE:
        raise SceneError([_whole(file, "the file is larger than any scene", "a TOML file up to 1 MiB")])
    return content


def _document(content: bytes, file: str) -> Mapping[str, Any]:
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = f"line {line} is not UTF-8 text; save the file with UTF-8 encoding"
        raise SceneError([_whole(file, problem)]) from error
    except (ValueError, RecursionError) as error:
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
        problem = f"this is not TOML: {' '.join(reason.split())}"
        raise SceneError([_whole(file, problem)]) from error
