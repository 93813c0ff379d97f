"""The rotating section at rest, in slow rotation and in fast rotation."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, Reference, Series, as_found, figure
from ringbalance.verification.navier_stokes.rotating_section import (
    SectionMesh,
    friction_ratio,
    solve_section,
    solve_section_without_inertia,
)
from ringbalance.verification.navier_stokes.system import FlowSystem

_SERIES: Final = 9216.0
_INERTIA_SERIES: Final = 16515072.0
_LIMIT: Final = 0.07863
_SLOW: Final = 1.0
_SLOW_KL: Final = 20.0
_FAST: Final = (1e1, 1e2, 1e3, 1e4)
_FACTORS: Final = {None: 1.0, "coriolis_off_by_a_percent": 1.01, "radius_for_bore": 0.25}
_AROUND: Final = {"light": 8, "heavy": 20}


reference = {
    "slow": Reference(value=1.0),
    "inertia": Reference(value=1.0),
    "ekman": Reference(value=float(np.sqrt(10))),
}
"""Exact limits."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    around = _AROUND[level]
    system = SectionMesh(around=around, across=3 * around // 2, wall_ratio=15.0).system()
    factor = _FACTORS[defect]
    rest = _linear(system, 0.0)
    slow = (_linear(system, factor * _SLOW) - rest) / (_SLOW**2 / _SERIES)
    flow = solve_section(system=system, kl=factor * _SLOW_KL, s=0.0)
    inertia = (friction_ratio(flow) - rest) / (_SLOW_KL**2 / _INERTIA_SERIES)
    fast = np.array([_linear(system, factor * rotation) for rotation in _FAST])
    gaps = fast / (_LIMIT * np.sqrt(_FAST)) - 1
    return Evidence(
        found=as_found(at_rest=abs(rest - 1), slow=slow, inertia=inertia, ekman=gaps[2] / gaps[3]),
        numbers={"gap": float(gaps[-1])},
        series=(_figure(fast),),
    )


def _linear(system: FlowSystem, rotation: float) -> float:
    flow = solve_section_without_inertia(system=system, rotation_reynolds=rotation)
    if not flow.status.ok:
        raise ValueError(flow.status.text)
    return friction_ratio(flow)


def _figure(fast: np.ndarray) -> Series:
    rotation = np.array(_FAST)
    return figure(
        "friction over that at rest, without inertia",
        ("rotation Reynolds number", "1", rotation),
        Curve("finite elements", "1", fast),
        Curve("slow series", "1", 1 + rotation**2 / _SERIES, style="reference"),
        Curve("fast limit", "1", _LIMIT * np.sqrt(rotation), style="reference"),
        log=True,
    )
