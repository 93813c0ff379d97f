"""The three-dimensional pressure solve beside NGSolve at equal error, and its cost up to a million unknowns.

    python benchmarks/pressure_field.py [--json] [--repeats 5] [--largest 1100000]

Both solvers get the two problems of `pressure_problems`: the physical pressure, whose only error is the
drawing of the arcs, and a made-up one that no element holds.  Both are judged by one number, the relative
error in L2. Times are processor times on one thread, medians over interleaved repeats.  Each side may use any
of its meshes and orders; at each target the fastest that reaches it counts.  Without NGSolve (the
extra `bench`) our side comes out alone, and says so.
"""

# ruff: noqa: E402 - numpy reads the number of threads when it is imported
from __future__ import annotations

import os
from functools import partial
from importlib import import_module
from types import ModuleType

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import json
import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

from pressure_growth import exponent, growth
from pressure_problems import PROBLEMS, Trial, paper_disc, paper_surface, relative_error, right_hand_sides
from rich.console import Console
from rich.table import Table

from ringbalance.mesh.chamber import chamber_mesh
from ringbalance.physics.pressure.solve import solve_pressure
from ringbalance.scene.models import Disc

rival: ModuleType | None
try:
    rival = import_module("ngsolve_pressure")
except ImportError:
    rival = None

TARGETS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
DEFAULT = (2, (8, 24, 4))
SETTINGS = (
    DEFAULT,
    (2, (2, 6, 1)),
    (3, (1, 3, 1)),
    (4, (1, 2, 1)),
    (4, (1, 3, 1)),
    (5, (1, 2, 1)),
    (6, (1, 2, 1)),
    (6, (1, 3, 1)),
    (8, (1, 1, 1)),
    (8, (1, 2, 1)),
    (8, (1, 3, 1)),
    (10, (1, 2, 1)),
    (12, (1, 1, 1)),
    (12, (1, 2, 1)),
)
"""Orders and cells along radius, angle and axis."""


def our_trial(disc: Disc, problem: str, order: int, cells: tuple[int, ...]) -> Trial:
    """Mesh, solve and judge once. Args: `order`: of the cells. `cells`: along radius, angle and axis."""
    start = time.process_time()
    chamber = chamber_mesh(disc=disc, surface_radius=paper_surface(disc), cells=cells, order=order)
    meshed = time.process_time()
    solution = solve_pressure(chamber=chamber, problem=right_hand_sides(problem, disc))
    solved = time.process_time()
    return Trial(
        problem=problem,
        solver="ringbalance",
        setting=_setting(order, cells),
        unknowns=solution.pressure.size,
        error=relative_error(problem, chamber, solution),
        mesh_seconds=meshed - start,
        solve_seconds=solved - meshed,
    )


def _setting(order: int, cells: tuple[int, ...]) -> str:
    return f"order {order}, {'x'.join(map(str, cells))}"


def trials(disc: Disc, problem: str, repeats: int, console: Console) -> list[Trial]:
    """All settings of both solvers, medians over interleaved repeats.

    Args: `repeats`: number of timed rounds, after one that warms caches. `console`: for progress.
    Returns: One trial per setting.
    """
    makers: list[Callable[[], Trial]] = [partial(our_trial, disc, problem, *setting) for setting in SETTINGS]
    if rival is not None:
        makers += [partial(rival.trial, disc, problem, order, size) for order, size in rival.SETTINGS]
    rounds = []
    for k in range(repeats + 1):
        console.print(f"{problem}: round {k} of {repeats}")
        rounds.append([make() for make in makers])
    return [_median(same) for same in zip(*rounds[1:], strict=True)]


def _median(same: Sequence[Trial]) -> Trial:
    return replace(
        same[0],
        mesh_seconds=statistics.median(t.mesh_seconds for t in same),
        solve_seconds=statistics.median(t.solve_seconds for t in same),
    )


def at_equal_error(found: Sequence[Trial]) -> list[dict[str, Any]]:
    """Fastest setting of each solver at each target, and at the error of the default mesh.

    Args: `found`: trials of one problem.
    Returns: Rows with the two trials and the ratios of NGSolve's times to ours.
    """
    default = next(t for t in found if t.setting == _setting(*DEFAULT))
    ours = [trial for trial in found if trial.solver == "ringbalance"]
    theirs = [trial for trial in found if trial.solver == "NGSolve"]
    rows = [_row("default mesh", default.error, [default], theirs)]
    rows += [_row("fastest of each", target, ours, theirs) for target in TARGETS]
    return [row for row in rows if row["ringbalance"] or row["ngsolve"]]


def _row(kind: str, target: float, ours: Sequence[Trial], theirs: Sequence[Trial]) -> dict[str, Any]:
    """Each ratio takes the fastest of both sides in its own measure; shown are the fastest in solving."""
    sides = [[trial for trial in side if trial.error <= target] for side in (ours, theirs)]
    solve, total = ([min(side, key=time_of, default=None) for side in sides] for time_of in (_solve, _total))
    return {
        "kind": kind,
        "target": target,
        "ringbalance": asdict(solve[0]) if solve[0] else None,
        "ngsolve": asdict(solve[1]) if solve[1] else None,
        "solve_ratio": _solve(solve[1]) / _solve(solve[0]) if solve[0] and solve[1] else None,
        "total_ratio": _total(total[1]) / _total(total[0]) if total[0] and total[1] else None,
    }


def _solve(trial: Trial) -> float:
    return trial.solve_seconds


def _total(trial: Trial) -> float:
    return trial.mesh_seconds + trial.solve_seconds


def document(repeats: int, largest: int, console: Console) -> dict[str, Any]:
    """The whole benchmark.

    Args: `repeats`: of every timing. `largest`: number of unknowns not to be passed. `console`: for progress.
    Returns: A record that JSON can hold.
    """
    disc = paper_disc()
    found = {problem: trials(disc, problem, repeats, console) for problem in PROBLEMS}
    rows = growth(largest, console)
    return {
        "machine": platform.platform(),
        "python": platform.python_version(),
        "ngsolve": rival.VERSION if rival else None,
        "threads": 1,
        "repeats": repeats,
        "trials": [asdict(trial) for problem in PROBLEMS for trial in found[problem]],
        "equal_error": {problem: at_equal_error(found[problem]) for problem in PROBLEMS},
        "growth": rows,
        "growth_exponent": exponent(rows),
    }


def _cell(trial: dict[str, Any] | None) -> list[str]:
    if trial is None:
        return ["-"] * 4
    seconds = trial["solve_seconds"], trial["mesh_seconds"]
    return [
        f"{trial['setting']} ({trial['unknowns']})",
        f"{trial['error']:.1e}",
        f"{1e3 * seconds[0]:.0f}",
        f"{1e3 * sum(seconds):.0f}",
    ]


def show(result: dict[str, Any], console: Console) -> None:
    """Print the tables. Args: `result`: of `document`. `console`: where."""
    if result["ngsolve"] is None:
        console.print("NGSolve is not installed (extra `bench`): one side only.")
    for problem, rows in result["equal_error"].items():
        table = Table(title=f"{problem}: processor time to a given error, ms (nodes in brackets)")
        for heading in ("error <=", "ringbalance", "error", "solve", "all"):
            table.add_column(heading)
        for heading in ("NGSolve", "error", "solve", "all", "ratio solve", "ratio all"):
            table.add_column(heading)
        for row in rows:
            ratios = [f"{row[key]:.2f}" if row[key] else "-" for key in ("solve_ratio", "total_ratio")]
            sides = [*_cell(row["ringbalance"]), *_cell(row["ngsolve"])]
            table.add_row(f"{row['target']:.1e} {row['kind']}", *sides, *ratios)
        console.print(table)
    table = Table(title="growth of the physical problem (processor seconds, peak memory of the process)")
    for heading in ("cells", "unknowns", "iterations", "residual", "error", "mesh", "solve", "MB"):
        table.add_column(heading)
    for row in result["growth"]:
        numbers = [f"{row[key]:.2g}" for key in ("relative_residual", "error")]
        seconds = [f"{row[key]:.2f}" for key in ("mesh_seconds", "solve_seconds")]
        cells = "x".join(map(str, row["cells"]))
        table.add_row(
            cells,
            str(row["unknowns"]),
            str(row["iterations"]),
            *numbers,
            *seconds,
            f"{row['peak_megabytes']:.0f}",
        )
    console.print(table)
    if result["growth_exponent"]:
        console.print(f"time grows as unknowns ** {result['growth_exponent']:.2f}")


def main() -> int:
    """Run as asked on the command line. Returns: Exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON document instead of tables")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--largest", type=int, default=1_100_000, help="unknowns")
    options = parser.parse_args()
    result = document(options.repeats, options.largest, Console(stderr=True))
    if options.json:
        print(json.dumps(result, allow_nan=False))
    else:
        show(result, Console(width=170))
    return 0


if __name__ == "__main__":
    sys.exit(main())
