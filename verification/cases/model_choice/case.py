"""Choices of models on a few random scenes, judged by the finest model and by the cheapest that would do.

The loss of the tube on twelve scenes and the chamber of one; `model_choice_many` has the rest.
"""

from __future__ import annotations

from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.selection_studies.choices import CHAMBER, choices_evidence

_SCENES: Final = 12
_ALONE: Final = 2
"""Number of the one scene whose chamber is judged."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    return choices_evidence(scene, numbers=range(_SCENES), quantities_of=_quantities_of, defect=defect)


def _quantities_of(number: int) -> tuple[str, ...]:
    """Names of the quantities that are judged on a scene."""
    return ("k", *CHAMBER) if number == _ALONE else ("k",)
