"""What positioning costs over the weights and the mass ratio, by the efforts of Fig. 6."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.cases.driven_fig6_effort.case import STEP, efforts
from ringbalance.verification.evidence import Evidence, Level, as_found


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Growth of the effort with q/r and with the mass ratio."""
    found = efforts(scene, step=STEP[level])
    judged = found["exact" if defect is None else "without"]
    without = over_mass(found["without"])
    return Evidence(
        found=as_found(over_weight=over_weight(judged).max(), over_mass=over_mass(judged).max()),
        numbers={
            "weight_without": over_weight(found["without"]).max(),
            "mass_without": without.min(),
            "mass_without_most": without.max(),
        },
    )


def over_weight(effort: FloatArray) -> FloatArray:
    """Effort at the largest over that at the smallest q/r, shape (mass ratios, speed ratios)."""
    return np.asarray(effort[:, -1] / effort[:, 0], dtype=np.float64)


def over_mass(effort: FloatArray) -> FloatArray:
    """Effort at the larger over that at the smaller mass ratio, shape (weight ratios, speed ratios)."""
    return np.asarray(effort[0] / effort[1], dtype=np.float64)
