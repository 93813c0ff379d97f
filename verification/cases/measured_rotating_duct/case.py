"""Friction in a square duct that rotates: laminar flow that is free to fluctuate, against measurements."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.physics.tube.rotation_table import laminar_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, as_found, figure
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.rotating_section import (
    POISEUILLE_GRADIENT,
    DuctMesh,
    SectionMesh,
    march_section,
)

_SQUARE: Final = ((0.5, 2000.0, 8e-6, 0.06), (1.0, 1000.0, 1e-5, 0.06), (1.0, 2000.0, 4e-6, 0.04))
_FAST: Final = (3.3, 1810.0, 4e-6, 0.03)
"""S = omega d/U, Re, step and time over d^2/nu; the last is the end of the correlated simulations."""
_TUBE: Final = (0.5, 2000.0, 5e-6, 0.05)
_CELLS: Final = {"light": DuctMesh(across=16, along=10), "heavy": DuctMesh(across=24, along=16)}
_FACTORS: Final = {None: 1.0, "rotation_ten_per_cent_slow": 0.9}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    square = _CELLS[level].system()
    points = (*_SQUARE, _FAST)
    s, re = (np.array([point[i] for point in points]) for i in (0, 1))
    gradients = [_mean_gradient(square, point, _FACTORS[defect]) for point in points]
    fanning, measured = np.array(gradients) / (2 * re), _correlated(s, re)
    deviation = fanning / measured - 1
    return Evidence(
        found=as_found(bias=abs(np.mean(deviation)), worst=np.max(np.abs(deviation))),
        numbers={"signed_bias": float(np.mean(deviation))} | ({} if defect else _tube()),
        series=(
            figure(
                "Fanning friction factor of a rotating square duct, computed and measured",
                ("rotation number 2 omega d/U", "1", 2 * s),
                Curve("computed", "1", fanning, style="points"),
                Curve("correlation of measurements", "1", measured, style="reference"),
                log=True,
            ),
        ),
    )


def _mean_gradient(system: FlowSystem, point: tuple[float, ...], rotation: float = 1.0) -> float:
    s, re, step, time = point
    flow = march_section(
        system=system, kl=rotation * s * re**2, s=rotation * s, step=step, steps=round(time / step)
    )
    return flow.mean_gradient()


def _correlated(s: FloatArray, re: FloatArray) -> FloatArray:
    """C_f from 1.09 (C_f/Ek^(1/2))^1.25 = Ro with Ro = 2 S and Ek = 1/(S Re)."""
    return np.asarray((2 * s / 1.09) ** 0.8 / np.sqrt(s * re))


def _tube() -> dict[str, float]:
    """Friction of the circular tube, solved in time as well, over the table's steady one, less one."""
    tube = SectionMesh(around=7, across=11, wall_ratio=15.0).system()
    s, re, _, _ = _TUBE
    steady = float(laminar_ratio(reynolds=re, rotation_reynolds=s * re))
    return {"tube": _mean_gradient(tube, _TUBE) / POISEUILLE_GRADIENT / steady - 1}
