"""Solvers that few scenes need, loaded when first used: importing them takes longer than a calibration.

`from ringbalance.physics import deferred`, then `deferred.multigrid(...)`.
"""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

_HOME: Final = MappingProxyType(
    {
        "factorised": "ringbalance.physics.pressure.sparse",
        "multigrid": "ringbalance.physics.pressure.multigrid",
        "reduced_waves": "ringbalance.physics.sloshing.body",
        "sloshing_response": "ringbalance.physics.sloshing.response",
        "solved_ring": "ringbalance.physics.pressure.imported",
        "wave_system": "ringbalance.physics.sloshing.imported",
        "nnls": "scipy.optimize",
        "Sobol": "scipy.stats.qmc",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
