"""The balancer model that a command's `--law` asks for."""

from __future__ import annotations

from pathlib import Path

from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.loading import load_model
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.models import Scene


def law_by_name(scene: Scene, law: str) -> BalancerModel:
    """Model of a scene under the law "calibrated", "paper", or that of a saved file.

    Raises: SceneError: a scene that cannot be calibrated, or a file that holds no law.
    """
    if law == "calibrated":
        return calibrated_model(scene)
    return paper_model(scene) if law == "paper" else load_model(Path(law))
