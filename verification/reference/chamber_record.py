"""The built-in chamber as a mesh file would give it: its own hexahedra in an imported chamber's record."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
from skfem.io.meshio import to_meshio

from ringbalance.mesh.chamber import SIDES, chamber_mesh
from ringbalance.mesh.export import scikit_fem_mesh
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.facets import boundary_facets
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Disc

_NAMES = {"free_surface": "inner_wall"}
"""Of the side that bounds the liquid of a full chamber."""


def chamber_record(disc: Disc, *, cells: tuple[int, int, int]) -> ChamberGeometry:
    """The whole space of a chamber, its sides as boundaries.

    Args: `disc`: a sector between plates. `cells`: along radius, angle and axis.
    """
    chamber = chamber_mesh(disc=disc, surface_radius=disc.inner_radius, cells=cells)
    mesh, numbers = scikit_fem_mesh(chamber)
    stored = to_meshio(mesh.scaled(chamber.length_scale))
    points = np.asarray(stored.points, dtype=np.float64)
    nodes = np.asarray(stored.cells_dict["hexahedron27"], dtype=np.int64)
    record = ChamberGeometry(
        file="built in",
        digest=_digest(points, nodes),
        kind="hexahedron27",
        points=points,
        cells=nodes,
        boundaries={},
    )
    facets = boundary_facets(record)
    named = {}
    for name, (axis, end) in SIDES.items():
        side = np.isin(numbers, np.take(chamber.grid, end, axis=axis))
        named[_NAMES.get(name, name)] = facets[np.all(side[facets], axis=1)]
    return replace(record, boundaries=named)


def _digest(points: FloatArray, cells: IntArray) -> str:
    return hashlib.sha256(points.tobytes() + cells.tobytes()).hexdigest()


def imported(disc: Disc, *, cells: tuple[int, int, int] = (4, 16, 2)) -> Disc:
    """The disc with its own chamber imported."""
    return replace(disc, geometry=chamber_record(disc, cells=cells))
