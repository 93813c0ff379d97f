"""Choices of models on 300 random scenes, judged by the finest model and by the cheapest that would do.

Chamber, loss and velocity on all of them, the mass moved by one operation and the settling time on every
tenth.
"""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.selection_studies.choices import CHAMBER, choices_evidence

_SCENES: Final = 300
_FEW: Final = 12
"""Scenes on which a mutation shows."""
_TENTH: Final = 10


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    count = _SCENES if defect is None else _FEW
    return choices_evidence(scene, numbers=range(count), quantities_of=_quantities_of, defect=defect)


def _quantities_of(number: int) -> tuple[str, ...]:
    """Names of the quantities that are judged on a scene."""
    more = ("transferred_mass", "settling_time") if number % _TENTH == 0 else ()
    return (*CHAMBER, "k", "velocity", *more)
