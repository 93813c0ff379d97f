"""The command `ringbalance extremes`."""

from __future__ import annotations

import json as json_format
import os
from contextlib import nullcontext
from pathlib import Path
from typing import Final

from ringbalance.scene.changes import document_of
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged, write_whole
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity, messages_console, results_console
from ringbalance.scene.toml import toml_text
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.design import Base
from ringbalance.verification.extremes.study import SIZES, find_extremes

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
        text = json_format.dumps(found.to_dict(), allow_nan=False)
        if stage is not None:
            write_whole(stage / FILE, text + "\n")
    if out is not None:
        console.print(f"written to {out}", highlight=False)
    if json:
        print(text)
    else:
        results_console().print(found.rows().view(headline=False))
    return BROKEN if found.broken() else DONE


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
