"""Friction table of the rotating tube.

Each column of a rectangle is one path, followed on the medium mesh from slow rotation upwards; every point of
it is then solved on the other meshes, starting from that flow.  Each finished point is a file, so that a
stopped run resumes.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, wait
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from flow_at_points import transfer
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn

from ringbalance.physics.convergence import gci
from ringbalance.physics.tube.rotation_table import (
    KL_LIMIT,
    KL_SCALE,
    ROTATION_LIMIT,
    ROTATION_SCALE,
    fast_first,
    least_s,
    slow_first,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, StepRule, follow
from ringbalance.verification.navier_stokes.tube import (
    SectionMesh,
    friction_ratio,
    solve_section,
    solve_section_without_inertia,
)

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = ("table", "a", "b", "coarse", "medium", "fine", "uncertainty")


@dataclass(frozen=True, kw_only=True)
class TableSettings:
    """Settings that determine the table."""

    slow_a: tuple[float, ...]
    slow_b: tuple[float, ...]
    fast_a: tuple[float, ...]
    fast_b: tuple[float, ...]
    around: tuple[int, ...] = (8, 12, 16)
    """Cells n of `SectionMesh`, coarse to fine; one and a half times as many across."""
    wall_ratio: float = 15.0
    formal_order: float = 4.0
    """Order of the friction ratio, a functional of a velocity that converges at order 2 in its gradient."""
    newton_tolerance: float = 1e-7
    path_level: int = 1
    """Mesh on which the paths are followed; the other meshes start from its flows."""
    branch_kl: float = 7e5
    """Kl above which further steady flows exist, so that a long step may converge to one of them."""
    branch_step: float = 0.06
    """Longest step in `a` above that Kl."""

    def plain(self) -> dict[str, object]:
        """Settings as plain data, for a header. Returns: Field names and values."""
        return asdict(self)


def _rounded(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(v) for v in np.round(values, 12))


def table_settings() -> TableSettings:
    """Settings of the table that comes with the package."""
    return TableSettings(
        slow_a=_rounded(np.linspace(0.0, slow_first(KL_LIMIT), 24)),
        slow_b=_rounded(np.arange(11) / 12),
        fast_a=_rounded(np.linspace(0.0, fast_first(ROTATION_LIMIT), 20)),
        fast_b=_rounded(np.linspace(0.0, 1.0, 5)),
    )


def slow_pair(a: float, b: float) -> tuple[float, float]:
    """Kl and S of a point of the slow rectangle. Args: `a`: ln(1 + Kl/300). `b`: S/(1 + S)."""
    return float(KL_SCALE * np.expm1(a)), b / (1 - b)


def fast_pair(a: float, b: float) -> tuple[float, float]:
    """R and 1/S of a point of the fast rectangle. Args: `a`: ln(1 + R/20). `b`: S_min(R)/S."""
    rotation = float(ROTATION_SCALE * np.expm1(a))
    return rotation, float(b / least_s(rotation))


@dataclass(frozen=True, kw_only=True)
class Column:
    """One path: a rectangle's column b with its points a."""

    table: str
    """Name of the rectangle, "slow" or "fast", with "_check" for points between nodes."""
    b: float
    points: tuple[float, ...]


def columns(settings: TableSettings) -> tuple[Column, ...]:
    """All paths of the table and of its checks between nodes, the longest first."""
    slow = [Column(table="slow", b=b, points=settings.slow_a[1:]) for b in settings.slow_b]
    fast = [Column(table="fast", b=b, points=settings.fast_a[1:]) for b in settings.fast_b]
    checks = [_between("slow_check", settings.slow_a, settings.slow_b, j) for j in (0, 2, 5, 9)]
    checks += [_between("fast_check", settings.fast_a, settings.fast_b, j) for j in (0, 3)]
    return (*slow, *fast, *checks)


def _between(table: str, first: Sequence[float], second: Sequence[float], index: int) -> Column:
    """Points half-way between nodes, every second one, on a path half-way between columns."""
    middles = [(low + high) / 2 for low, high in pairwise(first)]
    return Column(
        table=table, b=(second[index] + second[index + 1]) / 2, points=tuple(middles[index % 2 :: 2])
    )


def solve_point(
    column: Column, system: FlowSystem, settings: NewtonSettings, a: float, start: FlowSolution | None
) -> FlowSolution:
    """Flow at one point of a path. Args: `start`: a neighbouring flow on the same mesh."""
    if column.table.startswith("slow"):
        kl, s = slow_pair(a, column.b)
    else:
        rotation, inverse_s = fast_pair(a, column.b)
        if inverse_s == 0.0:
            return solve_section_without_inertia(system=system, rotation_reynolds=rotation)
        kl, s = rotation**2 * inverse_s, 1 / inverse_s
    return solve_section(system=system, kl=kl, s=s, start=start, settings=settings)


def systems(settings: TableSettings) -> list[FlowSystem]:
    """Discrete sections of all meshes, coarse to fine."""
    meshes = [
        SectionMesh(around=n, across=3 * n // 2, wall_ratio=settings.wall_ratio) for n in settings.around
    ]
    return [mesh.system() for mesh in meshes]


def _all_values(
    column: Column, a: float, flow: FlowSolution, meshes: list[FlowSystem], settings: TableSettings
) -> list[float]:
    """Friction ratios on all meshes, coarse to fine, from the flow on the path's mesh."""
    newton = NewtonSettings(tolerance=settings.newton_tolerance, max_iterations=30)
    values = []
    for level, mesh in enumerate(meshes):
        solution = flow
        if level != settings.path_level:
            moved = transfer(source=meshes[settings.path_level], solution=flow, target=mesh)
            solution = solve_point(column, mesh, newton, a, replace(flow, vector=moved))
        if not solution.status.ok:
            raise ArithmeticError(f"{column.table} a = {a}, b = {column.b}: {solution.status.text}")
        values.append(friction_ratio(solution))
    return values


def _point_file(folder: Path, column: Column, a: float) -> Path:
    return folder / f"{column.table}_{column.b:.12f}_{a:.12f}.json"


def run_column(*, column: Column, folder: Path, settings: TableSettings) -> int:
    """Solve the points of one path that have no file yet.

    Returns: Number of points solved on all meshes.
    Raises: ArithmeticError: a point could not be reached; the text says which.
    """
    if all(_point_file(folder, column, a).exists() for a in column.points):
        return 0
    meshes, done = systems(settings), 0
    for a, flow in zip(column.points, _path(column, meshes[settings.path_level], settings), strict=True):
        if not _point_file(folder, column, a).exists():
            values = _all_values(column, a, flow, meshes, settings)
            write_whole(_point_file(folder, column, a), json.dumps(values))
            done += 1
    return done


def _path(column: Column, system: FlowSystem, settings: TableSettings) -> list[FlowSolution]:
    """Flows at the column's points on one mesh, in short steps where further branches exist."""
    newton = NewtonSettings(max_iterations=12)
    solve = partial(solve_point, column, system, newton)
    easy = [a for a in column.points if _kl(column, a) <= settings.branch_kl]
    hard = [a for a in column.points if _kl(column, a) > settings.branch_kl]
    short = StepRule(first=settings.branch_step, largest=settings.branch_step, smallest=0.002)
    flows: list[FlowSolution] = []
    at, flow = 0.01, solve(0.01, None)
    for targets, rule in ((easy, StepRule(first=0.5, smallest=0.01)), (hard, short)):
        path = follow(solve=solve, start=flow, start_at=at, targets=targets, rule=rule)
        if not path.status.ok:
            raise ArithmeticError(f"{column.table} b = {column.b}: {path.status.text}")
        flows += path.solutions
        at, flow = (targets[-1], flows[-1]) if targets else (at, flow)
    return flows


def _kl(column: Column, a: float) -> float:
    if column.table.startswith("slow"):
        return slow_pair(a, column.b)[0]
    rotation, inverse_s = fast_pair(a, column.b)
    return rotation**2 * inverse_s


def settings_hash(settings: TableSettings) -> str:
    """SHA-256 of the settings as sorted JSON. Returns: Hexadecimal digits."""
    return hashlib.sha256(json.dumps(settings.plain(), sort_keys=True).encode()).hexdigest()


def _row(column: Column, a: float, values: list[float], settings: TableSettings) -> str:
    sizes = [1 / n for n in reversed(settings.around)]
    # Newton's tolerance bounds the noise that the difference of two meshes carries.
    noise = settings.newton_tolerance * values[-1]
    solution = gci(values=values[::-1], sizes=sizes, formal_order=settings.formal_order, round_off=noise)
    numbers = ",".join(f"{v:.9f}" for v in values)
    return f"{column.table},{a!r},{column.b!r},{numbers},{solution.uncertainty:.3e}"


def table_text(*, folder: Path, settings: TableSettings) -> str:
    """The table as CSV with its header, from the point files."""
    rows = []
    for column in columns(settings):
        for a in column.points:
            values = json.loads(_point_file(folder, column, a).read_text(encoding="utf-8"))
            rows.append(_row(column, a, values, settings))
    body = "\n".join([",".join(COLUMNS), *rows]) + "\n"
    head = [
        "Friction ratio F = f/f0 of laminar developed flow in a tube rotating about an axis across it,",
        "by finite elements on three meshes; uncertainty: 95 % half-width of the fine value (GCI).",
        "slow: a = ln(1 + Kl/300), b = S/(1 + S); fast: a = ln(1 + R/20), b = S_min(R)/S; F = 1 at a = 0.",
        "Computed by: python tools/generate.py --write rotating_friction",
        f"settings: {json.dumps(settings.plain(), sort_keys=True)}",
        f"settings_sha256: {settings_hash(settings)}",
        f"data_sha256: {hashlib.sha256(body.encode()).hexdigest()}",
    ]
    return "".join(f"# {line}\n" for line in head) + body


def generate(*, folder: Path, settings: TableSettings, executor: Executor) -> None:
    """Solve all points that have no file yet, with progress on standard error.

    Args: `executor`: of any kind, such as a process pool.
    """
    paths = columns(settings)
    total = sum(len(column.points) for column in paths)
    with Progress(
        *Progress.get_default_columns(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(file=sys.stderr),
    ) as progress:
        bar = progress.add_task("rotating section", total=total)
        pending: set[Future[int]] = {
            executor.submit(run_column, column=column, folder=folder, settings=settings) for column in paths
        }
        while pending:
            done, pending = wait(pending, timeout=2.0)
            for future in done:
                future.result()
            progress.update(bar, completed=sum(1 for _ in folder.glob("*.json")))


def files(_: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Path and bytes of the table; points are kept in out/rotating_friction/."""
    settings = table_settings()
    folder = ROOT / "out" / "rotating_friction" / settings_hash(settings)[:12]
    with Workers(2) as executor:
        generate(folder=folder, settings=settings, executor=executor)
    table = table_text(folder=folder, settings=settings)
    yield ROOT / "ringbalance" / "physics" / "data" / "rotating_friction.csv", table.encode()
