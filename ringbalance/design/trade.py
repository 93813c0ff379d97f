"""Measured errors of the array core: some rows are compared with `calibrate`, the next finer model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

import numpy as np

from ringbalance.design.axes import Point
from ringbalance.design.static import BREAKDOWNS, Record, content_of
from ringbalance.design.work import Task, tasks_of
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

QUANTITIES: Final = ("lambda", "moment", "velocity", "drag_coefficient", "stall_pressure", "usable_moment")


def calibrated_row(scene: SceneFile, point: Point) -> Record:
    """Pairs of value and expanded uncertainty (95 %, numerical and model) from `calibrate`, by quantity."""
    try:
        quantities = calibrate(scene.with_values(point)).quantities
    except (SceneError, *BREAKDOWNS):
        return {}
    return {
        name: [quantities[name].value, math.hypot(parts.numerical, parts.model)]
        for name in QUANTITIES
        if name in quantities and (parts := quantities[name].parts)
    }


def left_out(
    scene: SceneFile,
    points: Sequence[Point],
    static: Sequence[Record],
    count: int,
    deal: Callable[[str, Sequence[Task]], list[Record]],
) -> list[Record]:
    """Calibrate some rows, evenly spread over those with results.

    Args: `static`: rows of `points`. `count`: number of rows to calibrate. `deal`: see `work.answers`.
    Returns: By quantity the largest error and the largest uncertainty of the calibrated value, both as
        fractions of the largest value.
    """
    answered = [i for i, row in enumerate(static) if row["status"] == "ok" and "lambda" in row["values"]]
    spread = np.linspace(0, len(answered) - 1, max(min(count, len(answered)), 0)).round().astype(int)
    rows = [answered[at] for at in dict.fromkeys(spread.tolist())]
    calls = [partial(calibrated_row, scene, points[i]) for i in rows]
    calibrated = deal("calibrate", tasks_of(content_of(scene), calls)) if rows else []
    errors = []
    for name in QUANTITIES:
        compared = [
            (abs(value - finer[name][0]), finer[name][1], abs(finer[name][0]))
            for i, finer in zip(rows, calibrated, strict=True)
            if (value := static[i]["values"][name][0]) is not None and name in finer
        ]
        error, uncertainty, largest = map(max, zip(*compared, strict=True)) if compared else (0.0, 0.0, 0.0)
        if largest > 0:
            errors.append({"quantity": name, "error": error / largest, "uncertainty": uncertainty / largest})
    return errors
