"""Table of the laminar end losses.

Each end is one path in Re, followed on every mesh.  A finished path is a file, so that a stopped run resumes.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from flow_at_points import probe
from rich.console import Console
from rich.progress import Progress

from ringbalance.physics.convergence import gci
from ringbalance.scene import write_whole
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, StepRule, follow
from ringbalance.verification.navier_stokes.tube import (
    End,
    EndMesh,
    solve_end,
)

ROOT = Path(__file__).resolve().parents[1]
ENDS: tuple[End, End] = ("entrance", "exit")
REYNOLDS_SCALE, REYNOLDS_LIMIT = 5.0, 2000.0
DEVELOPED_SLOPE = 32.0
"""-dp/dx of developed flow, over mu U/d^2."""


def end_loss_times_reynolds(
    *, system: FlowSystem, solution: FlowSolution, end: End, cells: EndMesh, share: float = 0.9
) -> float:
    """K Re of an end, from the pressure deep in the tube beyond developed friction.

    K_ent Re = -2 (p + 32 x), K_exit Re = 2 (p - 32 |x|), p on the axis at |x| = `share` of the tube's length.
    Args: `end`: "entrance" or "exit". `share`: fraction of the length at which p is taken.
    """
    distance = share * cells.tube
    at = distance if end == "entrance" else -distance
    pressure = float(probe(system=system, solution=solution, points=[[at], [0.0]])[-1, 0])
    if end == "entrance":
        return -2 * (pressure + DEVELOPED_SLOPE * distance)
    return 2 * (pressure - DEVELOPED_SLOPE * distance)


@dataclass(frozen=True, kw_only=True)
class EndSettings:
    """Settings that determine the table of end losses."""

    nodes: int = 30
    """Reynolds numbers from 0 to the limit, evenly spaced in ln(1 + Re/5)."""
    checks: tuple[int, ...] = (0, 4, 8, 12, 16, 20, 24, 28)
    """Numbers of the intervals between nodes that have a check point half-way."""
    cells_per_fold: tuple[float, ...] = (1.8, 2.4, 3.2)
    edge_cell: float = 1e-4
    reservoir: float = 40.0
    entrance_tube: float = 300.0
    exit_tube: float = 6.0
    exit_jet_cell: float = 2.0
    formal_order: float = 4.0

    def points(self) -> list[tuple[str, float]]:
        """Kind, "node" or "check", and ln(1 + Re/5) of all points, in rising order."""
        nodes = np.round(np.linspace(0.0, np.log1p(REYNOLDS_LIMIT / REYNOLDS_SCALE), self.nodes), 12)
        listed = [("node", float(a)) for a in nodes]
        listed += [("check", float((nodes[i] + nodes[i + 1]) / 2)) for i in self.checks]
        return sorted(listed, key=lambda point: point[1])

    def mesh(self, end: End, level: int) -> EndMesh:
        """Mesh of an end.

        Args: `end`: "entrance" or "exit". `level`: 0 is the coarsest.
        Returns: Its domain and grading.
        """
        return EndMesh(
            cells_per_fold=self.cells_per_fold[level],
            edge_cell=self.edge_cell,
            reservoir=self.reservoir,
            tube=self.entrance_tube if end == "entrance" else self.exit_tube,
            jet_cell=6.0 if end == "entrance" else self.exit_jet_cell,
        )


def _solve(system: FlowSystem, a: float, start: FlowSolution | None) -> FlowSolution:
    reynolds = REYNOLDS_SCALE * float(np.expm1(a))
    newton = NewtonSettings(max_iterations=12, tolerance=1e-8)
    return solve_end(system=system, reynolds=reynolds, start=start, settings=newton)


def run_path(*, end: End, level: int, settings: EndSettings, points: list[float]) -> list[float]:
    """K Re of one end on one mesh.

    Args: `end`: "entrance" or "exit". `level`: of the mesh, 0 is the coarsest. `settings`: of the table.
        `points`: ln(1 + Re/5), rising, the first 0.
    Returns: K Re at the points.
    Raises: ArithmeticError: a point could not be reached; the text says which.
    """
    cells = settings.mesh(end, level)
    system = cells.system(end=end)
    flow = _solve(system, 0.0, None)
    path = follow(
        solve=partial(_solve, system),
        start=flow,
        start_at=0.0,
        targets=points[1:],
        rule=StepRule(first=1.0, smallest=0.01),
    )
    if not path.status.ok:
        raise ArithmeticError(f"{end}, level {level}: {path.status.text}")
    flows = [flow, *path.solutions]
    return [end_loss_times_reynolds(system=system, solution=f, end=end, cells=cells) for f in flows]


def _run_to_file(end: End, level: int, settings: EndSettings, folder: Path) -> None:
    points = [a for _, a in settings.points()]
    values = run_path(end=end, level=level, settings=settings, points=points)
    write_whole(folder / f"{end}_{level}.json", json.dumps(values))


def table_text(*, folder: Path, settings: EndSettings) -> str:
    """The table as CSV with its header, from the files of the paths."""
    levels = range(len(settings.cells_per_fold))
    sizes = [1 / c for c in reversed(settings.cells_per_fold)]
    rows = ["end,kind,a,coarse,medium,fine,uncertainty"]
    for end in ENDS:
        runs = [json.loads((folder / f"{end}_{level}.json").read_text(encoding="utf-8")) for level in levels]
        for (kind, a), values in zip(settings.points(), zip(*runs, strict=True), strict=True):
            convergence = gci(
                values=list(values)[::-1], sizes=sizes, formal_order=settings.formal_order, round_off=1e-6
            )
            rows.append(
                f"{end},{kind},{a!r},{','.join(f'{v:.7f}' for v in values)},{convergence.uncertainty:.3e}"
            )
    body = "\n".join(rows) + "\n"
    plain = json.dumps(asdict(settings), sort_keys=True)
    head = [
        "K Re of a tube's sharp-edged ends in laminar flow, a = ln(1 + Re/5), by finite elements",
        "(axisymmetric) on three meshes; uncertainty: 95 % half-width of the fine value (GCI).",
        "K_ent and K_exit are static pressure differences over rho U^2/2, beyond developed friction.",
        "Computed by: python tools/generate.py --write end_losses",
        f"settings: {plain}",
        f"settings_sha256: {hashlib.sha256(plain.encode()).hexdigest()}",
        f"data_sha256: {hashlib.sha256(body.encode()).hexdigest()}",
    ]
    return "".join(f"# {line}\n" for line in head) + body


def generate(*, folder: Path, settings: EndSettings, executor: Executor) -> None:
    """Follow all paths that have no file yet, with progress on standard error.

    Args: `settings`: of the table. `executor`: of any kind, such as a process pool.
    """
    levels = reversed(range(len(settings.cells_per_fold)))
    jobs = [(end, level) for level in levels for end in ENDS]
    missing = [job for job in jobs if not (folder / f"{job[0]}_{job[1]}.json").exists()]
    with Progress(console=Console(file=sys.stderr)) as progress:
        bar = progress.add_task("end losses", total=len(jobs), completed=len(jobs) - len(missing))
        futures = [executor.submit(_run_to_file, end, level, settings, folder) for end, level in missing]
        for future in as_completed(futures):
            future.result()
            progress.advance(bar)


def files(_: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Path and bytes of the table; finished paths are kept in out/end_losses/."""
    settings = EndSettings()
    digest = hashlib.sha256(json.dumps(asdict(settings), sort_keys=True).encode()).hexdigest()
    folder = ROOT / "out" / "end_losses" / digest[:12]
    with Workers(2) as executor:
        generate(folder=folder, settings=settings, executor=executor)
    yield (
        ROOT / "ringbalance" / "physics" / "data" / "end_losses.csv",
        table_text(folder=folder, settings=settings).encode(),
    )
