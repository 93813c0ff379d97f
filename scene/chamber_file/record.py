"""The space of one chamber, gas and liquid together, as cells with named boundaries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from ringbalance.scene.arrays import FloatArray, IntArray

CellKind = Literal["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"]
"""One kind in a mesh; names and orders of nodes are meshio's."""
OUTER_WALL: Final = "outer_wall"
"""The boundary that every chamber has."""


@dataclass(frozen=True, kw_only=True)
class ChamberGeometry:
    """A checked mesh of one chamber.

    Axes: x outward through the middle of the chamber's opening angle, y with the rotation, z along the shaft
    and zero half-way along the chamber.  Two are equal when they were read from the same bytes in the same
    way, so that a disc with one can be the key of a cache.
    """

    file: str = field(compare=False)
    """As the scene names it."""
    digest: str
    """SHA-256 of the file's bytes, unit and axis."""
    kind: CellKind = field(compare=False)
    points: FloatArray = field(compare=False, repr=False)
    """Places of the nodes, m, shape (n, 3)."""
    cells: IntArray = field(compare=False, repr=False)
    """Numbers of nodes, shape (cells, nodes of a cell); every cell's Jacobian is positive."""
    boundaries: Mapping[str, IntArray] = field(compare=False, repr=False)
    """Facets by name, shape (facets, nodes of a facet), in meshio's order; normals unspecified.  `outer_wall`
    is always there; no facet has two names."""
    stretch: Stretch | None = field(default=None, compare=False, repr=False)
    """How it came from the mesh of a file; None for that mesh itself."""

    def __str__(self) -> str:
        """The file and what it holds, for people."""
        return f"{self.file}: {len(self.cells)} {self.kind} cells, {', '.join(self.boundaries)}"


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A mesh drawn out along radius, angle and shaft, each evenly."""

    base: ChamberGeometry
    before: Mapping[str, float]
    """Dimensions of the mesh, SI, by their keys in [disc]."""
    after: Mapping[str, float]
