"""Claims and their criteria, one folder per case, and their computation, in modules of related cases.

A folder has no `__init__.py` and is entered in no list: it is found by its case.toml, and is package data.
Modules are loaded when a case is run: listing the cases loads none of them.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType


def __getattr__(name: str) -> ModuleType:
    """A module of this package by its name in a case.toml, such as "cases.chamber"."""
    if "." not in name:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"ringbalance.verification.{name}")
