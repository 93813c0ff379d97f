"""What an ensemble costs as it grows, and what the first ones of a machine and of a process cost."""

from __future__ import annotations

import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.console import Console

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reports.pages.consequences import find_consequences
from ringbalance.scene.models import Scene

FIRST_CALL = """
import time
from ringbalance.controller.ensemble import simulate_ensemble
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.loader import bundled_scene, load_scene
scene = load_scene(bundled_scene("liquid_ring_paper"))
start = time.process_time()
simulate_ensemble(scene, paper_model(scene), 1, 0)
print(time.process_time() - start)
"""


@dataclass(frozen=True, kw_only=True)
class Growth:
    """An ensemble of one size."""

    members: int
    seconds: float
    processor_seconds: float
    peak_memory_MiB: float  # noqa: N815 - the unit's own spelling


def growth(
    ensemble: Callable[[int], object], *, first: int, largest: int, factor: int, console: Console
) -> list[Growth]:
    """Ensembles of growing size.

    Args: `ensemble`: runs so many members. `factor`: from one size to the next. `console`: for progress.
    Returns: One entry per size, smallest first.
    """
    found, size = [], first
    while size <= largest:
        console.print(f"{size} members")
        start, used = time.perf_counter(), time.process_time()
        ensemble(size)
        found.append(
            Growth(
                members=size,
                seconds=time.perf_counter() - start,
                processor_seconds=time.process_time() - used,
                peak_memory_MiB=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            )
        )
        size *= factor
    return found


def compile_seconds() -> tuple[float, float]:
    """First ensemble of a machine, and first one of a later process.

    Returns: Processor seconds with an empty folder of compiled code, and with a full one.
    """
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", FIRST_CALL]
        runs = [
            subprocess.run(
                command,
                env=os.environ | {"NUMBA_CACHE_DIR": folder},
                capture_output=True,
                text=True,
                check=True,
            )
            for _ in range(2)
        ]
    return float(runs[0].stdout), float(runs[1].stdout)


def consequences_seconds(scene: Scene) -> float:
    """What a wrong k costs, ensembles and margins included.

    Returns: s, after a first one with few members.
    """
    calibrated = calibrate(scene).model
    find_consequences(scene, calibrated, members=10)
    start = time.perf_counter()
    find_consequences(scene, calibrated)
    return time.perf_counter() - start


def order_of_growth(sizes: Sequence[Growth]) -> float | None:
    """Exponent of the processor time over the number of members, between the two largest ensembles.

    Args: `sizes`: smallest first.
    Returns: 1 for linear growth; None for a single size.
    """
    if len(sizes) < 2:
        return None
    small, large = sizes[-2:]
    return math.log(large.processor_seconds / small.processor_seconds) / math.log(
        large.members / small.members
    )
