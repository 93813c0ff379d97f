"""The command `ringbalance trade`."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Final

from ringbalance.scene import load_scene
from ringbalance.scene.accuracy import Models, with_tolerance
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.progress import activity
from ringbalance.scene.platform.terminal import messages_console, results_console
from ringbalance.verification.evidence import Level
from ringbalance.verification.selection_studies.show import trade_view
from ringbalance.verification.selection_studies.study import TradeStudy, trade_study

DONE: Final = 0
FILE: Final = "trade.json"


def trade(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "heavy",
    save_costs: Path | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Measure speed against accuracy on a scene, and choose its models for each tolerance.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write the document to trade.json in this folder.
        level: "light" leaves out the settling time, which takes whole runs of the loop.
        save_costs: also write a cost model fitted to this run's times to this file.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" models every term that has a model, whatever the tolerance.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: a file cannot be written.
    """
    told = with_tolerance(liquid_ring_scene(load_scene(scene)), tolerance=tolerance, models=models)
    if save_costs is not None:
        check_file(save_costs)
    if out is not None:
        check_file(out / FILE)
    with activity("trade", "model hierarchies ...") as shown:
        study = trade_study(told, level=level, progress=lambda title: shown.show(f"{title} ..."))
    text = json_format.dumps(study.document(), allow_nan=False)
    if json:
        print(text)
    else:
        results_console().print(trade_view(study))
    if out is not None:
        write_whole(out / FILE, text + "\n")
        messages_console().print(f"written to {out / FILE}", highlight=False)
    if save_costs is not None:
        write_whole(save_costs, _costs_text(study))
    return DONE


def _costs_text(study: TradeStudy) -> str:
    """The refitted cost model as the JSON file that the program reads."""
    costs = study.refit or study.costs
    record = {
        "fitted_on": costs.fitted_on,
        "seconds": {k: float(f"{v:.3g}") for k, v in costs.seconds.items()},
    }
    return json_format.dumps(record, indent=1) + "\n"
