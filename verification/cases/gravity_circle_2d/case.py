"""Free surface and pressure with gravity across the shaft, two-dimensional."""

from __future__ import annotations

from typing import Final

from ringbalance.mesh.chamber import default_cells
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.reference.gravity import gravity_evidence

_LEVELS: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    angular = default_cells(disc=scene.disc)[1] // 4
    cells = [(2 * n, angular * n) for n in _LEVELS[level]]
    return gravity_evidence(scene, cells=cells, shaft="horizontal", defect=defect)
