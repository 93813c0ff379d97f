"""Meshes with their boundary names, and fields on them, as VTU files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
import numpy.typing as npt
from skfem import Mesh
from skfem.io.meshio import to_meshio

from ringbalance.scene.platform.drafts import draft_folder
from ringbalance.scene.platform.files import write_whole


def write_vtu(
    path: Path,
    *,
    mesh: Mesh,
    length_scale: float = 1.0,
    fields: Mapping[str, npt.ArrayLike] | None = None,
) -> Path:
    """Write a mesh in metres with its boundary names and nodal fields, whole or not at all.

    Args: `path`: of the file, ending in .vtu. `mesh`: coordinates in units of `length_scale`. `length_scale`:
        m. `fields`: nodal values by name, shape (nodes,) each, in SI units.
    Raises: ValueError: another ending, or a field that is not one finite value per node.
    Raises: OSError: the file cannot be written.
    Source: VTK XML through meshio; scikit-fem stores each boundary as cell data "skfem:b:<name>".
    """
    if path.suffix != ".vtu":
        raise ValueError(f"the name of a VTU file must end in .vtu, not {path.suffix!r}")
    nodal = {name: np.asarray(value, dtype=np.float64) for name, value in (fields or {}).items()}
    for name, value in nodal.items():
        if value.shape != (mesh.doflocs.shape[1],) or not np.all(np.isfinite(value)):
            raise ValueError(f"field {name!r} must hold one finite value per node")
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(path.parent) as folder:
        draft = folder / path.name
        stored = to_meshio(mesh.scaled(length_scale), nodal)
        # VTK has no points in the plane; meshio would say so on the console.
        stored.points = np.pad(stored.points, ((0, 0), (0, 3 - stored.points.shape[1])))
        meshio.write(draft, stored)
        return write_whole(path, draft.read_bytes())
