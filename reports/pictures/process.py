"""The 3-D pictures, drawn in a separate process, so that a crash of the driver does not end a report."""

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

import meshio

from ringbalance.controller.rotor import chamber_letters
from ringbalance.reports.pictures.fields import chamber_field, shown_fill, write_mesh
from ringbalance.reports.pictures.opengl import OpenGL, find_opengl
from ringbalance.scene import Scene

Record = dict[str, Any]

_TIMEOUT_S: Final = 300.0
_FIGURES: Final = "figures"
_FIELDS: Final = "fields"
FOLDERS: Final = (_FIGURES, _FIELDS)
_SIZE_PIXELS: Final = (1200, 800)
"""Size of a picture, equal to that of the drawing module, which is not loaded here."""
PICTURE_NAMES: Final = ("disc", "pressure")
_JOB: Final = "drawing.json"
_LOG: Final = "drawing.txt"


@dataclass(frozen=True, kw_only=True)
class _Drawing3D:
    """Drawing in progress, or the reason why nothing is drawn."""

    process: subprocess.Popen[bytes] | None
    text: str
    folder: Path
    shown: Record
    """Numbers for the captions, SI."""

    def finish(self) -> Record:
        """Wait for the pictures and list them for the evidence."""
        log, fault = self.folder.parent / _LOG, ""
        if self.process is not None:
            try:
                if code := self.process.wait(_TIMEOUT_S):
                    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
                    reason = lines[-1] if lines else "it said nothing"
                    fault = f"The 3-D pictures were left out: drawing ended with code {code} ({reason})."
            except subprocess.TimeoutExpired:
                fault = f"The 3-D pictures were left out: drawing took longer than {_TIMEOUT_S:.0f} s."
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
                "width": _SIZE_PIXELS[0],
                "height": _SIZE_PIXELS[1],
            }
            for name in PICTURE_NAMES
        ]
        return {"drawn": True, "text": self.text, "files": files, "shown": self.shown}

    def stop(self) -> None:
        """End a drawing that is no longer needed."""
        if self.process is not None:
            # This closes the pipe and waits for the process.
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
    if geometry is not None:
        path = folder / _FIELDS / "chamber.vtu"
        cells = meshio.Mesh(geometry.points, {str(geometry.kind): geometry.cells})
        written["chamber"] = write_mesh(path, cells)
    return written


@contextmanager
def drawing_beside(
    scene: Scene, folder: Path, opengl: OpenGL | None = None
) -> Iterator[Callable[[], Record]]:
    """Draw fields and pictures of a scene while the body runs; the function yielded waits for their record.

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
    """Begin to draw in a separate process, or record why nothing can be drawn.

    Raises: OSError: the folder cannot be written.
    """
    machine = find_opengl() if opengl is None else opengl
    figures = folder / _FIGURES
    figures.mkdir(parents=True, exist_ok=True)
    shown = {
        "chambers": scene.disc.chambers,
        "fill_ratio": shown_fill(scene),
        "largest_fill_ratio": scene.disc.max_fill_ratio,
        "crest_radius_m": scene.tube.hump_radius,
        "speed_rad_s": scene.rotor.speed,
    }
    if not machine.available:
        return _Drawing3D(process=None, text=machine.text, folder=figures, shown=shown)
    job = folder / _JOB
    disc, tube = scene.disc, scene.tube
    content = {
        "fields": {name: str(path) for name, path in fields.items()},
        "folder": str(figures),
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
    job.write_text(json.dumps(content), encoding="utf-8")
    with open(folder / _LOG, "wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "ringbalance.reports.pictures.draw", str(job)],
            env={**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": machine.window, "OMP_NUM_THREADS": "1"},
            # Never written to: it closes whenever this process ends, and then the drawing process ends.
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
    return _Drawing3D(process=process, text=machine.text, folder=figures, shown=shown)
