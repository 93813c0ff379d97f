"""The space of one chamber, gas and liquid together, as cells with named boundaries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from ringbalance.scene.arrays import FloatArray, IntArray

_DIGITS: Final = 7
CellKind = Literal["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"]
"""One kind in a mesh; names and orders of nodes are meshio's."""


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

    def __str__(self) -> str:
        """The file and what it holds, for people."""
        return f"{self.file}: {len(self.cells)} {self.kind} cells, {', '.join(self.boundaries)}"


def rounded(dimensions: Mapping[str, float]) -> dict[str, float]:
    """Dimensions of a mesh to as many digits as a file's rounding leaves.

    Rounding in a file shall not put a port just outside its wall.
    """
    return {key: float(f"{value:.{_DIGITS}g}") for key, value in dimensions.items()}
