"""The command `ringbalance extremes`."""

from __future__ import annotations

import json as json_format
import os
from contextlib import nullcontext
from pathlib import Path
from typing import Final

from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from ringbalance.reports.pages.extremes import axis_rows
from ringbalance.results.numbers import number
from ringbalance.results.result import Cells
from ringbalance.scene.changes import document_of
from ringbalance.scene.faults import Fault, SceneError, toml_text
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged, write_whole
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity, messages_console, results_console
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.design import Base
from ringbalance.verification.extremes.study import SIZES, Record, find_extremes

DONE: Final = 0
BROKEN: Final = 1
FILE: Final = "extremes.json"
KEPT: Final = "extremes-points.json"


def extremes(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "light",
    workers: int | None = None,
) -> int:
    """Find the limits of validity of a scene: where results stop, what is reported beyond, and whether the
    invariants hold inside.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write extremes.json to this folder; after an interrupted run with the same folder the
            designed set resumes where it stopped.
        level: "heavy" judges thousands of points, for an hour or more.
        workers: processes; default one for each core, at most two.

    Returns:
        Exit code: 0; 1 when an invariant was violated at some point.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    base = base_of(liquid_ring_scene(load_scene(scene)))
    console = messages_console()
    with nullcontext() if out is None else staged(out, files=(KEPT, FILE)) as stage:
        with activity("extremes", "axes") as shown:
            found = find_extremes(
                base,
                size=SIZES[level],
                workers=min(2, os.cpu_count() or 1) if workers is None else checked_workers(workers),
                progress=lambda what, done, number: shown.show(
                    f"{what}: {done} of {number} points", done=done, total=number
                ),
                kept=None if out is None else out / KEPT,
            )
        told, tables = found.document(), found.tables()
        if stage is not None:
            write_whole(stage / FILE, json_format.dumps(told, allow_nan=False) + "\n")
    if out is not None:
        console.print(f"written to {out}", highlight=False)
    if json:
        print(json_format.dumps(told, allow_nan=False))
    else:
        _show(told, axis_rows(tables["axes"]))
    return BROKEN if found.broken() else DONE


def _show(told: Record, rows: list[Cells]) -> None:
    console = results_console()
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
        table.add_row(*(escape(text) for text in row))
    console.print(table, highlight=False)
    for fault in told["violations"]:
        console.print(Padding(f"{fault['violations']} at {fault['point']}", (0, 0, 0, 2)), style="red")


def base_of(scene: Scene) -> Base:
    """Take a scene as the one to vary.

    Raises: SceneError: its chamber is imported.
    """
    if scene.disc.geometry is not None:
        fault = Fault(
            file=scene.file,
            table="disc",
            key="mesh",
            value=toml_text(scene.disc.geometry.file),
            problem="the study takes the dimensions of a sector between plates to their extremes",
            allowed="a scene that gives the dimensions of its chambers",
        )
        raise SceneError([fault])
    return Base(document=document_of(scene), file=scene.source)
