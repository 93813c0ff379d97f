"""The command `ringbalance trade`."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Final

from rich.console import Console

from ringbalance.scene import load_scene
from ringbalance.scene.files import write_whole
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.evidence import Level
from ringbalance.verification.trade import TradeStudy, trade_document, trade_study
from ringbalance.verification.trade_show import trade_view

DONE: Final = 0


def trade(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "heavy",
    save_costs: Path | None = None,
) -> int:
    """Measure speed against accuracy on a scene, and choose its models for each tolerance.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write the document to trade.json in this folder.
        level: "light" leaves out the settling time, which takes whole runs of the loop.
        save_costs: also write a cost model fitted to this run's times to this file.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: a file cannot be written.
    """
    told = liquid_ring_scene(load_scene(scene))
    progress = Console(stderr=True)
    with progress.status("ladders of models ...") as status:
        study = trade_study(told, level=level, progress=lambda title: status.update(f"{title} ..."))
    text = json_format.dumps(trade_document(study), allow_nan=False)
    if json:
        print(text)
    else:
        Console().print(trade_view(study))
    if out is not None:
        write_whole(out / "trade.json", text + "\n")
        progress.print(f"written to {out / 'trade.json'}", highlight=False)
    if save_costs is not None:
        write_whole(save_costs, costs_text(study))
    return DONE


def costs_text(study: TradeStudy) -> str:
    """The refitted cost model as the file that the program reads.

    Args:
        study: with times.

    Returns:
        JSON text.
    """
    costs = study.refit or study.costs
    record = {
        "fitted_on": costs.fitted_on,
        "seconds": {k: float(f"{v:.3g}") for k, v in costs.seconds.items()},
    }
    return json_format.dumps(record, indent=1) + "\n"
