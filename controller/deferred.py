"""Documents and texts of results, loaded when first used: they import what they describe.

`from ringbalance.controller import deferred`, then `deferred.command_document(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "command_document": "ringbalance.controller.line_runs",
        "eccentric_document": "ringbalance.controller.eccentric_mass.document",
        "eccentric_rows": "ringbalance.controller.eccentric_mass.document",
        "eccentric_tuning_document": "ringbalance.controller.eccentric_mass.tuning",
        "eccentric_tuning_rows": "ringbalance.controller.eccentric_mass.tuning",
        "simulation_rows": "ringbalance.controller.document",
        "tuning_document": "ringbalance.controller.tuning.tune",
        "tuning_rows": "ringbalance.controller.tuning.view",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
