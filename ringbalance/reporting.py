"""Reports and pictures of a scene, for Python and as commands."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from ringbalance.design.choices import with_valves
from ringbalance.interface import checked
from ringbalance.reports.pictures import process
from ringbalance.reports.report import Report
from ringbalance.reports.report import write_report as write_scene_report
from ringbalance.scene import AnyScene, Scene, liquid_ring_scene, load_scene, read_scene
from ringbalance.scene.changes import document_of
from ringbalance.scene.narrowing import with_tolerance
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.processes import beside
from ringbalance.scene.platform.terminal import activity, print_message, since_start
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.evidence import Level

_MAX_WORKERS: Final = 2


@checked
def plot(scene: AnyScene, out: str | PathLike[str]) -> tuple[Path, ...]:
    """Draw the 3-D pictures of a scene into a folder, and its fields for ParaView.

    Without OpenGL the fields alone are written, with a warning.
    Returns: The files.
    Raises: SceneError: a scene that cannot be used. OSError: the folder cannot be written.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> files = rb.plot(scene, "pictures")
        >>> ".vtu" in {path.suffix for path in files}
        True
    """
    pictures = _draw(liquid_ring_scene(scene), Path(out))
    if not pictures["drawn"]:
        warnings.warn(pictures["text"], RuntimeWarning, stacklevel=2)
    folders = Path(out) / "figures", Path(out) / "fields"
    return tuple(path for folder in folders for path in sorted(folder.glob("*.*")))


@checked
def write_report(
    scene: AnyScene,
    out: str | PathLike[str],
    *,
    level: Level = "light",
    workers: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Verify, calibrate, simulate and draw a scene into one folder.

    Args: `level`: "heavy" also runs the cases that take long. `workers`: processes, this one included.
        `progress`: called with what is being done.
    Raises: SceneError: a scene that cannot be used; nothing is written.
    Raises: OSError: the folder cannot be written.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> report = rb.write_report(scene, "out")
        >>> report.page.name
        'report.html'
    """
    return write_scene_report(
        scene,
        Path(out),
        level=level,
        scene_text=toml_bytes(document_of(scene)).decode(),
        workers=workers,
        progress=progress,
    )


def report(options: SimpleNamespace) -> int:
    """Run the command `report`. Returns: Exit code: 1 when a check of the program failed."""
    scene, text = read_scene(options.scene)
    if options.valves or options.seed is not None:
        scene = with_valves(scene, options.valves) if options.valves else scene
        scene = scene if options.seed is None else scene.with_values({"run.seed": options.seed})
        text = toml_bytes(document_of(scene)).decode()
    workers = min(_MAX_WORKERS, os.cpu_count() or 1)
    with activity("report", "reading") as shown, beside(workers, loading=_load) as pool:
        finished = write_scene_report(
            with_tolerance(scene, options.tolerance),
            options.out,
            level=options.level,
            scene_text=text,
            workers=pool or 1,
            progress=shown.show,
        )
    for line in finished.summary:
        print_message(line)
    print_message(f"took {since_start():.0f} s")
    print(finished.page)
    return 0 if finished.sound else 1


def _load() -> bool:
    """Load, in a worker, the modules that a report needs."""
    return callable(write_scene_report)


def plot_file(options: SimpleNamespace) -> int:
    """Run the command `plot`. Returns: Exit code: 1 when this machine cannot draw."""
    scene = liquid_ring_scene(load_scene(options.scene))
    with activity("plot", "pressure fields") as shown:
        pictures = _draw(scene, options.out, progress=shown.show)
    if not pictures["drawn"]:
        print_message(pictures["text"])
    print(options.out)
    return 0 if pictures["drawn"] else 1


def _draw(scene: Scene, out: Path, *, progress: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Write figures/*.png and fields/*.vtu of a scene.

    Returns: `drawn`, and `text` with the reason where this machine cannot draw.
    """
    with staged(out, folders=process.FOLDERS) as stage, process.drawing_beside(scene, stage) as pictures:
        progress("pictures")
        return pictures()
