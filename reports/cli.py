"""The commands `ringbalance report` and `ringbalance plot`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from ringbalance.reports.pictures import process
from ringbalance.reports.report import write_report
from ringbalance.scene import Scene, liquid_ring_scene, load_scene, read_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.processes import beside
from ringbalance.scene.platform.terminal import activity, print_message, since_start
from ringbalance.verification.evidence import Level

DONE: Final = 0
_NOT_SOUND: Final = 1
_MOST_WORKERS: Final = 2


def report(
    scene: Path,
    *,
    out: Path = Path("out"),
    level: Level = "light",
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Verify, calibrate, simulate and draw: everything, into a report and its annex.

    Args:
        scene: the scene file.
        out: folder for report.html, annex.html, evidence.json, figures/, fields/ and tables/.
        level: "heavy" also runs the cases that take long.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 the report is written, whatever it says of the scene; 1 a check of the program failed;
        the report is written all the same.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    told, text = read_scene(scene)
    workers = min(_MOST_WORKERS, os.cpu_count() or 1)
    with activity("report", "reading") as shown, beside(workers, loading=_load) as pool:
        finished = write_report(
            with_tolerance(told, tolerance=tolerance, models=models),
            out,
            level=level,
            scene_text=text,
            workers=pool or 1,
            progress=shown.show,
        )
    for line in finished.summary:
        print_message(line)
    print_message(f"took {since_start():.0f} s")
    print(finished.page)
    return DONE if finished.sound else _NOT_SOUND


def _load() -> bool:
    """Called in a worker: what a report needs is then there."""
    return callable(write_report)


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
    with activity("plot", "pressure fields") as shown:
        pictures = draw_pictures(told, out, progress=shown.show)
    if not pictures["drawn"]:
        print_message(pictures["text"])
    print(out)
    return DONE if pictures["drawn"] else _NOT_SOUND


def draw_pictures(
    scene: Scene, out: Path, *, progress: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Write figures/*.png and fields/*.vtu of a scene.

    Returns: `drawn`, and `text` with the reason where this machine cannot draw.
    Raises: OSError: the folder cannot be written.
    """
    with staged(out, folders=process.FOLDERS) as stage, process.drawn(scene, stage) as pictures:
        progress("pictures")
        return pictures()
