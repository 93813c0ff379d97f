"""The keys of [disc] that give one chamber as a mesh file."""

from dataclasses import dataclass
from typing import Annotated, Literal

from ringbalance.scene.keys.declaration import standard, unused
from ringbalance.scene.keys.fields import OneLine, Turn

MeshUnit = Literal["m", "cm", "mm", "um", "nm", "in"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]


@dataclass(frozen=True, kw_only=True)
class MeshKeys:
    """Where the mesh of a chamber is and how it lies about the shaft."""

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
