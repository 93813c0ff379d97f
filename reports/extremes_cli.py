"""The command `ringbalance extremes`."""

from __future__ import annotations

import json as json_format
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as Bar
from rich.table import Table

from ringbalance.reports.extremes import axis_rows, map_drawings
from ringbalance.reports.figure_style import standalone
from ringbalance.reports.numbers import number
from ringbalance.scene.files import write_whole
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes import (
    SIZES,
    Progress,
    Record,
    broken,
    extremes_document,
    extremes_tables,
    find_extremes,
    scene_base,
)

DONE: Final = 0
BROKEN: Final = 1
KEPT: Final = "extremes-points.json"


def extremes(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "light",
    workers: int | None = None,
) -> int:
    """Take a scene to its extremes: where answers end, what is said beyond, and whether all holds in between.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write extremes.json and the stability maps to this folder; after an interrupted run with
            the same folder the designed set goes on where it stopped.
        level: "heavy" judges thousands of points, for an hour or more.
        workers: processes; default one for each core, at most two.

    Returns:
        Exit code: 0; 1 when anything was not as it should be at some point.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    base = scene_base(scene)
    console = Console(stderr=True)
    with _progress(console) as progress:
        found = find_extremes(
            base,
            size=SIZES[level],
            workers=workers or min(2, os.cpu_count() or 1),
            progress=progress,
            kept=None if out is None else out / KEPT,
        )
    told, tables = extremes_document(found), extremes_tables(found)
    if out is not None:
        write_whole(out / "extremes.json", json_format.dumps(told, allow_nan=False) + "\n")
        for drawing in map_drawings(tables):
            write_whole(out / f"{drawing.name}.svg", standalone(drawing))
        console.print(f"written to {out}", highlight=False)
    if json:
        print(json_format.dumps(told, allow_nan=False))
    else:
        _show(told, axis_rows(tables["axes"]))
    return BROKEN if broken(found) else DONE


@contextmanager
def _progress(console: Console) -> Iterator[Progress]:
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("points", total=None)
        yield lambda what, done, number: bar.update(task, completed=done, total=number, description=what)


def _show(told: Record, rows: list[Record]) -> None:
    console = Console()
    endings = ", ".join(f"{count} {ending}" for ending, count in told["endings"].items() if count)
    console.print(f"{told['judged']} points: {endings}", highlight=False)
    console.print(
        f"largest residual {number(told['worst_residual'], digits=2)}; largest error "
        f"{number(told['worst_error_over_half_width'], digits=2)} of its half-width",
        highlight=False,
    )
    table = Table(box=None, header_style="dim", padding=(0, 1))
    for title in ("input", "stretch", "answer", "loop", "said"):
        table.add_column(title, overflow="fold")
    for row in rows:
        table.add_row(*(escape(text) for text in row.values()))
    console.print(table, highlight=False)
    for fault in told["violations"]:
        console.print(Padding(f"{fault['violations']} at {fault['point']}", (0, 0, 0, 2)), style="red")
