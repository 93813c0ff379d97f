"""A TOML document as a file's text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from ringbalance.scene.faults import toml_key


def toml_bytes(document: Mapping[str, Any]) -> bytes:
    """A document of texts, numbers, truth values, lists and tables, which `tomllib` reads back as it was."""
    tables = {name: value for name, value in document.items() if isinstance(value, Mapping)}
    top = {key: value for key, value in document.items() if key not in tables}
    lines = list(_lines(top))
    for name, table in tables.items():
        lines += ["", f"[{toml_key(name)}]", *_lines(table)]
    return ("\n".join(lines) + "\n").encode()


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{toml_key(key)} = {_written(value, indent='  ')}" for key, value in table.items()]


def _written(value: Any, *, indent: str = "") -> str:
    """One value; a list of tables that stands by itself has a line for each."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{toml_key(key)} = {_written(item)}" for key, item in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        items = [_written(item) for item in value]
        if indent and items and isinstance(value[0], Mapping):
            return "[\n" + "".join(f"{indent}{item},\n" for item in items) + "]"
        return "[" + ", ".join(items) + "]"
    # JSON's escapes are TOML's, but TOML asks for one more.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
