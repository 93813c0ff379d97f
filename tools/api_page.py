"""The reference of public names as Markdown, from their docstrings, for `doc_tables`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from typing import Any, Final

import ringbalance as rb

_SECTION: Final = re.compile(r"^(Args|Returns|Raises|Source|Range|Note):", re.MULTILINE)
_ENTRY: Final = re.compile(r"^ {4}(\w+): ", re.MULTILINE)
_EXAMPLE: Final = re.compile(r"\n*^Example:\n", re.MULTILINE)


def name_reference() -> str:
    """Reference of all public names: functions first, then types of arguments and results."""
    names = sorted(rb.__all__, key=lambda name: (name[0].isupper(), name))
    return "\n\n".join(_entry(name, getattr(rb, name)) for name in names)


def _entry(name: str, value: Any) -> str:
    text, _, example = _EXAMPLE.sub("\0", _docstring(value)).partition("\0")
    parts = [f"## `rb.{name}`", _signature(name, value), _prose(text), _attributes(value)]
    if example:
        parts.append(f"```pycon\n{inspect.cleandoc(example)}\n```")
    return "\n\n".join(part for part in parts if part)


def _docstring(value: Any) -> str:
    """Docstring of a name; a fixed text for an alias, which has none."""
    if inspect.isfunction(value) or inspect.isclass(value):
        return inspect.getdoc(value) or ""
    return "A function of the time, s, and of the vibration, m, complex; gives a `Measurement`, or None."


def _signature(name: str, value: Any) -> str:
    if not inspect.isfunction(value):
        return ""
    shown = [
        str(each.replace(annotation=each.empty)) for each in inspect.signature(value).parameters.values()
    ]
    kinds = [each.kind for each in inspect.signature(value).parameters.values()]
    if inspect.Parameter.KEYWORD_ONLY in kinds:
        shown.insert(kinds.index(inspect.Parameter.KEYWORD_ONLY), "*")
    return f"`rb.{name}({', '.join(shown)})`"


def _prose(text: str) -> str:
    """Sections as paragraphs, arguments as a list."""
    marked = _ENTRY.sub(r"* `\1`: ", _SECTION.sub(r"\n**\1:**\n", text))
    return re.sub(r"\n{3,}", "\n\n", "\n".join(line.strip() for line in marked.splitlines())).strip()


def _attributes(value: Any) -> str:
    if not inspect.isclass(value) or issubclass(value, Exception):
        return ""
    base = int if issubclass(value, int) else object
    names = {*dir(value), *getattr(value, "__dataclass_fields__", ())} - set(dir(base))
    return _listed(name for name in names if not name.startswith("_"))


def _listed(names: Iterable[str]) -> str:
    text = ", ".join(f"`{name}`" for name in sorted(names))
    return f"Has {text}." if text else ""
