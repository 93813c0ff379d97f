"""Write OpenFOAM cases and run its programs: dictionaries from mappings, meshes from hexahedra.

The programs are those of Debian's package `openfoam` (1912).  Meshes are written as a polyMesh, so that
OpenFOAM can solve on this program's cells or on any other hexahedra.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray

PROGRAMS = ("SRFSimpleFoam", "pimpleFoam", "makeFaMesh", "interFoam")
_DEBIAN = "/usr/share/openfoam"
"""Folder in Debian's package for the paths that OpenFOAM's own shell setup would set."""

# Corners of a hexahedron's six faces, seen from outside counter-clockwise; corner order of VTK and OpenFOAM.
_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


@dataclass(frozen=True, kw_only=True, eq=False)
class HexMesh:
    """Points, shape (n, 3), and cells by their corners, shape (m, 8), in OpenFOAM's order."""

    points: FloatArray
    cells: IntArray
    patches: Mapping[str, tuple[IntArray, Mapping[str, Any]]]
    """Faces by name, each a row of four points in any order, and the entries of the boundary file."""


def extruded(*, points: FloatArray, quads: IntArray) -> tuple[FloatArray, IntArray]:
    """Points and hexahedra between copies of quadrilaterals on levels.

    Args: `points`: on every level, shape (levels, n, 3). `quads`: shape (m, 4), counter-clockwise seen from
        the next level.
    """
    levels, count = points.shape[:2]
    cells = [np.hstack([quads + k * count, quads + (k + 1) * count]) for k in range(levels - 1)]
    return points.reshape(-1, 3), np.concatenate(cells)


def sides(*, edges: IntArray, count: int, slabs: int) -> IntArray:
    """Faces that stand on edges of the section, level by level: shape (edges x slabs, 4)."""
    foot = np.concatenate([edges + k * count for k in range(slabs)])
    return np.hstack([foot, foot[:, ::-1] + count])


def write_mesh(*, folder: Path, mesh: HexMesh) -> None:
    """Write the polyMesh: faces between cells by owner and neighbour, then those of each patch by owner.

    Raises: ValueError: a face of a patch that is not on the boundary, or a boundary face in no patch.
    """
    corners = mesh.cells[:, np.array(_FACES)].reshape(-1, 4)
    cell = np.repeat(np.arange(len(mesh.cells)), 6)
    key = np.sort(corners, axis=1)
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    group = inverse.ravel()
    partner = np.full(len(first), -1)
    later = np.flatnonzero(first[group] != np.arange(len(group)))
    partner[group[later]] = cell[later]
    inner = np.flatnonzero(partner >= 0)
    order = inner[np.lexsort((partner[inner], cell[first[inner]]))]
    numbers, entries, start = [order], [], len(order)
    index = {tuple(row): i for i, row in enumerate(key[first].tolist())}
    for name, (rows, entry) in mesh.patches.items():
        matches = np.array([index[tuple(row)] for row in np.sort(rows, axis=1).tolist()], dtype=np.int64)
        if np.any(partner[matches] >= 0):
            raise ValueError(f"patch {name} has a face between two cells")
        numbers.append(matches[np.argsort(cell[first[matches]], kind="stable")])
        entries.append((name, {**entry, "nFaces": len(matches), "startFace": start}))
        start += len(matches)
    faces = first[np.concatenate(numbers)]
    if len(faces) != len(first):
        raise ValueError("a face of the boundary is in no patch")
    _write_parts(folder / "constant" / "polyMesh", mesh.points, corners[faces], cell[faces], partner[order])
    body = "".join(f"{name}\n{_braces(entry)}" for name, entry in entries)
    _write(folder / "constant/polyMesh/boundary", "polyBoundaryMesh", f"{len(entries)}\n(\n{body})\n")


def _write_parts(
    folder: Path, points: FloatArray, faces: IntArray, owner: IntArray, neighbour: IntArray
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    rows = {
        ("points", "vectorField"): ["({:.16g} {:.16g} {:.16g})".format(*row) for row in points],
        ("faces", "faceList"): ["4({} {} {} {})".format(*row) for row in faces],
        ("owner", "labelList"): [str(value) for value in owner],
        ("neighbour", "labelList"): [str(value) for value in neighbour],
    }
    for (name, kind), lines in rows.items():
        _write(folder / name, kind, f"{len(lines)}\n(\n" + "\n".join(lines) + "\n)\n")


def _write(path: Path, kind: str, body: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    header = {"version": "2.0", "format": "ascii", "class": kind, "object": path.name}
    path.write_text(f"FoamFile\n{_braces(header)}\n{body}", encoding="ascii")


def _braces(entries: Mapping[str, Any]) -> str:
    return "{\n" + _entries(entries) + "}\n"


def _entries(entries: Mapping[str, Any]) -> str:
    lines = []
    for key, value in entries.items():
        lines.append(f"{key}\n{_braces(value)}" if isinstance(value, Mapping) else f"{key} {_word(value)};\n")
    return "".join(lines)


def _word(value: Any) -> str:
    if isinstance(value, (tuple, list)):
        return "(" + " ".join(map(_word, value)) + ")"
    return f"{value:.16g}" if isinstance(value, float) else str(value)


def vector(value: Sequence[float]) -> str:
    """A vector in the notation of dictionaries."""
    return _word(tuple(float(v) for v in value))


def write_case(*, folder: Path, mesh: HexMesh, files: Mapping[str, Mapping[str, Any]]) -> None:
    """Write a new case: the mesh, and dictionaries and uniform fields by path; a previous case is removed."""
    shutil.rmtree(folder, ignore_errors=True)
    for path, entries in files.items():
        kind = entries.get("class", "dictionary")
        body = {key: value for key, value in entries.items() if key != "class"}
        _write(folder / path, str(kind), _entries(body))
    write_mesh(folder=folder, mesh=mesh)


def field(
    *, kind: str, dimensions: str, value: str, boundary: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """A uniform field with its boundary conditions, for `write_case`."""
    return {
        "class": kind,
        "dimensions": dimensions,
        "internalField": f"uniform {value}",
        "boundaryField": boundary,
    }


def missing() -> str:
    """Advice where OpenFOAM is not on the path; empty: it is."""
    absent = [program for program in PROGRAMS if shutil.which(program) is None]
    if not absent:
        return ""
    return (
        f"OpenFOAM is missing (no {', '.join(absent)} on the path): install Debian's package openfoam "
        "(1912), or run `make bench-cfd` as root, which does it."
    )


@dataclass(frozen=True, kw_only=True)
class Run:
    """Output of a program, and its processor time, s."""

    text: str
    seconds: float


def run(program: str, *, folder: Path) -> Run:
    """Run one program of OpenFOAM on a case.

    Raises: RuntimeError: it failed; the text is the end of what it printed.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [program, "-case", str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env={"WM_PROJECT_DIR": _DEBIAN, **os.environ},
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    (folder / f"log.{program}").write_text(done.stdout, encoding="utf-8")
    if done.returncode != 0:
        raise RuntimeError(f"{program} in {folder}:\n{(done.stdout + done.stderr)[-1500:]}")
    return Run(text=done.stdout, seconds=after.ru_utime - before.ru_utime)


def last_number(text: str, pattern: str) -> float:
    """The last number that a program printed behind a pattern.

    Raises: ValueError: nothing matches.
    """
    matches = re.findall(pattern + r"\s*=?\s*([-+0-9.eE]+)", text)
    if not matches:
        raise ValueError(f"no {pattern!r} in what OpenFOAM printed")
    return float(matches[-1])
