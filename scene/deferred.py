"""What only scenes with the mesh of a chamber or with changes need, loaded then: others start faster without.

`from ringbalance.scene import deferred`, then `deferred.with_chamber(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "scene_lines": "ringbalance.scene.describe",
        "with_chamber": "ringbalance.scene.chamber_file.loading",
        "with_values": "ringbalance.scene.changes",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
