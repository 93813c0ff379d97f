"""The friction formula: its blend of laminar and turbulent flow."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.physics.tube.friction import friction_factor
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, as_found, figure

_TURBULENT: Final = 4000.0
_STEP: Final = 1.01


def blend(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Exact where laminar, without a jump, one velocity a head."""

    def friction_of(reynolds: FloatArray) -> FloatArray:
        f = friction_factor(reynolds=reynolds, relative_roughness=0.0)
        if defect == "sudden_switch":
            f = np.where(reynolds < _TURBULENT, 0.316 * reynolds**-0.25, f)
            return np.where(reynolds < 2040, 64 / reynolds, f)
        return f / 4 if defect == "fanning_factor" else f

    laminar = np.geomspace(1, 1000, 200)
    sweep = np.exp(np.arange(np.log(100), np.log(1e5), np.log(_STEP)))
    curve = friction_of(sweep)
    shown = figure(
        "friction factor of a smooth tube",
        ("Reynolds number", "1", sweep),
        Curve("blend", "1", curve),
        Curve("64/Re", "1", 64 / sweep, style="reference"),
        log=True,
    )
    return Evidence(
        found=as_found(
            laminar=np.max(np.abs(friction_of(laminar) * laminar / 64 - 1)),
            jump=np.max(np.abs(np.diff(curve) / curve[:-1])),
            head_slope=np.min(np.diff(np.log(curve * sweep**2)) / np.log(_STEP)),
        ),
        series=(shown,),
    )
