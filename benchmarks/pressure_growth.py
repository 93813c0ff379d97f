"""Cost of the physical problem over its size, every size in a process of its own so that memory does not mix.

python benchmarks/pressure_growth.py 12 36 6        # one size: cells along radius, angle and axis
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pressure_problems import paper_disc, paper_surface, relative_error, right_hand_sides
from rich.console import Console

from ringbalance.mesh.chamber import chamber_mesh
from ringbalance.physics.pressure.solve import solve_pressure

ORDER = 4
CELLS = ((4, 12, 2), (6, 18, 3), (8, 24, 4), (12, 36, 6), (16, 48, 8), (22, 66, 11))


@dataclass(frozen=True, kw_only=True)
class Size:
    """One solve of the physical problem."""

    cells: tuple[int, ...]
    unknowns: int
    iterations: int
    """Of conjugate gradients."""
    relative_residual: float
    error: float
    mesh_seconds: float
    """Processor time on one thread."""
    solve_seconds: float
    """Of setting up and solution, likewise."""
    peak_megabytes: float
    """Of the whole process, the interpreter and its libraries included."""


def one_size(cells: tuple[int, ...]) -> Size:
    """Solve once on one mesh.

    Args: `cells`: along radius, angle and axis.
    Returns: What it took.
    """
    disc = paper_disc()
    start = time.process_time()
    chamber = chamber_mesh(disc=disc, surface_radius=paper_surface(disc), cells=cells, order=ORDER)
    meshed = time.process_time()
    solution = solve_pressure(chamber=chamber, problem=right_hand_sides("physical", disc))
    solved = time.process_time()
    peak = _peak_megabytes()
    return Size(
        cells=cells,
        unknowns=solution.statistics.unknowns,
        iterations=solution.statistics.iterations,
        relative_residual=solution.statistics.relative_residual,
        error=relative_error("physical", chamber, solution),
        mesh_seconds=meshed - start,
        solve_seconds=solved - meshed,
        peak_megabytes=peak,
    )


def _peak_megabytes() -> float:
    # Not getrusage: a child starts with its parent's peak there.
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    return float(found[1]) / 1024 if found else 0.0


def growth(largest: int, console: Console) -> list[dict[str, Any]]:
    """Cost over sizes.

    Args: `largest`: number of unknowns not to be passed. `console`: for progress.
    Returns: One row per size.
    """
    rows = []
    for cells in CELLS:
        if np.prod([ORDER * n + 1 for n in cells]) > largest:
            break
        console.print(f"growth: {'x'.join(map(str, cells))}")
        command = [sys.executable, str(Path(__file__)), *map(str, cells)]
        child = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        rows.append(json.loads(child.stdout))
    return rows


def exponent(rows: Sequence[dict[str, Any]]) -> float | None:
    """Slope of log time over log unknowns, from ten thousand on: below, calls cost more than arithmetic.

    Args: `rows`: of `growth`.
    Returns: The slope; None with fewer than two such rows.
    """
    large = [row for row in rows if row["unknowns"] > 10_000]
    if len(large) < 2:
        return None
    size, seconds = (np.log([row[key] for row in large]) for key in ("unknowns", "solve_seconds"))
    return float(np.polyfit(size, seconds, 1)[0])


if __name__ == "__main__":
    print(json.dumps(asdict(one_size(tuple(int(n) for n in sys.argv[1:4])))))
