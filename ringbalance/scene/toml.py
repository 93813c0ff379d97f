"""TOML reader, which refuses keys so long that reading takes gigabytes, and writer for files and messages."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final

_VALUE_CHARACTERS, _LIST_ENTRIES, _NESTED_LEVELS = 60, 10, 4
MOST_PARTS: Final = 50
"""Most parts of a dotted key. Time and memory of `tomllib` grow with the square: 3.5 GB for 30,000 parts."""
_JSON: Final = json.JSONEncoder(ensure_ascii=False)
_QUOTED: Final = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')
_LONG_KEY: Final = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")


def read_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML document.

    Raises: ValueError: not TOML, or a key of more than `MOST_PARTS` parts. RecursionError: nested too deeply.
    """
    long_key = _LONG_KEY.search(_QUOTED.sub("q", text))
    if long_key is not None:
        # Quoted texts hold no line break, so that lines count as in the file.
        line = long_key.string.count("\n", 0, long_key.start()) + 1
        raise ValueError(f"line {line} has a key of more than {MOST_PARTS} parts")
    return tomllib.loads(text)


@dataclass(frozen=True, kw_only=True)
class TableText:
    """A written table, whose lines are reused for tables that share most of its values."""

    name: str
    content: Mapping[str, Any]

    @cached_property
    def _lines(self) -> Mapping[str, str]:
        return {key: _line(key, value) for key, value in self.content.items()}

    @cached_property
    def _text(self) -> str:
        return self._changed(self.content)

    def changed(self, content: Mapping[str, Any]) -> str:
        """Text of the table with other content; values that are the same objects are not written again."""
        return self._text if content is self.content else self._changed(content)

    def _changed(self, content: Mapping[str, Any]) -> str:
        lines, before = self._lines, self.content
        return f"\n[{toml_key(self.name)}]\n" + "".join(
            lines[key] if key in lines and before[key] is value else _line(key, value)
            for key, value in content.items()
        )


def toml_bytes(document: Mapping[str, Any], written: Mapping[str, TableText] = MappingProxyType({})) -> bytes:
    """A document of texts, numbers, truth values, lists and tables, which `tomllib` reads back as it was.

    Args: `written`: tables of a document that shares most values with this one.
    """
    tables = {name: value for name, value in document.items() if isinstance(value, dict)}
    top = "".join(_line(key, value) for key, value in document.items() if key not in tables)
    parts = (
        (written.get(name) or TableText(name=name, content={})).changed(table)
        for name, table in tables.items()
    )
    return (top + "".join(parts) or "\n").encode()


def _line(key: str, value: Any) -> str:
    return f"{toml_key(key)} = {_value_text(value, indent='  ')}\n"


def _value_text(value: Any, *, indent: str = "") -> str:
    """One value; a list of tables that is not nested has a line for each table."""
    if isinstance(value, dict):
        inside = ", ".join(f"{toml_key(key)} = {_value_text(item)}" for key, item in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        items = [_value_text(item) for item in value]
        if indent and items and isinstance(value[0], dict):
            return "[\n" + "".join(f"{indent}{item},\n" for item in items) + "]"
        return "[" + ", ".join(items) + "]"
    # TOML takes JSON's escapes and requires one more.
    return _JSON.encode(value).replace("\x7f", "\\u007f")


def toml_text(value: object) -> str:
    """A value as it would stand in a TOML file, printable and shortened to fit a line."""
    text = _toml_text(value, depth=0)
    return text if len(text) <= _VALUE_CHARACTERS else text[: _VALUE_CHARACTERS - 4] + " ..."


def _toml_text(value: object, *, depth: int) -> str:
    if isinstance(value, str):
        return _quoted(value[: 2 * _VALUE_CHARACTERS])
    if isinstance(value, Mapping | Sequence) and depth == _NESTED_LEVELS:
        return "..."
    if isinstance(value, Mapping):
        few = list(value.items())[:_LIST_ENTRIES]
        pairs = (f"{toml_key(str(key))} = {_toml_text(item, depth=depth + 1)}" for key, item in few)
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_toml_text(item, depth=depth + 1) for item in value[:_LIST_ENTRIES]) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) >= 10**30:
        return f"a whole number of {value.bit_length()} bits"
    return str(value)


def toml_key(key: str) -> str:
    """A key as it would stand in a TOML file: bare where it can be, else quoted; printable, on one line."""
    bare = key.isascii() and key.replace("_", "a").replace("-", "a").isalnum()
    return key if bare and len(key) <= _VALUE_CHARACTERS else _quoted(key[:_VALUE_CHARACTERS])


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=not text.isprintable())
