"""Calibrations that several cases share: each is made once per process."""

from __future__ import annotations

from functools import lru_cache

from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.scene.models import Scene


@lru_cache(maxsize=16)
def calibration_of(scene: Scene) -> Calibration:
    """Calibrate a scene."""
    return calibrate(scene)
