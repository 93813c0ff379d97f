"""One folder a case: what is claimed and how it is judged in case.toml, how it is computed in case.py,
or by the study that case.toml names.

The folder has no `__init__.py` and is entered in no list: it is found by its case.toml, and is package data.
`<id>_code` is a case's computation, loaded when it is first asked for: listing the cases loads none of them.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType, ModuleType
from typing import Final

_STUDIES: Final = MappingProxyType(
    {
        "pressure under gravity": "reference.gravity",
        "manufactured pressure": "reference.manufactured",
        "measurements": "validation.comparison",
    }
)
"""Modules whose `study` several cases share."""


def __getattr__(name: str) -> ModuleType:
    if name in _STUDIES:
        return import_module(f"ringbalance.verification.{_STUDIES[name]}")
    if not name.endswith("_code"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name.removesuffix('_code')}.case")
