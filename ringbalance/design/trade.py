"""What the array core leaves out, measured: some rows are calibrated, the next finer level."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

import numpy as np

from ringbalance.design.axes import Point
from ringbalance.design.static import FAULTS, Record, content_of, point_scene
from ringbalance.design.work import Task, tasks_of
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

QUANTITIES: Final = ("lambda", "moment", "velocity", "drag_coefficient", "stall_pressure", "usable_moment")


def calibrated_row(scene: SceneFile, point: Point) -> Record:
    """Value and expanded uncertainty (95 %) by numerics and models of what `calibrate` finds, by name."""
    try:
        known = calibrate(point_scene(scene, point)).quantities
    except (SceneError, *FAULTS):
        return {}
    return {
        name: [known[name].value, math.hypot(parts.numerical, parts.model)]
        for name in QUANTITIES
        if name in known and (parts := known[name].parts)
    }


def left_out(
    scene: SceneFile,
    points: Sequence[Point],
    static: Sequence[Record],
    count: int,
    deal: Callable[[str, Sequence[Task]], list[Record]],
) -> list[Record]:
    """Calibrate some rows; see `_errors`. Args: `deal`: answers tasks, see `work.answers`."""
    places = _chosen(static, count)
    calls = [partial(calibrated_row, scene, points[i]) for i in places]
    finer = deal("calibrate", tasks_of(content_of(scene), calls)) if places else []
    return _errors([static[i] for i in places], finer)


def _chosen(rows: Sequence[Record], count: int) -> list[int]:
    """Rows to calibrate, evenly over those that have an answer."""
    answered = [
        place for place, row in enumerate(rows) if row["status"] == "ok" and "lambda" in row["values"]
    ]
    if not answered or count < 1:
        return []
    places = np.linspace(0, len(answered) - 1, min(count, len(answered))).round().astype(int)
    return [answered[place] for place in dict.fromkeys(places.tolist())]


def _errors(rows: Sequence[Record], calibrated: Sequence[Record]) -> list[Record]:
    """By quantity the largest error of the rows and the largest uncertainty beside it, both as fractions of
    the largest value.

    Args: `rows`: static ones; `calibrated`: the same points by `calibrated_row`.
    """
    found = []
    for name in QUANTITIES:
        known = [
            (abs(value - finer[name][0]), finer[name][1], abs(finer[name][0]))
            for row, finer in zip(rows, calibrated, strict=True)
            if (value := row["values"][name][0]) is not None and name in finer
        ]
        error, uncertainty, largest = map(max, zip(*known, strict=True)) if known else (0.0, 0.0, 0.0)
        if largest > 0:
            found.append({"quantity": name, "error": error / largest, "uncertainty": uncertainty / largest})
    return found
