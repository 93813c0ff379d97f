"""Free surface and pressure with gravity along the shaft, three-dimensional."""

from __future__ import annotations

from typing import Final

from ringbalance.mesh.chamber import default_cells
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.reference.gravity_study import gravity_evidence, gravity_study

_FILL_SHARE: Final = 0.8
_LEVELS: Final = {"light": (1, 2, 3, 4), "heavy": (1, 2, 4, 8)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Errors of surface and pressure over levels."""
    angular = default_cells(disc=scene.disc)[1] // 8
    study = gravity_study(
        disc=scene.disc,
        density=scene.liquid.density,
        fill_ratio=_FILL_SHARE * scene.disc.max_fill_ratio,
        cells=[(n, angular * n, n) for n in _LEVELS[level]],
        shaft="vertical",
        defect=defect,
    )
    return gravity_evidence(study)
