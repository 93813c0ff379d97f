"""Meshes with their boundary names, and fields on them, as VTU files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
import numpy.typing as npt
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2
from skfem.io.meshio import to_meshio

from ringbalance.mesh.chamber import SIDES, ChamberMesh
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.platform.files import draft_folder, write_whole

# Order in which scikit-fem takes the axes so that its cells come out right-handed in a VTK file.
_CELL_AXES = {2: (1, 0), 3: (0, 1, 2)}


def scikit_fem_mesh(chamber: ChamberMesh) -> tuple[MeshQuad2 | MeshHex2, IntArray]:
    """The same mesh as scikit-fem has it, in units of `length_scale`, with its boundaries by name.

    Returns: The mesh, and for each of its nodes the number that the chamber gives it.
    Raises: ValueError: a mesh that is not quadratic, for which scikit-fem has no cells.
    """
    if chamber.order != 2:
        raise ValueError(f"only a mesh of order 2 can be exported, not one of order {chamber.order}")
    cells = chamber.cells
    first, second = (MeshQuad1, MeshQuad2) if len(cells) == 2 else (MeshHex1, MeshHex2)
    order = _CELL_AXES[len(cells)]
    mesh = second.from_mesh(first.init_tensor(*(np.arange(cells[axis] + 1.0) for axis in order)))
    steps = np.rint(2 * mesh.doflocs[np.argsort(order)]).astype(np.int64)
    numbers = chamber.grid[tuple(steps)]
    middle = mesh.p[:, mesh.facets].mean(axis=1)[np.argsort(order)]
    named = {
        name: np.nonzero(np.abs(middle[axis] - (0 if end == 0 else cells[axis])) < 0.25)[0].astype(np.int32)
        for name, (axis, end) in SIDES.items()
        if axis < len(cells)
    }
    return second(np.ascontiguousarray(chamber.nodes[:, numbers]), mesh.t, named), numbers


def write_vtu(path: Path, *, chamber: ChamberMesh, fields: Mapping[str, npt.ArrayLike] | None = None) -> Path:
    """Write a mesh in metres with its boundary names and nodal fields, whole or not at all.

    Args: `path`: of the file, ending in .vtu. `fields`: nodal values by name, shape (nodes,) each, SI.
    Raises: ValueError: another ending, a mesh that is not quadratic, or a field that is not one finite value
        per node.
    Raises: OSError: the file cannot be written.
    Source: VTK XML through meshio; scikit-fem stores each boundary as cell data "skfem:b:<name>".
    """
    if path.suffix != ".vtu":
        raise ValueError(f"the name of a VTU file must end in .vtu, not {path.suffix!r}")
    nodal = {name: np.asarray(value, dtype=np.float64) for name, value in (fields or {}).items()}
    for name, value in nodal.items():
        if value.shape != chamber.nodes.shape[1:] or not np.all(np.isfinite(value)):
            raise ValueError(f"field {name!r} must hold one finite value per node")
    mesh, numbers = scikit_fem_mesh(chamber)
    stored = to_meshio(
        mesh.scaled(chamber.length_scale), {name: value[numbers] for name, value in nodal.items()}
    )
    # VTK has no points in the plane; meshio would say so on the console.
    stored.points = np.pad(stored.points, ((0, 0), (0, 3 - stored.points.shape[1])))
    return _written(path, stored)


def write_cells(
    path: Path,
    *,
    kind: CellKind,
    points: FloatArray,
    cells: IntArray,
    fields: Mapping[str, FloatArray] | None = None,
) -> Path:
    """Write cells of one kind in metres with nodal fields to a VTU file, whole or not at all.

    Args: `cells`: in meshio's order. `fields`: nodal values by name, SI.
    Raises: OSError: the file cannot be written.
    """
    return _written(path, meshio.Mesh(points, {str(kind): cells}, point_data=dict(fields or {})))


def _written(path: Path, stored: meshio.Mesh) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with draft_folder(path.parent) as folder:
        draft = folder / path.name
        meshio.write(draft, stored)
        return write_whole(path, draft.read_bytes())
