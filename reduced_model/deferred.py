"""Documents and texts of results, loaded when first used: they import what they describe.

`from ringbalance.reduced_model import deferred`, then `deferred.calibration_document(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "calibration_document": "ringbalance.reduced_model.documents",
        "calibration_rows": "ringbalance.reduced_model.calibration_rows",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
