"""Dataclasses from tables of a file, checked against their annotations; all errors at once, with their keys.

Supported: `str`, `float` (whole numbers too, all finite), `int`, `bool`, string enumerations, `Literal`,
`X | Y`, `tuple[X, ...]`, `Mapping[str, X]`, `FloatArray`, further dataclasses, whose table may name them as
its `type`, `Any`, and `Annotated[X, Condition(...)]`.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import MISSING as NO_VALUE
from ringbalance.scene.faults import Fault, SceneError

Record = TypeVar("Record")
_LONGEST_VALUE: Final = 40


@dataclass(frozen=True)
class Condition:
    """Condition on a value, with its description in words."""

    fits: Callable[[Any], object]
    allowed: str

    @classmethod
    def text(cls, expression: str, allowed: str) -> Condition:
        """A regular expression that a whole text must match."""
        return cls(partial(re.fullmatch, expression, flags=re.DOTALL), allowed)


Positive = Annotated[float, Condition((0.0).__lt__, "a number above 0")]
NotNegative = Annotated[float, Condition((0.0).__le__, "a number of at least 0")]


def record_from(kind: type[Record], table: object, *, file: str, path: str = "") -> Record:
    """A record of `kind` from a table of a file; `path` is that of the table's keys.

    Raises: SceneError: unknown, missing or unsuitable values, all of them; or, where each value fits, the
        error of the record itself (a ValueError of its `__post_init__`).
    """
    reader = _Reader(file)
    result = reader.record(kind, table, path)
    if reader.faults:
        raise SceneError(reader.faults)
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
_PLAIN: Mapping[Any, tuple[tuple[type, ...], str]] = MappingProxyType(
    {
        str: ((str,), "a text"),
        float: ((float, int), "a finite number"),
        int: ((int,), "a whole number"),
        bool: ((bool,), "true or false"),
        NoneType: ((NoneType,), "nothing"),
    }
)


class _Reader:
    """Reader of one file that collects its errors while it builds records; None stands for what failed."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.faults: list[Fault] = []

    def fault(self, path: str, value: object, problem: str, allowed: str) -> Any:
        table, _, key = path.rpartition(".")
        text = NO_VALUE if value is MISSING else json.dumps(value, default=str)
        text = text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."
        self.faults.append(
            Fault(file=self.file, table=table, key=key, value=text, problem=problem, allowed=allowed)
        )

    def misfit(self, path: str, value: object, allowed: str) -> Any:
        self.fault(path, value, f"it is not {allowed}", allowed)

    def record(self, kind: type, table: Any, path: str) -> Any:
        if not isinstance(table, Mapping):
            return self.misfit(path, table, "a table")
        inside = f"{path}." if path else ""
        declared = {field.name: field for field in fields(kind)}
        before = len(self.faults)
        for name in sorted(table.keys() - declared):
            if name != "type":
                self.fault(f"{inside}{name}", table[name], "unknown key", ", ".join(declared))
            elif table[name] != kind.__name__:
                self.fault(f"{inside}{name}", table[name], "this is no such record", kind.__name__)
        for name, field in declared.items():
            if name not in table and field.default is MISSING and field.default_factory is MISSING:
                self.fault(f"{inside}{name}", MISSING, "the key is missing", str(field.type))
        annotations = _annotations(kind)
        values = {
            name: self.value(annotations[name], table[name], f"{inside}{name}")
            for name in table
            if name in declared
        }
        if len(self.faults) > before:
            return None
        try:
            return kind(**values)
        except ValueError as error:
            return self.fault(path, kind.__name__, str(error), "values that fit together")

    def value(self, annotation: Any, value: Any, path: str) -> Any:
        """The value in its annotated type."""
        origin, arguments = get_origin(annotation), get_args(annotation)
        if is_dataclass(annotation):
            return self.record(annotation, value, path)  # type: ignore[arg-type]
        before = len(self.faults)
        if origin is Annotated:
            value = self.value(arguments[0], value, path)
            value = value.strip() if isinstance(value, str) else value
            if len(self.faults) == before and not arguments[1].fits(value):
                self.misfit(path, value, arguments[1].allowed)
            return value
        if origin in (Union, UnionType):
            return self.union(arguments, value, path)
        # By the alias itself: of what it is an alias differs between versions of NumPy.
        if annotation == FloatArray and isinstance(value, list) and all(map(_is_finite, value)):
            return np.array(value, dtype=np.float64)
        if origin is tuple and isinstance(value, list):
            return tuple(self.value(arguments[0], each, f"{path}.{i}") for i, each in enumerate(value))
        if isinstance(origin, type) and issubclass(origin, Mapping):
            if not isinstance(value, Mapping):
                return self.misfit(path, value, "a table")
            # A plain dictionary: results with their definitions come back from worker processes.
            return {key: self.value(arguments[1], each, f"{path}.{key}") for key, each in value.items()}
        return self.plain_value(annotation, value, path)

    def union(self, choices: tuple[Any, ...], value: Any, path: str) -> Any:
        """The value as the first choice that fits; else the errors of the first."""
        attempts = []
        for choice in choices:
            attempts.append(_Reader(self.file))
            result = attempts[-1].value(choice, value, path)
            if not attempts[-1].faults:
                return result
        self.faults += attempts[0].faults
        return None

    def plain_value(self, annotation: Any, value: Any, path: str) -> Any:
        if annotation is Any:
            return value
        choices: tuple[Any, ...] | None = get_args(annotation) if get_origin(annotation) is Literal else None
        if isinstance(annotation, type) and issubclass(annotation, Enum):
            choices = tuple(annotation)
        if choices is not None:
            result = next((each for each in choices if each == value), None)
            if result is None:
                self.fault(path, value, "unknown value", ", ".join(str(each) for each in choices))
            return result
        types, needed = _PLAIN.get(annotation, ((tuple,), "a list of such values"))
        fits = isinstance(value, types) and (annotation is bool or not isinstance(value, bool))
        if not fits or (annotation is float and not _is_finite(value)):
            return self.misfit(path, value, needed)
        return float(value) if annotation is float else value


def _is_finite(value: Any) -> bool:
    """True for a finite number that is a float without overflow."""
    return type(value) in (int, float) and abs(value) <= sys.float_info.max
