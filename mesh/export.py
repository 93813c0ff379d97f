"""Meshes with their boundary names, and fields on them, as VTU files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import numpy.typing as npt
from skfem.io.meshio import to_meshio

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.platform.files import draft_folder, write_whole


def write_vtu(path: Path, *, mesh: Any, fields: Mapping[str, npt.ArrayLike] | None = None) -> Path:
    """Write a mesh of scikit-fem in metres with its boundary names and nodal fields, whole or not at all.

    Args: `path`: of the file, ending in .vtu. `fields`: nodal values by name, shape (nodes,) each, SI.
    Raises: ValueError: another ending, or a field that is not one finite value per node.
    Raises: OSError: the file cannot be written.
    Source: VTK XML through meshio; scikit-fem stores each boundary as cell data "skfem:b:<name>".
    """
    if path.suffix != ".vtu":
        raise ValueError(f"the name of a VTU file must end in .vtu, not {path.suffix!r}")
    nodal = {name: np.asarray(value, dtype=np.float64) for name, value in (fields or {}).items()}
    for name, value in nodal.items():
        if value.shape != mesh.doflocs.shape[1:] or not np.all(np.isfinite(value)):
            raise ValueError(f"field {name!r} must hold one finite value per node")
    stored = to_meshio(mesh, nodal)
    # VTK has no points in the plane; meshio would say so on the console.
    stored.points = np.pad(stored.points, ((0, 0), (0, 3 - stored.points.shape[1])))
    return _written(path, stored)


def write_cells(path: Path, *, kind: CellKind, points: FloatArray, cells: IntArray) -> Path:
    """Write cells of one kind in metres to a VTU file, whole or not at all.

    Args: `cells`: in meshio's order.
    Raises: OSError: the file cannot be written.
    """
    return _written(path, meshio.Mesh(points, {str(kind): cells}))


def _written(path: Path, stored: meshio.Mesh) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(path.parent) as folder:
        draft = folder / path.name
        meshio.write(draft, stored)
        return write_whole(path, draft.read_bytes())
