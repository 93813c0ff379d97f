"""Time of a sweep compared with a loop of calibrations and with runs, of models with each other, and computed
time of many workers.

python benchmarks/sweep.py [DESIGNS]    prints the measurements; with --keep they are stored for the documents
"""

from __future__ import annotations

import heapq
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any, Final

import ringbalance as rb
from ringbalance.design.work import CALL_TIME_S, bundle_size
from ringbalance.scene import AnyScene

KEPT: Final = Path(__file__).parent / "sweep.json"
SHOWN: Final = ("wall_pressure", "velocity")
"""Names of the quantities whose models are compared."""
ON_PAPER: Final = (1000, 10_000, 100_000)
"""Numbers of designs for the computed time of many workers."""
CALIBRATED, CHECKED = 20, 12
DRIVEN, RUNS = 20, 200
"""Number of designs with runs, and most devices of each."""
SIMULATED = 5
"""Number of designs with one separate simulation each."""
VARY = {"tube.bore": "0.7mm:2.5mm", "rotor.speed": "5000rpm:7000rpm", "gas.pressure": "0.5MPa:1MPa"}


def seconds(call: Callable[[], object]) -> float:
    """Processor time of one call, s."""
    start = time.process_time()
    call()
    return time.process_time() - start


def on_paper(workers: int, *, designs: int, each: float) -> float:
    """Fraction of the workers' time spent on designs, if one process sends and receives all bundles.

    Args: `each`: time of a design, s.
    """
    size = bundle_size(each, count=designs, workers=workers)
    free, caller = [0.0] * workers, 0.0
    for start in range(0, designs, size):
        caller = max(caller, heapq.heappop(free)) + CALL_TIME_S
        heapq.heappush(free, caller + min(size, designs - start) * each)
    return designs * each / (workers * max(free))


def with_runs(scene: AnyScene, points: Sequence[Mapping[str, Any]]) -> tuple[float, int]:
    """Processor time of designs with runs, s, and the number of devices that decided."""
    start, devices = time.process_time(), 0
    for point in points:
        devices += rb.objective(scene, point, runs=RUNS)["devices"]
    return time.process_time() - start, devices


def measured(designs: int) -> dict[str, Any]:
    """Processor time of a design by level, s; error of the rows; errors and rates of models."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    small = rb.sweep(scene, VARY, sample=f"latin:{CALIBRATED}")
    scenes = [small.point_scene(row) for row in range(CALIBRATED)]
    rb.calibrate(scenes[0])
    spent = {"calibrate": seconds(lambda: [rb.calibrate(each) for each in scenes]) / CALIBRATED}
    for name, intervals in (("static", False), ("intervals", True)):
        run = partial(rb.sweep, scene, VARY, sample=f"latin:{designs}", intervals=intervals)
        spent[name] = seconds(run) / designs
    rb.objective(scene, small.points[0], runs=1)
    ran, devices = with_runs(scene, small.points[:DRIVEN])
    rb.simulate(scenes[0])
    alone = seconds(lambda: [rb.simulate(each) for each in scenes[:SIMULATED]]) / SIMULATED
    (velocity,) = (
        each
        for each in rb.sweep(scene, VARY, sample=f"latin:{designs}", check=CHECKED).to_dict()["left_out"]
        if each["quantity"] == "velocity"
    )
    trade, each = rb.trade(scene).to_dict(), ran / DRIVEN
    return {
        "date": date.today().isoformat(),
        "designs": designs,
        "runs": RUNS,
        "checked": CHECKED,
        "seconds": spent | {"runs": each, "call": CALL_TIME_S, "simulate": alone},
        "devices": devices / DRIVEN,
        "loop_of_simulations": alone * devices / ran,
        "workers": [
            {"workers": workers, "used": [on_paper(workers, designs=count, each=each) for count in ON_PAPER]}
            for workers in (10, 100, 1000)
        ],
        "on_paper": ON_PAPER,
        "velocity": {name: velocity[name] for name in ("error", "uncertainty")},
        "models": [
            {
                "quantity": study["title"].partition(",")[0],
                "model": model["model"],
                "error": model["error"],
                "uncertainty": None if model["error"] else study["uncertainty"],
                "designs_per_second": timed["designs_per_second"],
            }
            for study in trade["quantities"]
            if study["quantity"] in SHOWN
            for model, timed in zip(study["models"], trade["times"][study["quantity"]], strict=True)
        ],
    }


def main(arguments: list[str]) -> None:
    """Print the measurements, or store them with --keep."""
    numbers = [int(word) for word in arguments if word != "--keep"]
    record = json.dumps(measured(*numbers or [1000]), indent=1) + "\n"
    if "--keep" in arguments:
        KEPT.write_text(record, encoding="utf-8")
    print(record)


if __name__ == "__main__":
    main(sys.argv[1:])
