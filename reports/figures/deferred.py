"""Figures and typesetting for those that seldom need them, loaded when first used: that takes longer than
some runs.

`from ringbalance.reports.figures import deferred`, then `deferred.sheet(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "sheet": "ringbalance.reports.figures.sheet",
        "fit_figures": "ringbalance.reports.figures.fit",
        "figures_of": "ringbalance.reports.figures.runs",
        "typeset": "ringbalance.reports.typesetting",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
