"""Draw the example of an imported chamber: the paper's, with fillets at its plates and a gas tube inside.

python tools/example_chamber.py            needs the extra cad (Gmsh); writes scenes/chamber_with_gas_tube.msh
and, without fillets, the mesh of the case gas_tube, which compares it with closed forms.

Radii, width and plates are those of scenes/liquid_ring_paper.toml.  The fillets and the tube are assumed: the
paper draws a tube and gives no size of it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path

import gmsh

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "scenes" / "chamber_with_gas_tube.msh"
CASE = ROOT / "verification" / "cases" / "gas_tube" / "data" / "chamber.msh"
OUTER, INNER, WIDTH, PLATE = 44.5, 20.5, 62.0, 2.777
FILLET = 4.0
TUBE_RADIUS, MOUTH = 2.5, 33.5
"""Outer radius of the gas tube, and the radius at which it ends; mm."""
SIZE = 22.0


def draw(*, fillets: bool) -> None:
    """The solid: a quarter ring between parallel strips of plate, rounded at the outer wall, less a tube."""
    occ = gmsh.model.occ
    ring = occ.cut(
        [(3, occ.addCylinder(0, 0, -WIDTH / 2, 0, 0, WIDTH, OUTER))],
        [(3, occ.addCylinder(0, 0, -WIDTH / 2, 0, 0, WIDTH, INNER))],
    )[0]
    corner = PLATE * math.sqrt(2)
    box = occ.addBox(0, 0, -WIDTH / 2, 2 * OUTER, 2 * OUTER, WIDTH)
    occ.rotate([(3, box)], 0, 0, 0, 0, 0, 1, -math.pi / 4)
    occ.translate([(3, box)], corner, 0, 0)
    ((_, chamber),) = occ.intersect(ring, [(3, box)])[0]
    occ.synchronize()
    if fillets:
        occ.fillet([chamber], outer_edges(), [FILLET])
        occ.synchronize()
    ((_, chamber),) = gmsh.model.getEntities(3)
    tube = occ.addCylinder(INNER - 2, 0, 0, MOUTH - INNER + 2, 0, 0, TUBE_RADIUS)
    occ.cut([(3, chamber)], [(3, tube)])
    occ.synchronize()


def outer_edges() -> list[int]:
    """Edges along the shaft at which plates and outer wall meet."""
    found = []
    for _, tag in gmsh.model.getEntities(1):
        (low,), (high,) = gmsh.model.getParametrizationBounds(1, tag)
        x, y, z = gmsh.model.getValue(1, tag, [(low + high) / 2])
        if abs(z) < 1e-6 and math.hypot(x, y) > OUTER - 1e-3:
            found.append(tag)
    return found


def name_of(tag: int) -> str:
    """The boundary that a face is, by where the nodes inside it lie."""
    _, xyz, _ = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)
    places = [(math.hypot(x, y), x, y, z) for x, y, z in zip(xyz[::3], xyz[1::3], xyz[2::3], strict=True)]

    def all_at(column: int, value: float) -> bool:
        return all(abs(place[column] - value) < 1e-4 for place in places)

    if all_at(0, OUTER):
        return "outer_wall"
    if all_at(0, INNER):
        return "inner_wall"
    if all_at(3, -WIDTH / 2) or all_at(3, WIDTH / 2):
        return "end_back" if all_at(3, -WIDTH / 2) else "end_front"
    if all(math.hypot(y, z) < TUBE_RADIUS + 1e-4 for _, _, y, z in places):
        return "gas_hole" if all_at(1, MOUTH) else "gas_tube"
    if all(abs(abs(y) - x + PLATE * math.sqrt(2)) < 1e-3 for _, x, y, _ in places):
        return "plate_right" if places[0][2] < 0 else "plate_left"
    return "walls"


def main() -> None:
    """Write both files."""
    write(EXAMPLE, fillets=True)
    write(CASE, fillets=False)


def write(target: Path, *, fillets: bool) -> None:
    """Mesh the solid, name its faces and write the file."""
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    draw(fillets=fillets)
    for option, value in {
        "MeshSizeMax": SIZE,
        "MeshSizeFromCurvature": 4,
        "ElementOrder": 2,
        "HighOrderOptimize": 1,
        "MeshSizeMin": 5,
        "MshFileVersion": 2.2,
        "Binary": 1,
    }.items():
        gmsh.option.setNumber(f"Mesh.{option}", value)
    gmsh.model.mesh.generate(3)
    faces = defaultdict(list)
    for _, tag in gmsh.model.getEntities(2):
        faces[name_of(tag)].append(tag)
    for name, tags in faces.items():
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="chamber")
    gmsh.write(str(target))
    gmsh.finalize()


if __name__ == "__main__":
    main()
