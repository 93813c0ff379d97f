"""Meshes of the liquid in a chamber, their quality, closed-form geometry, and VTU files."""

from ringbalance.mesh.chamber import ChamberMesh, chamber_mesh, default_cells
from ringbalance.mesh.export import StoredMesh, read_vtu, write_vtu
from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    liquid_area,
    liquid_first_moment,
    surface_radius,
)
from ringbalance.mesh.quality import MeshQuality, mesh_quality

__all__ = [
    "ChamberMesh",
    "MeshQuality",
    "StoredMesh",
    "chamber_mesh",
    "chamber_volume",
    "default_cells",
    "half_angle",
    "liquid_area",
    "liquid_first_moment",
    "mesh_quality",
    "read_vtu",
    "surface_radius",
    "write_vtu",
]
