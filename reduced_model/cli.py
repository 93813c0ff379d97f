"""The command `ringbalance calibrate`."""

from __future__ import annotations

import json as json_format
from pathlib import Path

from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.calibration_rows import calibration_rows
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.results.result import print_rows
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.files import check_file
from ringbalance.scene.platform.terminal import activity, print_message

DONE = 0


def calibrate(
    scene: Path,
    *,
    json: bool = False,
    save: Path | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Calibrate a disc: lambda, k(u) and the flow law, with uncertainties.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        save: also write the flow law to this file, for `simulate --law`.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: the law's file cannot be written.
    """
    told = with_tolerance(load_scene(scene), tolerance=tolerance, models=models)
    if save is not None:
        check_file(save)
    with activity("calibrate", "pressure and moment over the fill range, losses of the tube ..."):
        found = calibrate_scene(told)
    if json:
        print(json_format.dumps(calibration_document(found), allow_nan=False))
    else:
        print_rows(calibration_rows(found), headline=False)
    if save is not None:
        found.flow_law.save(save)
        print_message(f"law written to {save}")
    return DONE
