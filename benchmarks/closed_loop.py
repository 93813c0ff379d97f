"""The closed loop beside scipy's solve_ivp: one operation, a whole run, and ensembles of noisy runs.

    python benchmarks/closed_loop.py [--json] [--repeats 7] [--members 100000] [--largest 1000000]

The rival is what one would write oneself: a plain Python loop of the target-vector algorithm whose operations
go through `solve_ivp` with events for stall and empty, at the loosest tolerance that keeps the fill within
1e-6.  Its right-hand side is either the paper's law in plain numbers, the cheapest that Python has, or a flow
law through its interface, as for a law of which nothing else is known.  Under the paper's law the fill is
a parabola in time, which Runge-Kutta steps hit exactly, so solve_ivp has an easy time there, and the rival
keeps no record.  Ours is timed in three ways: compiled and called from Python with numbers (`linear_fill`) or
as an ensemble of one, which are the ones that a target is set for; as a script meets it, with
all checks, choices and texts (`closed_form`, `simulate`); and among many (`simulate_ensemble`).  Times are
the least of several rounds, by the wall's clock and by the processor's, which other work disturbs less.  The
growth is measured after everything has been compiled, so that the peak memory of the process shows what
an ensemble adds.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial

from closed_loop_growth import Growth, compile_seconds, consequences_seconds, growth, order_of_growth
from closed_loop_lines import FILL_ERROR, Line, Rivals, ensemble_lines, loosest, run_lines
from closed_loop_plain import by_the_law, in_numbers
from rich.console import Console
from rich.table import Table

from ringbalance.controller.ensemble import simulate_ensemble
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene


def compare(scene: Scene, *, repeats: int, members: int, console: Console) -> tuple[list[Line], Rivals]:
    """All ratios. Args: `repeats`: timed rounds. `members`: of the ensembles. `console`: for progress."""
    paper = paper_model(scene)
    rivals = {
        "paper's law in numbers": loosest(scene, paper, in_numbers(scene, paper)),
        "paper's law by its interface": loosest(scene, paper, by_the_law(scene, paper)),
    }
    console.print("one run")
    lines = run_lines(scene, paper, rivals, repeats)
    console.print(f"{members} noisy runs under the paper's law")
    rounds = min(repeats, 3)
    lines += ensemble_lines(scene, paper, rivals, members, rounds)
    console.print("calibration, and as many under the calibrated law with a gain that suits it")
    calibrated = calibrate(scene).model
    gain = 0.3 * scene.controller.proportional
    # The rival has no mass in its column and no gas line, so ours leaves them out, too: `moving_injection`
    # compares both with them.
    tuned = replace(scene, tolerance=1.0, controller=replace(scene.controller, proportional=gain))
    own = {"calibrated law": loosest(tuned, calibrated, by_the_law(tuned, calibrated))}
    lines += ensemble_lines(tuned, calibrated, own, members, rounds)
    return lines, rivals | own


def comparison(line: Line) -> dict[str, object]:
    """One line of the document. Returns: A document for json."""
    return {
        "what": line.what,
        "ours_s": line.ours._asdict(),
        "rival_s": line.rival._asdict(),
        "ratio": line.ratio,
        "processor_ratio": line.processor_ratio,
        "wanted": line.wanted,
    }


def document(
    lines: Sequence[Line], rivals: Rivals, sizes: Sequence[Growth], others: dict[str, float]
) -> dict[str, object]:
    """All that was measured.

    Args: `lines`: comparisons. `rivals`: by name. `others`: single times, s.
    Returns: A document for json.
    """
    return {
        "solve_ivp_rtol": {name: plain.tolerance for name, plain in rivals.items()},
        "fill_error": FILL_ERROR,
        "cores": os.cpu_count(),
        "comparisons": [comparison(line) for line in lines],
        "growth": [asdict(size) for size in sizes],
        "order_of_growth": order_of_growth(sizes),
        "seconds": others,
    }


def show(lines: Sequence[Line], sizes: Sequence[Growth], others: dict[str, float], console: Console) -> None:
    """Print tables. Args: `lines`: comparisons. `others`: single times, s. `console`: where to."""
    table = Table(title="beside solve_ivp at 1e-6 in fill")
    for name in ("what", "ours, us", "solve_ivp, us", "times faster", "asked for", "by processor time"):
        table.add_column(name)
    for line in lines:
        table.add_row(
            line.what,
            f"{line.ours.wall * 1e6:.4g}",
            f"{line.rival.wall * 1e6:.4g}",
            f"{line.ratio:.4g}",
            "" if line.wanted is None else f"{line.wanted:g}",
            f"{line.processor_ratio:.4g}",
        )
    console.print(table)
    grown = Table(title="growth")
    for name in ("members", "s", "processor s", "peak memory, MiB"):
        grown.add_column(name)
    for size in sizes:
        grown.add_row(
            str(size.members),
            f"{size.seconds:.3g}",
            f"{size.processor_seconds:.3g}",
            f"{size.peak_memory_MiB:.4g}",
        )
    console.print(grown)
    console.print(f"order of growth {order_of_growth(sizes) or math.nan:.3f}")
    for what, seconds in others.items():
        console.print(f"{what}: {seconds:.3g} s")


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--members", type=int, default=100_000)
    parser.add_argument("--largest", type=int, default=1_000_000)
    asked = parser.parse_args()
    told = Console(stderr=True)
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    lines, rivals = compare(scene, repeats=asked.repeats, members=asked.members, console=told)
    model = paper_model(scene)
    ensemble = partial(simulate_ensemble, scene, model, seed=0)
    sizes = growth(ensemble, first=1000, largest=asked.largest, factor=10, console=told)
    told.print("consequences, and the first calls of fresh processes")
    first, later = compile_seconds()
    others = {
        "find_consequences": consequences_seconds(scene),
        "first ensemble of a machine, compiling": first,
        "first ensemble of a later process": later,
    }
    if asked.json:
        print(json.dumps(document(lines, rivals, sizes, others), allow_nan=False, indent=2))
    else:
        show(lines, sizes, others, Console())


if __name__ == "__main__":
    main()
