"""Choices of models on a few random scenes, judged by the finest model and by the cheapest that would do.

The loss of the tube on twelve scenes and the chamber of one; `model_choice_many` has the rest.
"""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.selection_studies.choices import CHAMBER
from ringbalance.verification.selection_studies.evidence import choices_evidence

SCENES: Final = 12
_ALONE: Final = 2
"""Number of the one scene whose chamber is judged."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    return choices_evidence(scene, numbers=range(SCENES), quantities_of=quantities_of, defect=defect)


def quantities_of(number: int) -> tuple[str, ...]:
    """Quantities that are judged on a scene. Returns: Their names."""
    return ("k", *CHAMBER) if number == _ALONE else ("k",)
