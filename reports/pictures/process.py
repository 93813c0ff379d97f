"""The 3-D pictures: asked of a process of its own, so that a report outlives a driver that does not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ringbalance.controller.rotor import chamber_letters
from ringbalance.reports.pictures.fields import chamber_field, shown_fill, write_cells
from ringbalance.reports.pictures.opengl import OpenGL, find_opengl
from ringbalance.scene import Scene

Record = dict[str, Any]

_PATIENCE: Final = 300.0
_FIGURES: Final = "figures"
_FIELDS: Final = "fields"
FOLDERS: Final = (_FIGURES, _FIELDS)
"""Of the files, in an output folder."""
_WHOLE: Final = "chamber"
"""Among the fields of a job: the space of an imported chamber, on which there is no field."""
_SIZE: Final = (1200, 800)
"""Of a picture, pixels, as it is drawn; what draws it is not loaded here."""
NAMES: Final = ("disc", "pressure")
"""Of the pictures; their captions are in templates."""
_JOB: Final = "drawing.json"
_LOG: Final = "drawing.txt"


@dataclass(frozen=True, kw_only=True)
class _Drawing3D:
    """Pictures that are being drawn, or the reason why they are not."""

    process: subprocess.Popen[bytes] | None
    text: str
    folder: Path
    shown: Record
    """What the captions name, SI."""

    def finish(self) -> Record:
        """Wait for the pictures and list them for the evidence."""
        log = self.folder.parent / _LOG
        fault = "" if self.process is None else _fault(self.process, log)
        self.stop()
        for path in (log, log.with_name(_JOB)):
            path.unlink(missing_ok=True)
        if self.process is None or fault:
            return {"drawn": False, "text": fault or self.text, "files": []}
        files = [
            {
                "name": name,
                "light": f"{name}-light.png",
                "dark": f"{name}-dark.png",
                "width": _SIZE[0],
                "height": _SIZE[1],
            }
            for name in NAMES
        ]
        return {"drawn": True, "text": self.text, "files": files, "shown": self.shown}

    def stop(self) -> None:
        """End a drawing that nobody waits for any more."""
        if self.process is not None:
            # All that is left of it: the pipe is closed, and the process waited for.
            self.process.kill()
            self.process.communicate()


def _write_fields(*, scene: Scene, folder: Path) -> dict[str, Path]:
    """Solve and write the pressure fields that the pictures show, and the space of an imported chamber.

    Raises: OSError: a file cannot be written.
    """
    fills = {"pressure": scene.disc.max_fill_ratio, "disc": shown_fill(scene)}
    names = {"pressure": "chamber_largest_fill.vtu", "disc": "chamber_at_start.vtu"}
    written = {
        key: chamber_field(scene, fill_ratio=fill).write(path=folder / _FIELDS / names[key])
        for key, fill in fills.items()
    }
    geometry = scene.disc.geometry
    if geometry is None:
        return written
    path = folder / _FIELDS / "chamber.vtu"
    whole = write_cells(path, kind=geometry.kind, points=geometry.points, cells=geometry.cells)
    return {**written, _WHOLE: whole}


@contextmanager
def drawn(scene: Scene, folder: Path, opengl: OpenGL | None = None) -> Iterator[Callable[[], Record]]:
    """Fields and pictures of a scene, drawn while the body runs; what is given waits for their record.

    Raises: OSError: the folder cannot be written.
    """
    fields = _write_fields(scene=scene, folder=folder)
    drawing = _start_drawing(scene=scene, fields=fields, folder=folder, opengl=opengl)
    try:
        yield drawing.finish
    finally:
        drawing.stop()


def _start_drawing(
    *, scene: Scene, fields: Mapping[str, Path], folder: Path, opengl: OpenGL | None = None
) -> _Drawing3D:
    """Begin to draw in a process of its own, or say why nothing can be drawn.

    Raises: OSError: the folder cannot be written.
    """
    found = find_opengl() if opengl is None else opengl
    figures = folder / _FIGURES
    figures.mkdir(parents=True, exist_ok=True)
    shown = {
        "chambers": scene.disc.chambers,
        "fill_ratio": shown_fill(scene),
        "largest_fill_ratio": scene.disc.max_fill_ratio,
        "crest_radius_m": scene.tube.hump_radius,
        "speed_rad_s": scene.rotor.speed,
    }
    if not found.available:
        return _Drawing3D(process=None, text=found.text, folder=figures, shown=shown)
    job = folder / _JOB
    job.write_text(json.dumps(_job(scene, fields, figures)), encoding="utf-8")
    with open(folder / _LOG, "wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "ringbalance.reports.pictures.draw", str(job)],
            env={**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": found.window, "OMP_NUM_THREADS": "1"},
            # Never written to: it closes when this process ends, however it ends, and then the other ends.
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
    return _Drawing3D(process=process, text=found.text, folder=figures, shown=shown)


def _fault(process: subprocess.Popen[bytes], log: Path) -> str:
    """Empty when the process drew everything, else a sentence."""
    try:
        process.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        return f"The 3-D pictures were left out: drawing took longer than {_PATIENCE:.0f} s."
    if process.returncode == 0:
        return ""
    told = log.read_text(encoding="utf-8", errors="replace").strip()
    last = told.splitlines()[-1] if told else "it said nothing"
    return f"The 3-D pictures were left out: drawing ended with code {process.returncode} ({last})."


def _job(scene: Scene, fields: Mapping[str, Path], folder: Path) -> Record:
    disc, tube = scene.disc, scene.tube
    return {
        "fields": {name: str(path) for name, path in fields.items()},
        "folder": str(folder),
        "chambers": disc.chambers,
        "central_angle": disc.central_angle,
        "letters": list(chamber_letters(disc.chambers)),
        "lengths": {
            "outer_radius": disc.outer_radius,
            "inner_radius": disc.inner_radius,
            "axial_width": disc.axial_width,
            "plate_thickness": disc.plate_thickness,
            "bore": tube.bore,
            "port_radius": tube.port_radius,
            "hump_radius": tube.hump_radius,
        },
    }
