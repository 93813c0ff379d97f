"""What draws and calculates, loaded when first used: a broken scene is told of before.

`from ringbalance.reports import deferred`, then `deferred.program.write_report(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "drawing": "ringbalance.reports.pictures.process",
        "program": "ringbalance.reports.report",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(_HOME[name])
