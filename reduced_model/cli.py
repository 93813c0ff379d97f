"""The command `ringbalance calibrate`."""

from __future__ import annotations

import json as json_format
from pathlib import Path

from rich.console import Console

from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.show import calibration_view
from ringbalance.scene.loader import load_scene

DONE = 0


def calibrate(scene: Path, *, json: bool = False, save: Path | None = None) -> int:
    """Calibrate a disc: lambda, k(u) and the flow law, with uncertainties.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        save: also write the flow law to this file, for `simulate --law`.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: the law's file cannot be written.
    """
    told = load_scene(scene)
    progress = Console(stderr=True)
    with progress.status("finite elements over the fill range, losses of the tube ..."):
        found = calibrate_scene(told)
    if json:
        print(json_format.dumps(calibration_document(found), allow_nan=False))
    else:
        Console().print(calibration_view(found))
    if save is not None:
        found.flow_law.save(save)
        progress.print(f"law written to {save}", highlight=False)
    return DONE
