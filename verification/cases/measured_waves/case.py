"""Natural frequencies of liquid between two plates, as measured and as predicted."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.validation.comparison import data_evidence
from ringbalance.verification.validation.measurements import measurements
from ringbalance.verification.validation.wave_frequency import CALIBRATING


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    data = measurements("addington_1960")
    return data_evidence(data.where(~np.isin(data.series, CALIBRATING)), unit="1", mutation=defect)
