"""The command `ringbalance design`."""

from __future__ import annotations

import json as json_format
import os
from pathlib import Path

from ringbalance.design.design_rows import design_document, design_rows
from ringbalance.design.designing import run_design
from ringbalance.results.result import Presentation, print_rows
from ringbalance.scene.changes import file_text
from ringbalance.scene.loader import load_scene
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity


def design(scene: Path, *, save: Path | None = None, workers: int | None = None, json: bool = False) -> int:
    """Design what a scene's table [design] leaves open: the smallest disc that meets what is required.

    Args:
        scene: the scene file, with [requirement] and [design].
        save: write the scene as designed, with its settings.
        workers: processes; default one for each processor.
        json: print one JSON document instead of tables.

    Returns:
        Exit code: 0 the design meets what the scene requires in the fraction of drawn devices that it asks
        for; 1 otherwise; the result is printed either way.

    Raises:
        SceneError: a scene that cannot be used, or that leaves nothing to choose.
        OSError: a file that cannot be written.
    """
    if save is not None:
        check_file(save, apart_from=scene)
    workers = checked_workers((os.cpu_count() or 1) if workers is None else workers)
    presentation = Presentation(document=design_document, rows=design_rows)
    with activity("design", "designs ...") as shown:
        found = run_design(load_scene(scene), presentation=presentation, workers=workers, progress=shown.show)
    if save is not None and found.judgement is not None:
        write_whole(save, file_text(found.recommended_scene, to=save.parent))
    if json:
        print(json_format.dumps(found.to_dict(), allow_nan=False))
    else:
        print_rows(found.rows())
    return 0 if found.succeeded else 1
