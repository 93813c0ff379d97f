"""Two-dimensional manufactured study, quadratic and straight geometry."""

from __future__ import annotations

from ringbalance.mesh.chamber import default_cells
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.reference.manufactured_evidence import manufactured_evidence


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Errors over four levels, five at level heavy."""
    return manufactured_evidence(disc=scene.disc, cells=_cells(scene.disc, level), defect=defect)


def _cells(disc: Disc, level: Level) -> list[tuple[int, ...]]:
    angular = default_cells(disc=disc)[1] // 4
    return [(2 * n, angular * n) for n in ((1, 2, 4, 8) if level == "light" else (1, 2, 4, 8, 16))]
