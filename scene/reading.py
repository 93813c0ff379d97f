"""A TOML document against the schema: what could be read, and a fault for everything that could not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from ringbalance.scene.faults import MISSING, Fault, closest, did_you_mean, toml_key, toml_text
from ringbalance.scene.fields import Reader
from ringbalance.scene.presence import note_of, presence_of
from ringbalance.scene.schema import SceneTables

Schema = type[BaseModel]


def table_names(schema: Schema) -> tuple[str, ...]:
    """Names of the tables of a kind of scene file.

    Args:
        schema: all of its tables.

    Returns:
        The names, in the order of the reference.
    """
    return tuple(name for name, field in schema.model_fields.items() if field.default_factory is not None)


TABLES: tuple[str, ...] = table_names(SceneTables)
"""Names of the tables of a liquid-ring scene."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What is known of a scene file so far; paths are "table.key", or "key" at the top level."""

    file: str
    """As it was named."""
    document: Mapping[str, Any]
    """As TOML has it."""
    values: Mapping[str, Any]
    """SI values by path, defaults included; absent are keys that do not apply or could not be read."""
    broken: frozenset[str]
    """Paths, and names of whole tables, that stand in the file but could not be read."""
    schema: Schema = SceneTables
    """What such a file can hold."""

    def adding(self, values: Mapping[str, Any]) -> Reading:
        """Copy with more values.

        Args:
            values: SI, by path.

        Returns:
            The copy.
        """
        return replace(self, values={**self.values, **values})

    def given(self, path: str) -> bool:
        """Tell whether the file itself has a value at a path.

        Args:
            path: "table.key" or "key".

        Returns:
            True when it stands in the file, readable or not.
        """
        table, _, key = path.rpartition(".")
        return key in self._table(table)

    def known(self, *paths: str) -> bool:
        """Tell whether there are values for some paths.

        Args:
            paths: "table.key" or "key".

        Returns:
            True when each was read or has a default.
        """
        return all(path in self.values for path in paths)

    def lacks(self, path: str) -> bool:
        """Tell whether a value is missing, rather than present but unreadable.

        Args:
            path: "table.key".

        Returns:
            True when a fault about its absence is due.
        """
        table, _, _ = path.rpartition(".")
        return not self.known(path) and not {path, table} & self.broken

    def fault(self, path: str, *, problem: str, allowed: str, part: str = "") -> Fault:
        """Make a fault about a value of this file.

        Args:
            path: "table.key" or "key".
            problem: what is wrong.
            allowed: what would be accepted.
            part: of the key, such as "[2].radius".

        Returns:
            The fault, with what the file has there or the default that stands in.
        """
        table, _, key = path.rpartition(".")
        value = toml_text(self._table(table)[key]) if self.given(path) else self._default_text(path)
        return Fault(
            file=self.file, table=table, key=key + part, value=value, problem=problem, allowed=allowed
        )

    def _table(self, table: str) -> Mapping[str, Any]:
        content = self.document.get(table, {}) if table else self.document
        return content if isinstance(content, Mapping) else {}

    def _default_text(self, path: str) -> str:
        return f"{toml_text(self.values[path])} (SI, by default)" if self.known(path) else MISSING


def read_document(
    document: Mapping[str, Any], *, file: str, schema: Schema = SceneTables
) -> tuple[Reading, tuple[Fault, ...]]:
    """Hold a document against the schema.

    Args:
        document: as TOML has it.
        file: name of the file, for the faults.
        schema: what such a file can hold.

    Returns:
        What could be read, and a fault for each value, key or table that could not.
    """
    tables, details = _validated(document, schema)
    if tables is None:
        # Without what is at fault the document passes, so that the rest of it can still be cross-checked.
        tables, _ = _validated(_without(document, [detail["loc"] for detail in details]), schema)
    if tables is None:
        raise RuntimeError("a scene without its faulty keys must pass the schema")
    broken = frozenset(_paths(details, document, schema))
    values = {
        path: value
        for path, value in _flat(tables, schema)
        if value is not None and not {path, path.split(".")[0]} & broken
    }
    reading = Reading(file=file, document=document, values=values, broken=broken, schema=schema)
    return reading, tuple(_fault(detail, file, schema) for detail in _told(details, schema))


def _told(details: list[ErrorDetails], schema: Schema) -> list[ErrorDetails]:
    """All but the missing keys that a misspelt one was meant for."""
    unknown = [detail["loc"] for detail in details if detail["type"] == "extra_forbidden"]
    meant = {_meant(place, False, schema) for place in unknown}
    return [
        detail
        for detail in details
        if detail["type"] != "missing" or ".".join(map(str, detail["loc"])) not in meant
    ]


def _paths(details: list[ErrorDetails], document: Mapping[str, Any], schema: Schema) -> Iterator[str]:
    """Paths at fault, and those that were meant by a misspelt or misplaced key: neither is missing."""
    for detail in details:
        place = detail["loc"]
        yield ".".join(map(str, place[:2]))
        if detail["type"] == "extra_forbidden" and len(place) <= 2:
            meant = _meant(place, isinstance(detail["input"], Mapping), schema)
            table, _, key = meant.rpartition(".")
            content = document.get(table, {}) if table else document
            if meant and not (isinstance(content, Mapping) and key in content):
                yield meant


def _validated(document: Mapping[str, Any], schema: Schema) -> tuple[BaseModel | None, list[ErrorDetails]]:
    try:
        return schema.model_validate(document), []
    except ValidationError as error:
        return None, error.errors(include_url=False)


def _without(document: Mapping[str, Any], places: list[tuple[int | str, ...]]) -> dict[str, Any]:
    whole = {str(place[0]) for place in places if len(place) == 1}
    keys = {place[:2] for place in places if len(place) > 1}
    return {
        table: {key: value for key, value in content.items() if (table, key) not in keys}
        if isinstance(content, Mapping)
        else content
        for table, content in document.items()
        if table not in whole
    }


def _flat(tables: BaseModel, schema: Schema) -> Iterator[tuple[str, Any]]:
    for name in schema.model_fields:
        content = getattr(tables, name)
        if name in table_names(schema):
            yield from ((f"{name}.{key}", getattr(content, key)) for key in type(content).model_fields)
        else:
            yield name, content


def _fault(detail: ErrorDetails, file: str, schema: Schema) -> Fault:
    place, tables = detail["loc"], table_names(schema)
    is_table = str(place[0]) in tables or (len(place) == 1 and isinstance(detail["input"], Mapping))
    table, keys = (str(place[0]), place[1:]) if is_table else ("", place)
    problem, allowed = _said(detail, schema)
    value = MISSING if detail["type"] == "missing" else toml_text(detail["input"])
    unknown_table = not keys and detail["type"] == "extra_forbidden"
    return Fault(
        file=file,
        table=table if table in tables else toml_key(table) if table else "",
        key=_key_text(keys),
        value="" if unknown_table else value,
        problem=problem,
        allowed=allowed,
    )


def _key_text(keys: tuple[int | str, ...]) -> str:
    """Name a key as in "bends[2].radius"; entries of a list are counted from one."""
    text = ""
    for key in keys:
        text += f"[{key + 1}]" if isinstance(key, int) else ("." if text else "") + toml_key(key)
    return text


def _said(detail: ErrorDetails, schema: Schema) -> tuple[str, str]:
    place = detail["loc"]
    if detail["type"] == "scene_field":
        return detail["ctx"]["problem"], detail["ctx"]["allowed"]
    if detail["type"] == "extra_forbidden":
        return _unknown(place, isinstance(detail["input"], Mapping), schema)
    if detail["type"] == "missing":
        return "it is needed here", allowed_at(place, schema)
    listed = "" if isinstance(place[-1], int) else note_of(_field_at(place, schema), "list")
    if listed:
        return "it is not a list", listed
    return "it is not a table", f"a table with {', '.join(_keys_at(place, schema))}"


def _unknown(place: tuple[int | str, ...], is_table: bool, schema: Schema) -> tuple[str, str]:
    whole = len(place) == 1 and is_table
    kind, known = ("table", list(table_names(schema))) if whole else ("key", _keys_at(place[:-1], schema))
    meant = _meant(place, is_table, schema)
    table, _, key = meant.rpartition(".")
    hint = ""
    if meant and key == place[-1]:
        hint = f" (it belongs in [{table}])" if table else " (it belongs at the top, before the first table)"
    elif meant:
        hint = did_you_mean(str(place[-1]), [key])
    return f"unknown {kind}{hint}", ", ".join(known)


def _meant(place: tuple[int | str, ...], is_table: bool, schema: Schema) -> str:
    """Path that an unknown key or table was probably meant for; empty when there is none."""
    word, tables = str(place[-1]), table_names(schema)
    if len(place) == 1 and is_table:
        return closest(word, tables)
    if place[0] != "uncertainty" and len(place) <= 2:
        homes = [("",), *((table,) for table in tables)]
        for (table,) in homes:
            if word in _keys_at((table,) if table else (), schema) and word not in tables:
                return f"{table}.{word}" if table else word
    near = closest(word, _keys_at(place[:-1], schema))
    return ".".join([*map(str, place[:-1]), near]) if near else ""


def allowed_at(place: tuple[int | str, ...], schema: Schema = SceneTables) -> str:
    """Say what a key of the schema takes.

    Args:
        place: table, key and so on.
        schema: all tables of the kind of scene.

    Returns:
        Such as 'a length above 0, such as "44.5 mm", in m, cm, mm, um, nm, in'.
    """
    field = _field_at(place, schema)
    readers = (each for each in field.metadata if isinstance(each, Reader))
    return next((reader.allowed for reader in readers), note_of(field, "list"))


def presence_at(path: str, schema: Schema = SceneTables) -> str:
    """Tell how a key of the schema may be absent.

    Args:
        path: "table.key".
        schema: all tables of the kind of scene.

    Returns:
        As `presence_of`.
    """
    return presence_of(_field_at(tuple(path.split(".")), schema))


def _field_at(place: tuple[int | str, ...], schema: Schema) -> FieldInfo:
    return _model_at(place[:-1], schema).model_fields[str(place[-1])]


def _keys_at(place: tuple[int | str, ...], schema: Schema) -> list[str]:
    """Keys that the schema has in the table at a place."""
    return list(_model_at(place, schema).model_fields)


def _model_at(place: tuple[int | str, ...], schema: Schema) -> Schema:
    model = schema
    for step in place:
        if isinstance(step, str):
            model = _model_of(model.model_fields[step].annotation)
    return model


def _model_of(annotation: Any) -> Schema:
    """The table inside an annotation such as `tuple[BendTable, ...] | None`."""
    inner = (
        annotation,
        *get_args(annotation),
        *(each for part in get_args(annotation) for each in get_args(part)),
    )
    return next(each for each in inner if isinstance(each, type) and issubclass(each, BaseModel))
