"""The designed set and the axes of the extremes; a heavy run."""

from __future__ import annotations

import tomllib
from typing import Final

from ringbalance.scene import bundled_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.files import cache_folder
from ringbalance.verification.evidence import Evidence, Level, Table, as_found
from ringbalance.verification.extremes.design import Base
from ringbalance.verification.extremes.point import SOUND, Defect, Ending
from ringbalance.verification.extremes.study import SIZES, Size, counted, find_extremes

_DEFECTS: Final = {
    None: SOUND,
    "half_widths_hundredth": Defect(width_factor=0.01),
    "liquid_lost": Defect(leak=1e-6),
}
_FEW: Final = Size(points=40, sweep=2, fineness=1.0)
"""Enough for a mutation to show."""
_WORKERS: Final = 2
_KEPT: Final = "extremes-points.json"
"""From which an interrupted run resumes."""
_PAPER: Final = "liquid_ring_paper"
_NUMBERS: Final = {
    "solved": Ending.SOLVED,
    "wide": Ending.WIDE,
    "status": Ending.STATUS,
    "refused": Ending.REFUSED,
}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    document = tomllib.loads(bundled_scene(_PAPER).read_text(encoding="utf-8"))
    base = Base(document=document, file=f"{_PAPER}.toml", defect=_DEFECTS[defect])
    size = SIZES[level] if defect is None else _FEW
    kept = cache_folder() / _KEPT if level == "heavy" and defect is None else None
    found = find_extremes(base, size=size, workers=_WORKERS, kept=kept)
    everything = found.everything
    endings = counted(everything)
    worst = max(j.worst_ratio for j in everything)
    return Evidence(
        found=as_found(broken=found.broken(), worst=worst),
        numbers={
            "judged": float(len(everything)),
            "points": float(len(found.points)),
            "residual": max(j.residual for j in everything),
            "worst": worst,
            **{name: float(endings[str(ending)]) for name, ending in _NUMBERS.items()},
        },
        tables=[Table(name=name, columns=columns) for name, columns in found.tables().items()],
    )
