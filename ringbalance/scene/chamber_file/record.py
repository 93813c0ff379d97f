"""Space of one chamber for gas and liquid: keys of [disc] that name its mesh, and the mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated, Final, Literal

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.keys.declaration import standard, unused
from ringbalance.scene.keys.fields import OneLine, Turn

MeshUnit = Literal["m", "cm", "mm", "um", "nm", "in"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]


@dataclass(frozen=True, kw_only=True)
class MeshKeys:
    """Keys of [disc] that name the mesh of a chamber and its position about the shaft."""

    mesh: Annotated[
        OneLine | None,
        unused(
            "a sector between two plates",
            "file of one chamber (.msh, .inp, .vtu, .step), from the scene file's folder; its radii, width, "
            "central_angle and plate_thickness then follow and are not given",
        ),
    ]
    mesh_unit: Annotated[
        MeshUnit | None,
        unused("needed with `mesh`, but for STEP, which has its own", "unit of the file's coordinates"),
    ]
    mesh_axis: Annotated[
        Axis,
        standard(
            "z", "axis of the file along which the shaft lies, through the origin; rotation is positive"
        ),
    ]
    mesh_middle: Annotated[
        Turn | None,
        unused(
            "the middle of what the mesh takes up",
            "angle of the chamber's middle about the shaft, from x for a shaft along z, y for x, z for y",
        ),
    ]


CellKind = Literal["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"]
"""Kind of cells, one in a mesh; names and node orders are meshio's."""
OUTER_WALL: Final = "outer_wall"
"""Name of the boundary that every chamber must have."""
PORT: Final = "port"
WALLS: Final = "walls"
VOLUME: Final = "chamber"
"""Name of the volume, where cells have a name."""
MEANINGS: Final[Mapping[str, str]] = MappingProxyType(
    {
        OUTER_WALL: "farthest from the shaft, where the liquid lies; needed",
        "inner_wall": "nearest to the shaft",
        "plate_left": "radial plate at the higher angle about the shaft",
        "plate_right": "radial plate at the lower angle",
        "end_back": "end wall at the lower coordinate along the shaft",
        "end_front": "end wall at the higher coordinate along the shaft",
        "gas_tube": "outside of a tube or a pin inside the chamber",
        "gas_hole": "mouth of the gas line, or of a gas tube",
        PORT: "opening of the connecting tube; without `port_radius` its mean radius is used",
        WALLS: "any other wall; facets without a name count as this",
    }
)
"""Meaning of each name of a boundary."""
KNOWN_NAMES: Final = tuple(MEANINGS)
STRETCHED: Final = ("outer_radius", "inner_radius", "axial_width", "central_angle")
"""Keys of [disc] that can be changed on a mesh."""


@dataclass(frozen=True, kw_only=True)
class ChamberGeometry:
    """A checked mesh of one chamber.

    Axes: x outward through the middle of the chamber's opening angle, y with the rotation, z along the shaft
    and zero half-way along the chamber.  Two meshes are equal when they were read from the same bytes in
    the same way, so that a disc with a mesh can be the key of a cache.
    """

    file: str = field(compare=False)
    """Name of the mesh file in the scene."""
    digest: str
    """SHA-256 of the file's bytes, of how they were read (unit, axis, middle) and of each stretch."""
    kind: CellKind = field(compare=False)
    points: FloatArray = field(compare=False, repr=False)
    """Coordinates of the nodes, m, shape (n, 3)."""
    cells: IntArray = field(compare=False, repr=False)
    """Numbers of nodes, shape (cells, nodes of a cell); every cell's Jacobian is positive."""
    boundaries: Mapping[str, IntArray] = field(compare=False, repr=False)
    """Facets by name, shape (facets, nodes of a facet), in meshio's order; normals unspecified.  `outer_wall`
    is always there; no facet has two names."""
    stretch: Stretch | None = field(default=None, compare=False, repr=False)
    """Stretch from the mesh of the file; None for that mesh itself."""

    def __str__(self) -> str:
        """Name of the file and summary of its content."""
        return f"{self.file}: {len(self.cells)} {self.kind} cells, {', '.join(self.boundaries)}"

    def stretched(self, *, dimensions: Mapping[str, float], quantity: str, value: float) -> ChamberGeometry:
        """The mesh stretched along the radius, the angle or the shaft until one dimension has another value.

        A radius r becomes R1 + (r - R1) (R2' - R1) / (R2 - R1), so that the other radius stays; angles and
        heights are multiplied.
        Args: `dimensions`: present dimensions of the mesh, SI, by key of `STRETCHED`. `value`: SI.
        Range: small changes; a fillet or a gas tube is stretched with the rest.
        """
        x, y, z = self.points.T
        radius, angle = np.hypot(x, y), np.arctan2(y, x)
        inner, outer = dimensions["inner_radius"], dimensions["outer_radius"]
        new_inner = value if quantity == "inner_radius" else inner
        new_outer = value if quantity == "outer_radius" else outer
        radius = new_inner + (radius - inner) * (new_outer - new_inner) / (outer - inner)
        factor = value / dimensions[quantity]
        angle = angle * (factor if quantity == "central_angle" else 1.0)
        z = z * (factor if quantity == "axial_width" else 1.0)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
        points.flags.writeable = False
        digest = hashlib.sha256(f"{self.digest} {quantity} {value!r}".encode()).hexdigest()
        first = self.stretch or Stretch(base=self, before=dimensions, after=dimensions)
        stretch = replace(first, after={**dimensions, quantity: value})
        return replace(self, points=points, digest=digest, stretch=stretch)


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Stretch of a mesh along radius, angle and shaft, uniform in each."""

    base: ChamberGeometry
    before: Mapping[str, float]
    """Dimensions of the mesh, SI, by their keys in [disc]."""
    after: Mapping[str, float]
