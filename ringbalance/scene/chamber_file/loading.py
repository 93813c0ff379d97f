"""The mesh that a scene names: read, checked and converted to the record and the dimensions of the disc."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.scene.chamber_file.body import Body, Contents, MeshFileError
from ringbalance.scene.chamber_file.fitting import PORT_RADIUS, Placed, placed, port_radius, unfitting
from ringbalance.scene.chamber_file.mesh_file import FORMATS, READERS
from ringbalance.scene.chamber_file.record import ChamberGeometry, MeshKeys
from ringbalance.scene.chamber_file.soundness import Facets, boundaries_of, oriented
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Contradiction
from ringbalance.scene.platform.files import read_bounded
from ringbalance.scene.uncertain import SHAPE
from ringbalance.scene.units import DIMENSIONS

_STEP_ENDINGS: Final = (".step", ".stp")
_STEP_UNIT: Final = "m"
_MESHING_TIME_S: Final = 300
_COARSEST, _FINEST = 1 / 6, 1 / 40
"""Largest and smallest size of cells over the extent of the solid."""
_LARGEST_FILE_BYTES: Final = 2**28


def with_chamber(reading: SceneReading, *, folder: Path) -> tuple[SceneReading, tuple[Fault, ...]]:
    """The reading with geometry and dimensions of the mesh that it names, and all errors of the mesh."""
    keys = [f"disc.{key}" for key in keys_of(MeshKeys)]
    if not reading.given("disc.mesh"):
        problem, allowed = "it has no meaning without mesh", "mesh as well, or leave the key out"
        stated = filter(reading.given, keys)
        return reading, tuple(reading.fault(key, problem=problem, allowed=allowed) for key in stated)
    allowed = "either mesh or this key; the mesh decides"
    superfluous = tuple(
        reading.fault(f"disc.{key}", problem="it follows from the mesh", allowed=allowed)
        for key in SHAPE
        if reading.given(f"disc.{key}")
    )
    unit: tuple[Fault, ...] = ()
    if reading.known("disc.mesh"):
        path, step = "disc.mesh_unit", _is_step(Path(reading.values["disc.mesh"]))
        if step and reading.given(path):
            problem, allowed = "a STEP file has its own unit", "leave the key out"
            unit = (reading.fault(path, problem=problem, allowed=allowed),)
        elif not step and reading.lacks(path):
            unit = (reading.missing(path, "the file's coordinates have no unit"),)
    unknown = replace(reading, broken=reading.broken | {f"disc.{key}" for key in (*SHAPE, "geometry")})
    if unit or reading.broken & set(keys) or not reading.known("accuracy.tolerance"):
        return unknown, (*superfluous, *unit)
    try:
        geometry, placement = _chamber(reading, folder)
    except (MeshFileError, MemoryError) as error:
        problem = "memory does not suffice to check a mesh of this size"
        scarce = Contradiction(problem=problem, allowed="a coarser mesh")
        faults = list(superfluous)
        for each in error.findings if isinstance(error, MeshFileError) else (scarce,):
            # Names in a file may not be printable.
            problem = "".join(letter if letter.isprintable() else "?" for letter in each.problem)
            faults.append(reading.fault("disc.mesh", problem=problem, allowed=each.allowed))
        return unknown, tuple(faults)
    if superfluous:
        return unknown, superfluous
    values: dict[str, Any] = {f"disc.{key}": value for key, value in placement.dimensions.items()}
    port = port_radius(placement.points, geometry.boundaries)
    if port is not None and reading.lacks(PORT_RADIUS):
        values[PORT_RADIUS] = port
    return reading.following({**values, "disc.geometry": geometry}), ()


def _chamber(reading: SceneReading, folder: Path) -> tuple[ChamberGeometry, Placed]:
    """The mesh of a scene. Raises: MeshFileError: with all its errors."""
    name = reading.values["disc.mesh"]
    path, ending, step = folder / name, Path(name).suffix, _is_step(Path(name))
    if ending.lower() not in (*READERS, *_STEP_ENDINGS):
        raise MeshFileError.of(f"a name that ends with {ending[:20] or 'no .ending'} is not read", FORMATS)
    content, problem = read_bounded(path, what="mesh", most=_LARGEST_FILE_BYTES, regular=True)
    if problem:
        raise MeshFileError.of(f"{path}: {problem}", "a path from the folder of the scene file")
    if not content.strip():
        raise MeshFileError.of("the file is empty", FORMATS)
    unit = _STEP_UNIT if step else reading.values["disc.mesh_unit"]
    tolerance = reading.values["accuracy.tolerance"] if step else 0.0
    contents = _meshed_step(content, tolerance=tolerance) if step else READERS[ending.lower()](content)
    body = Body.of(contents, scale=float(DIMENSIONS["length"].units[unit].factor))
    body, misshapen = oriented(body)
    facets = Facets.of(body)
    boundaries, misnamed = boundaries_of(body, facets)
    axis, middle = reading.values["disc.mesh_axis"], reading.values.get("disc.mesh_middle")
    placement, misplaced = placed(body, boundaries, facets.nodes[facets.outer], axis=axis, middle=middle)
    everything = [
        *facets.findings(body),
        *misshapen,
        *misnamed,
        *misplaced,
        *unfitting(reading, body, placement, boundaries, unit),
    ]
    if everything:
        raise MeshFileError(everything)
    # Without nodes that belong to no cell.
    used = np.unique(body.cells)
    new = np.zeros(len(body.points), dtype=np.int64)
    new[used] = np.arange(len(used))
    arrays = {each: new[facets] for each, facets in boundaries.items()}
    points, cells = placement.points[used], new[body.cells]
    for array in (points, cells, *arrays.values()):
        array.flags.writeable = False
    reading_options = (unit, axis, middle, tolerance)
    geometry = ChamberGeometry(
        file=name,
        digest=hashlib.sha256(content + repr(reading_options).encode()).hexdigest(),
        kind=body.kind,
        points=points,
        cells=cells,
        boundaries=arrays,
    )
    return geometry, placement


def _is_step(path: Path) -> bool:
    """True for a file of a solid, which must be meshed and states its own unit."""
    return path.suffix.lower() in _STEP_ENDINGS


def _meshed_step(content: bytes, *, tolerance: float) -> Contents:
    """The mesh of a STEP file in metres, of second order.

    The size of the cells over the extent of the solid is the cube root of the tolerance over 2: the
    error of quadratic cells falls with the third power of their size.
    Raises: MeshFileError: Gmsh is missing, or cannot mesh the solid in time.
    """
    if find_spec("gmsh") is None:
        problem = "a STEP file needs the extra cad, which meshes it"
        raise MeshFileError.of(problem, 'pip install "ringbalance[cad]", or a mesh in place of the solid')
    if b"ISO-10303-21" not in content[:1000]:
        raise MeshFileError.of("this is not a STEP file: it does not begin with ISO-10303-21")
    share = min(max(tolerance ** (1 / 3) / 2, _FINEST), _COARSEST)
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "solid.step", Path(folder) / "solid.msh"
        source.write_bytes(content)
        command = [sys.executable, "-m", "ringbalance.scene.chamber_file.step_meshing"]
        try:
            child = subprocess.run(
                [*command, str(source), str(target), repr(share)],
                capture_output=True,
                timeout=_MESHING_TIME_S,
                check=False,
                cwd=folder,
            )
        except subprocess.TimeoutExpired as error:
            raise MeshFileError.of(
                f"Gmsh has not meshed the solid within {_MESHING_TIME_S} s", "a mesh"
            ) from error
        if child.returncode or not target.exists():
            lines = child.stderr.decode("utf-8", errors="replace").strip().splitlines()
            reason = "".join(each for each in (lines or ["it ended"])[-1] if each.isprintable())[:200]
            raise MeshFileError.of(f"Gmsh cannot mesh the solid: {reason}", "one solid with a closed surface")
        return READERS[".msh"](target.read_bytes())
