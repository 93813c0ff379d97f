"""Orders of velocity and pressure on the curved half section."""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.reference.manufactured_flow import flow_evidence

_AROUND: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    return flow_evidence(around=_AROUND[level], defect=defect)
