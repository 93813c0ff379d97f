"""Dataclasses from TOML tables, checked against their annotations; all errors at once, each with its key.

Supported: `str`, `float` (whole numbers too), `int`, `bool`, string enumerations, `Literal`, `X | Y`,
`tuple[X, ...]`, `Mapping[str, X]`, further dataclasses, `Any`, and `Annotated[str, Pattern(...)]`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

Record = TypeVar("Record")


@dataclass(frozen=True)
class Pattern:
    """Regular expression that a whole text must match, with its description in words."""

    expression: str
    allowed: str


class RecordError(Exception):
    """Values that do not fit a record; `errors` has one line for each, with its key."""

    def __init__(self, errors: list[str]) -> None:
        super().__init__("\n".join(errors))
        self.errors = errors


def record_from(kind: type[Record], table: Mapping[str, Any]) -> Record:
    """A record of `kind` from a table.

    Raises: RecordError: unknown, missing or unsuitable values, all of them; or, where each value fits, the
        error of the record itself (a ValueError of its `__post_init__`).
    """
    errors: list[str] = []
    result = _record(kind, table, "", errors)
    if errors:
        raise RecordError(errors)
    return result  # type: ignore[no-any-return]


def plain(value: Any) -> Any:
    """A record as JSON-able values: dictionaries, lists, texts and numbers; None where one is not finite."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value.value if isinstance(value, Enum) else value


_annotations = cache(partial(get_type_hints, include_extras=True))
"""Annotation of each field of a record, by name."""


def _record(kind: type, table: Any, path: str, errors: list[str]) -> Any:
    if not isinstance(table, Mapping):
        errors.append(f"{path or 'case'}: a table is needed")
        return None
    inside = f"{path}." if path else ""
    declared = {field.name: field for field in fields(kind)}
    before = len(errors)
    errors += [
        f"{inside}{name}: no such key; allowed: {', '.join(declared)}" for name in table.keys() - declared
    ]
    for name, field in declared.items():
        if name not in table and field.default is MISSING and field.default_factory is MISSING:
            errors.append(f"{inside}{name}: missing")
    annotations = _annotations(kind)
    values = {
        name: _value(annotations[name], table[name], f"{inside}{name}", errors)
        for name in table
        if name in declared
    }
    if len(errors) > before:
        return None
    try:
        return kind(**values)
    except ValueError as error:
        errors.append(f"{path or 'case'}: {error}")
        return None


def _value(annotation: Any, value: Any, path: str, errors: list[str]) -> Any:
    """The value in its annotated type; None, and a line in `errors`, where it does not fit."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if is_dataclass(annotation):
        return _record(annotation, value, path, errors)  # type: ignore[arg-type]
    if origin is Annotated:
        value, pattern = _value(arguments[0], value, path, errors), arguments[1]
        value = value.strip() if isinstance(value, str) else value
        if isinstance(value, str) and not re.fullmatch(pattern.expression, value, re.DOTALL):
            errors.append(f'{path}: "{value}"; allowed: {pattern.allowed}')
        return value
    if origin in (Union, UnionType):
        # The first choice that fits; else the errors of the first.
        attempts: list[list[str]] = []
        for choice in arguments:
            attempts.append([])
            result = _value(choice, value, path, attempts[-1])
            if not attempts[-1]:
                return result
        errors += attempts[0]
        return None
    if origin is tuple and isinstance(value, list):
        return tuple(_value(arguments[0], each, f"{path}.{i}", errors) for i, each in enumerate(value))
    if origin is not None and issubclass(origin if isinstance(origin, type) else object, Mapping):
        if not isinstance(value, Mapping):
            errors.append(f"{path}: a table is needed")
            return None
        # A plain dictionary: results with their definitions come back from worker processes.
        return {key: _value(arguments[1], each, f"{path}.{key}", errors) for key, each in value.items()}
    return _plain_value(annotation, value, path, errors)


_PLAIN: Mapping[Any, tuple[tuple[type, ...], str]] = MappingProxyType(
    {
        str: ((str,), "a text"),
        float: ((float, int), "a number"),
        int: ((int,), "a whole number"),
        bool: ((bool,), "true or false"),
        NoneType: ((NoneType,), "nothing"),
    }
)


def _plain_value(annotation: Any, value: Any, path: str, errors: list[str]) -> Any:
    if annotation is Any:
        return value
    choices: tuple[Any, ...] | None = get_args(annotation) if get_origin(annotation) is Literal else None
    if choices is None and isinstance(annotation, type) and annotation not in _PLAIN:
        choices = tuple(annotation)  # type: ignore[arg-type]  # an enumeration
    if choices is not None:
        result = next((each for each in choices if each == value), None)
        if result is None:
            errors.append(f'{path}: "{value}"; allowed: {", ".join(str(each) for each in choices)}')
        return result
    types, needed = _PLAIN.get(annotation, ((tuple,), "a list"))
    if not isinstance(value, types) or (isinstance(value, bool) and annotation is not bool):
        errors.append(f"{path}: {needed} is needed")
        return None
    return float(value) if annotation is float else value  # type: ignore[arg-type]
