"""The commands `ringbalance report` and `ringbalance plot`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from rich.console import Console

from ringbalance.reports.evidence import Progress
from ringbalance.reports.pictures import finish_drawing, start_drawing, stop_drawing, write_fields
from ringbalance.reports.report import Report, move_into_place, staging, write_report
from ringbalance.reports.section import Level
from ringbalance.reports.summary import lead_sentence, loop_sentence
from ringbalance.scene import liquid_ring_scene, load_scene

DONE: Final = 0
NOT_SOUND: Final = 1
MOST_WORKERS: Final = 2


def report(scene: Path, *, out: Path = Path("out"), level: Level = "light") -> int:
    """Verify, calibrate, simulate and draw: everything, into one HTML file.

    Args:
        scene: the scene file.
        out: folder for report.html, evidence.json, figures/ and fields/.
        level: "heavy" also runs the cases that take long.

    Returns:
        Exit code: 0; 1 when a code-verification case failed, or the loop settled under neither law; the
        report is written all the same.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    told = load_scene(scene)
    console = Console(stderr=True)
    with _stages(console) as progress:
        finished = write_report(
            told,
            out,
            level=level,
            scene_text=scene.read_text(encoding="utf-8"),
            workers=min(MOST_WORKERS, os.cpu_count() or 1),
            progress=progress,
        )
    _summarise(console, finished)
    print(finished.page)
    return DONE if finished.sound else NOT_SOUND


def plot(scene: Path, *, out: Path = Path("out")) -> int:
    """Draw the off-screen pictures alone.

    Args:
        scene: the scene file.
        out: folder for figures/*.png and fields/*.vtu.

    Returns:
        Exit code: 0; 1 when this machine cannot draw, the fields being written.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    told = liquid_ring_scene(load_scene(scene))
    console = Console(stderr=True)
    with staging(out) as stage, _stages(console) as progress:
        progress("pressure fields")
        drawing = start_drawing(scene=told, fields=write_fields(scene=told, folder=stage), folder=stage)
        try:
            progress("pictures")
            pictures = finish_drawing(drawing)
        finally:
            stop_drawing(drawing)
        move_into_place(stage, out)
    if not pictures["drawn"]:
        console.print(pictures["text"], markup=False, highlight=False)
    print(out)
    return DONE if pictures["drawn"] else NOT_SOUND


@contextmanager
def _stages(console: Console) -> Iterator[Progress]:
    """A spinner that names the stage; without a terminal, one line a stage."""
    if not console.is_terminal:
        yield lambda stage: None if ": " in stage else console.print(stage, markup=False, highlight=False)
        return
    with console.status("reading") as status:
        yield lambda stage: status.update(stage)


def _summarise(console: Console, finished: Report) -> None:
    evidence = finished.evidence
    for line in (lead_sentence(evidence), loop_sentence(evidence)):
        console.print(line, markup=False, highlight=False)
    if not evidence["pictures"]["drawn"]:
        console.print(evidence["pictures"]["text"], markup=False, highlight=False)
    console.print(f"took {evidence['times']['total_s']:.0f} s", style="dim", highlight=False)
