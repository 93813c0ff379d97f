"""Separate process that meshes a STEP file with Gmsh: `python -m ... solid.step solid.msh 0.1`.

Faces have the names in the STEP file.  If it names none, the faces at the largest and smallest distance from
the z axis are the outer and the inner wall, and those at the ends of the solid the end walls.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from typing import Final

import gmsh

from ringbalance.scene.chamber_file.record import KNOWN_NAMES
from ringbalance.scene.platform.memory import bounded_memory

_MEMORY_BYTES: Final = 4 * 2**30
_SAME_RADIUS_SHARE: Final = 1e-6
_Entity = tuple[int, int]


def _mesh_step(source: str, target: str, share: float) -> None:
    """Write the mesh of a STEP file in metres. Args: `share`: size of cells over the solid's extent."""
    gmsh.initialize(["gmsh", "-nopopup"], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.model.occ.importShapes(source)
    gmsh.model.occ.synchronize()
    volumes = gmsh.model.getEntities(3)
    if not volumes:
        raise SystemExit("the file has no solid")
    box = gmsh.model.getBoundingBox(-1, -1)
    size = share * max(box[axis + 3] - box[axis] for axis in range(3))
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 2 * math.pi / max(share, 0.05))
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.SecondOrderLinear", 0)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 1)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size / 50)
    gmsh.model.mesh.generate(3)
    faces = gmsh.model.getEntities(2)
    # A name is the last part of a label such as "Shapes/Body/outer_wall".
    labels = {face: str(gmsh.model.getEntityName(*face)).rsplit("/", 1)[-1].strip().lower() for face in faces}
    named = {face: label for face, label in labels.items() if label in KNOWN_NAMES} or dict(_placed(faces))
    for name in dict.fromkeys(named.values()):
        gmsh.model.addPhysicalGroup(2, [tag for (_, tag), each in named.items() if each == name], name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in volumes], name="chamber")
    gmsh.write(target)


def _placed(faces: list[_Entity]) -> Iterator[tuple[_Entity, str]]:
    """Faces with names by their position about the z axis."""
    nodes = {}
    for face in faces:
        _, xyz, _ = gmsh.model.mesh.getNodes(*face, includeBoundary=True)
        rows = zip(xyz[::3], xyz[1::3], xyz[2::3], strict=True)
        nodes[face] = [(math.hypot(x, y), z) for x, y, z in rows]
    radii = [radius for each in nodes.values() for radius, _ in each]
    heights = [height for each in nodes.values() for _, height in each]
    near = _SAME_RADIUS_SHARE * max(radii)
    for face, each in nodes.items():
        for name, axis, value in (
            ("outer_wall", 0, max(radii)),
            ("inner_wall", 0, min(radii)),
            ("end_back", 1, min(heights)),
            ("end_front", 1, max(heights)),
        ):
            if all(abs(node[axis] - value) < near for node in each):
                yield face, name


if __name__ == "__main__":
    with bounded_memory(_MEMORY_BYTES):
        _mesh_step(sys.argv[1], sys.argv[2], float(sys.argv[3]))
