"""The command `ringbalance tune`."""

from __future__ import annotations

import json as json_format
from pathlib import Path

from ringbalance.controller.balancer import balancer_under
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.terminal import activity, results_console

TUNED = 0
NOT_TUNED = 1


def tune(
    scene: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Recommend the settings of a balancer's controller, and how long it takes to settle under them.

    Args:
        scene: the scene file.
        law: of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.
        json: print one JSON document instead of tables.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 what is recommended settles 95 % of the runs; 1 otherwise; the result is printed either
        way.

    Raises:
        SceneError: a scene or a law that cannot be used.
    """
    balancer = balancer_under(law, with_tolerance(load_scene(scene), tolerance=tolerance, models=models))
    with activity("tune", "runs ...") as shown:
        found = balancer.recommend(progress=shown.show)
    if json:
        print(json_format.dumps(found.to_dict(), allow_nan=False))
    else:
        results_console().print(found.rows().view())
    return TUNED if found.succeeded else NOT_TUNED
