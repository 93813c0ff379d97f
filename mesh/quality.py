"""How good a mesh is: the smallest scaled Jacobian and the aspect of its cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import Mesh


@dataclass(frozen=True, kw_only=True)
class MeshQuality:
    """Quality figures over all cells of a mesh; none depends on the unit of length."""

    minimum_scaled_jacobian: float
    """Smallest sine (in three dimensions: triple product) of the local axes; 1 is square, 0 or less is
    folded."""
    maximum_aspect: float
    """Longest over shortest local axis in one cell, at least 1."""
    cells: int
    nodes: int


def mesh_quality(mesh: Mesh) -> MeshQuality:
    """Quality of a mesh of quadratic quadrilaterals or hexahedra, judged at the nodes of every cell.

    scaled Jacobian = det(J) / prod_b |J_b| with J_b = dx/dX_b, aspect = max_b |J_b| / min_b |J_b|.
    Args: `mesh`: scikit-fem mesh, coordinates in any unit.
    Source: the scaled Jacobian of the Verdict library (Knupp et al., SAND2007-1751), at all nodes of a
    quadratic cell instead of its corners alone.
    """
    points = np.asarray(mesh.elem.doflocs, dtype=np.float64).T
    jacobian = np.moveaxis(mesh.mapping().DF(points), (0, 1), (-2, -1))
    lengths = np.linalg.norm(jacobian, axis=-2)
    # scikit-fem numbers the corners of a hexahedron so that its local axes are left-handed.
    handedness = 1 if jacobian.shape[-1] == 2 else -1
    scaled = handedness * np.linalg.det(jacobian / lengths[..., None, :])
    return MeshQuality(
        minimum_scaled_jacobian=float(scaled.min()),
        maximum_aspect=float((lengths.max(axis=-1) / lengths.min(axis=-1)).max()),
        cells=int(mesh.t.shape[1]),
        nodes=int(mesh.doflocs.shape[1]),
    )
