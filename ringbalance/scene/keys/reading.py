"""Reading of a TOML document by the declared keys: values, and an error for each that cannot be read.

An absent value is derived from others where a default says so; else it is an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any, Literal

from ringbalance.scene.faults import MISSING, Fault, closest, meant_text
from ringbalance.scene.keys.declaration import Entries, Key
from ringbalance.scene.keys.schema import KeyPath, Schema
from ringbalance.scene.registry import known_balancers, registered
from ringbalance.scene.toml import toml_key, toml_text
from ringbalance.scene.units import FieldError, format_quantity

_MOST_GUESSED_KEYS = 100
"""Most unknown keys of a file for which the intended key is guessed; each takes a third of a millisecond."""


@dataclass(frozen=True, kw_only=True)
class _Rejected:
    """A value, key or table that could not be read."""

    steps: KeyPath
    content: object
    """Value in the file."""
    kind: Literal["value", "missing", "unknown"] = "value"
    problem: str = ""
    allowed: str = ""


@dataclass(frozen=True, kw_only=True)
class TableRead:
    """One table of a document with its values, reused for the same object in a later document."""

    content: Any
    """Content parsed from TOML; None for a missing table."""
    values: Mapping[str, Any]
    """SI values by path, standard defaults included."""
    rejected: tuple[_Rejected, ...]


@dataclass(frozen=True, kw_only=True)
class SceneInput:
    """A document to be read into a scene."""

    document: Mapping[str, Any]
    """Content of a scene file, parsed from TOML."""
    file: str
    """Name of the file, for messages."""
    folder: Path
    """Folder from which a mesh is read."""
    derived: Mapping[str, Any] = field(default_factory=dict)
    """Values by path already read from the mesh; empty: the mesh is read."""
    before: Mapping[str, TableRead] = field(default_factory=dict)
    """Tables of the document from which this one was made."""

    def read(self, schema: Schema) -> tuple[SceneReading, tuple[Fault, ...]]:
        """Values by the declared keys, and an error for each value, key or table that cannot be read."""
        return read_document(self.document, file=self.file, schema=schema, before=self.before)


@dataclass(frozen=True, kw_only=True)
class SceneReading:
    """Content of a scene file as read so far; paths are "table.key", or "key" at the top level."""

    file: str
    """Name of the file, for messages."""
    document: Mapping[str, Any]
    """Content of the file, parsed from TOML."""
    values: Mapping[str, Any]
    """SI values by path, defaults included, without keys that do not apply or could not be read."""
    broken: frozenset[str]
    """Paths and names of whole tables in the file that could not be read."""
    schema: Schema
    """Keys and tables of this kind of file."""
    derived: frozenset[str] = frozenset()
    """Paths of values from another file, such as a mesh, that this one names."""
    converted: frozenset[str] = frozenset()
    assumed: frozenset[str] = frozenset()
    """Paths of values that follow from another key, such as a valve's name."""
    tables: Mapping[str, TableRead] = field(default_factory=dict)
    """Tables of the document, by name."""

    def adding(self, values: Mapping[str, Any]) -> SceneReading:
        """Copy with more values, SI, by path."""
        return replace(self, values={**self.values, **values})

    def following(self, values: Mapping[str, Any]) -> SceneReading:
        """Copy with more values from another file."""
        return replace(self.adding(values), derived=self.derived | frozenset(values))

    def converting(self, values: Mapping[str, Any]) -> SceneReading:
        """Copy with more values that follow from other keys of the file."""
        return replace(self.adding(values), converted=self.converted | frozenset(values))

    def assuming(self, values: Mapping[str, Any]) -> SceneReading:
        """Copy with more values that are chosen, as nothing is known of them."""
        return replace(self.adding(values), assumed=self.assumed | frozenset(values))

    def given(self, path: str) -> bool:
        """True when the file itself has a value at a path, readable or not."""
        table, _, key = path.rpartition(".")
        return key in self._table(table)

    def known(self, *paths: str) -> bool:
        """True when there is a value for each path, read or by default."""
        return self.values.keys() >= {*paths}

    def lacks(self, path: str) -> bool:
        """True when a value is missing; False when it is present but unreadable."""
        return path not in self.values and not {path, path.rpartition(".")[0]} & self.broken

    def allowed(self, path: str) -> str:
        """Values that a key takes, for messages."""
        return self.schema.key_at(tuple(path.split("."))).takes.allowed

    def fault(self, path: str, *, problem: str, allowed: str) -> Fault:
        """An error about a value, with the text in the file or the default."""
        table, _, key = path.rpartition(".")
        if self.given(path):
            value = toml_text(self._table(table)[key])
        elif not self.known(path):
            value = MISSING
        else:
            default, declared = self.values[path], self.schema.key_at(tuple(path.split(".")))
            if isinstance(default, float) and declared.takes.dimension is not None:
                default = format_quantity(default, declared.takes.dimension, declared.usual_unit)
            source = "from the mesh" if path in self.derived else "by default"
            value = f"{toml_text(default)} ({source})"
        return Fault(file=self.file, table=table, key=key, value=value, problem=problem, allowed=allowed)

    def missing(self, path: str, problem: str = "every scene needs it") -> Fault:
        """An error about a missing value."""
        return self.fault(path, problem=problem, allowed=self.allowed(path))

    def _table(self, table: str) -> Mapping[str, Any]:
        content = self.document.get(table, {}) if table else self.document
        # A check against Mapping takes ten times as long, and rules call this for thousands of scenes.
        return content if isinstance(content, dict) else {}

    def completed(self) -> SceneReading:
        """Fill in the defaults that are derived from other known values.

        A key is declared after those from which its default is derived, so that their values are known first;
        a needed key is derived from values in the file.
        """
        values = dict(self.values)
        if self.lacks("name"):
            values["name"] = PurePath(self.file).stem or "scene"
        for path, presence in self.schema.following:
            if path not in values and self.lacks(path) and values.keys() >= {*presence.needs}:
                needs = (*presence.needs, *presence.also)
                result = presence.value(*(values.get(need) for need in needs))
                if result is not None:
                    values[path] = result
        return replace(self, values=values)

    def missing_faults(self) -> Iterator[Fault]:
        """One error for each missing key, defaults included; one for a whole table that is missing."""
        for name, keys in self.schema.needed.items():
            if not keys and name != "liquid":
                continue
            if self.given(name):
                for key in keys:
                    needs = self.schema.key_at((name, key)).presence.needs
                    # What would follow from a value that cannot be read is not missing.
                    if self.lacks(path := f"{name}.{key}") and not self.broken & {*needs}:
                        others = (need.split(".")[1] for need in needs)
                        yield self.missing(path, " or ".join(["every scene needs it", *others]))
            elif name not in self.broken:
                inside = ", ".join(keys) or "name and temperature, or density and kinematic_viscosity"
                yield Fault(
                    file=self.file,
                    table=name,
                    value=MISSING,
                    problem="every scene needs this table",
                    allowed=f"a table with {inside}",
                )


def read_document(
    document: Mapping[str, Any], *, file: str, schema: Schema, before: Mapping[str, TableRead] | None = None
) -> tuple[SceneReading, tuple[Fault, ...]]:
    """Read a TOML document: values, and an error for each value, key or table that cannot be read.

    Args: `before`: tables of the document from which this one was made.
    """
    tables = {}
    for name, table in schema.tables.items():
        content, read = document.get(name), before.get(name) if before else None
        if read is None or read.content is not content:
            inside, wrong = _read_table({} if content is None else content, table.keys, (name,), read)
            by_path = {f"{name}.{key}": value for key, value in inside.items()}
            read = TableRead(content=content, values=by_path, rejected=tuple(wrong))
        tables[name] = read
    values, rejected = _read_keys(document, schema.top, ())
    for each in tables.values():
        values.update(each.values)
        rejected.extend(each.rejected)
    rejected += _unknown_keys(document, (*schema.top, *schema.tables), ())
    unknown = [each for each in rejected if each.kind == "unknown"][:_MOST_GUESSED_KEYS]
    meant = {each.steps: _meant(each, schema) for each in unknown}
    broken = {".".join(map(str, each.steps[:2])) for each in rejected}
    for steps, path in meant.items():
        table_name, _, key = path.rpartition(".")
        content = document.get(table_name, {}) if table_name else document
        if path and len(steps) <= 2 and not (isinstance(content, Mapping) and key in content):
            broken.add(path)
    if broken:
        values = {path: value for path, value in values.items() if not {path, path.split(".")[0]} & broken}
    reading = SceneReading(
        file=file, document=document, values=values, broken=frozenset(broken), schema=schema, tables=tables
    )
    # A misspelt key and the missing key that it was meant for are one error, not two.
    reported = [
        each
        for each in rejected
        if each.kind != "missing" or ".".join(map(str, each.steps)) not in meant.values()
    ]
    return reading, tuple(_fault(each, file, schema, meant=meant.get(each.steps)) for each in reported)


def _read_table(
    content: object, keys: Mapping[str, Key], steps: KeyPath, before: TableRead | None = None
) -> tuple[dict[str, Any], list[_Rejected]]:
    if not isinstance(content, Mapping):
        allowed = f"a table with {', '.join(keys)}"
        return {}, [_Rejected(steps=steps, content=content, problem="it is not a table", allowed=allowed)]
    values, rejected = _read_keys(content, keys, steps, before)
    return values, rejected + _unknown_keys(content, keys, steps)


def _read_keys(
    content: Mapping[str, Any], keys: Mapping[str, Key], steps: KeyPath, before: TableRead | None = None
) -> tuple[dict[str, Any], list[_Rejected]]:
    """Values of keys, defaults included; a key missing in an entry of another key is rejected at once."""
    values: dict[str, Any] = {}
    rejected: list[_Rejected] = []
    for name, key in keys.items():
        if name not in content and key.presence.default is None:
            if len(steps) > 1 and key.presence.kind == "needed":
                rejected.append(_Rejected(steps=(*steps, name), content=content, kind="missing"))
            continue
        content_of_key = content.get(name, key.presence.default)
        path = f"{steps[0]}.{name}" if steps else name
        # Values of the same object were read before.
        read = before is not None and path in before.values
        if before and read and (before.content or {}).get(name, key.presence.default) is content_of_key:
            values[name] = before.values[path]
            continue
        value, wrong = _read_value(content_of_key, key, (*steps, name))
        rejected += wrong
        if not wrong:
            values[name] = value
    return values, rejected


def _unknown_keys(content: Mapping[str, Any], known_names: Iterable[str], steps: KeyPath) -> list[_Rejected]:
    names = set(known_names)
    return [
        _Rejected(steps=(*steps, name), content=value, kind="unknown")
        for name, value in content.items()
        if name not in names
    ]


def _read_value(content: object, key: Key, steps: KeyPath) -> tuple[Any, list[_Rejected]]:
    takes = key.takes
    if not isinstance(takes, Entries):
        try:
            return takes.read(content), []
        except FieldError as error:
            wrong = _Rejected(steps=steps, content=content, problem=error.problem, allowed=error.allowed)
            return None, [wrong]
    if not takes.example:
        values, rejected = _read_table(content, takes.keys, steps)
        return (None if rejected else takes.record(**values)), rejected
    if not isinstance(content, list):
        problem = "it is not a list"
        return None, [_Rejected(steps=steps, content=content, problem=problem, allowed=takes.example)]
    read = [_read_table(entry, takes.keys, (*steps, count)) for count, entry in enumerate(content)]
    rejected = [each for _, wrong in read for each in wrong]
    return (None if rejected else tuple(takes.record(**values) for values, _ in read)), rejected


def _fault(rejected: _Rejected, file: str, schema: Schema, *, meant: str | None) -> Fault:
    """Error for a rejected value, key or table.

    Args: `meant`: path that an unknown key was probably meant for; None where none was searched.
    """
    steps, problem, allowed = rejected.steps, rejected.problem, rejected.allowed
    unknown_table = len(steps) == 1 and isinstance(rejected.content, Mapping)
    is_table = str(steps[0]) in schema.tables or unknown_table
    table, keys = (str(steps[0]), steps[1:]) if is_table else ("", steps)
    value = toml_text(rejected.content)
    if rejected.kind == "missing":
        problem, allowed, value = "it is needed here", schema.key_at(steps).takes.allowed, MISSING
    elif rejected.kind == "unknown":
        value = value if keys else ""
        problem, allowed = "unknown", ""
        if meant is not None:
            kind, names = (
                ("table", list(schema.tables)) if unknown_table else ("key", schema.names_at(steps[:-1]))
            )
            home, _, key = meant.rpartition(".")
            hint = meant_text(key) if meant else ""
            if meant and key == steps[-1]:
                hint = (
                    f" (it belongs in [{home}])"
                    if home
                    else " (it belongs at the top, before the first table)"
                )
            elif not meant and (home := _other_balancer(steps)):
                hint = f" (a scene of the balancer {home} has it)"
            problem, allowed = f"unknown {kind}{hint}", ", ".join(names)
    # Named as in "bends[2].radius"; entries of a list are counted from one.
    path = ""
    for step in keys:
        path += f"[{step + 1}]" if isinstance(step, int) else ("." if path else "") + toml_key(step)
    return Fault(
        file=file,
        table=table if table in schema.tables else toml_key(table) if table else "",
        key=path,
        value=value,
        problem=problem,
        allowed=allowed,
    )


def _other_balancer(steps: KeyPath) -> str:
    """Name of a balancer whose scenes have a key of a table; empty for none."""
    for name in known_balancers() if len(steps) == 2 else ():
        schema: Schema = registered("scene", name).schema
        if steps[1] in schema.keys_in([str(steps[0])]):
            return name
    return ""


def _meant(rejected: _Rejected, schema: Schema) -> str:
    """Path that an unknown key or table was probably meant for; empty when there is none."""
    steps = rejected.steps
    word = str(steps[-1])
    if len(steps) == 1 and isinstance(rejected.content, Mapping):
        return closest(word, schema.tables)
    if steps[0] != "uncertainty" and len(steps) <= 2:
        if word in schema.top:
            return word
        home = next((name for name, table in schema.tables.items() if word in table.keys), "")
        if home:
            return f"{home}.{word}"
    # In words the hump of a tube is the siphon's crest; no name of a key has that word.
    near = closest(word.replace("crest", "hump"), schema.names_at(steps[:-1]))
    return ".".join([*map(str, steps[:-1]), near]) if near else ""
