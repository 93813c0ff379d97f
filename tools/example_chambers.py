"""Bundled meshes of chambers, made by OpenCASCADE through gmsh (extra `cad`).

The chamber of the liquid-ring paper with the gas tube of its section 3.1, of assumed size and place:
once with fillets for the example scene, once without for the case that compares it with closed forms.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import gmsh

ROOT = Path(__file__).parent.parent
INNER, OUTER, WIDTH, ANGLE, STRIP = 20.5, 44.5, 62.0, math.pi / 2, 2.777
"""Dimensions of scenes/liquid_ring_paper.toml: mm, `ANGLE` in rad."""
TUBE_RADIUS, TUBE_TIP = 2.0, 31.0
"""Outside radius of the gas tube, which comes from the hub, and radius at which it ends, mm."""
FILLET = 5.0
"""Fillet radius along the shaft in all four corners, mm."""


def sector() -> list[tuple[int, int]]:
    """Volume between two plates."""
    occ = gmsh.model.occ

    def corner(radius: float, side: int) -> int:
        angle = side * (ANGLE / 2 - math.asin(STRIP / radius))
        return int(occ.addPoint(radius * math.cos(angle), radius * math.sin(angle), -WIDTH / 2))

    centre = occ.addPoint(0, 0, -WIDTH / 2)
    a, b, c, d = corner(INNER, -1), corner(OUTER, -1), corner(OUTER, 1), corner(INNER, 1)
    lines = [
        occ.addLine(a, b),
        occ.addCircleArc(b, centre, c),
        occ.addLine(c, d),
        occ.addCircleArc(d, centre, a),
    ]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    volume = [part for part in occ.extrude([(2, face)], 0, 0, WIDTH) if part[0] == 3]
    occ.remove([(0, centre)])
    return volume


def filleted(volume: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The volume with its edges along the shaft rounded."""
    occ = gmsh.model.occ
    occ.synchronize()
    edges = set()
    for face in gmsh.model.getBoundary(volume, oriented=False):
        for _, edge in gmsh.model.getBoundary([face], oriented=False):
            low_x, low_y, _, high_x, high_y, _ = gmsh.model.getBoundingBox(1, edge)
            if high_x - low_x < 1e-3 and high_y - low_y < 1e-3:
                edges.add(edge)
    return list(occ.fillet([tag for _, tag in volume], sorted(edges), [FILLET]))


def with_gas_tube(volume: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The volume without the gas tube, which begins within the hub."""
    tube = gmsh.model.occ.addCylinder(INNER - 5, 0, 0, TUBE_TIP - INNER + 5, 0, 0, TUBE_RADIUS)
    return [part for part in gmsh.model.occ.cut(volume, [(3, tube)])[0] if part[0] == 3]


def name_of(face: int) -> str:
    """Name of a boundary by its position."""
    low, high = gmsh.model.getParametrizationBounds(2, face)
    inside = [[a + part * (b - a) for a, b in zip(low, high, strict=True)] for part in (0.2, 0.5, 0.8)]
    corners = gmsh.model.getBoundingBox(2, face)
    if all(
        abs(math.hypot(*gmsh.model.getValue(2, face, point_uv)[:2]) - OUTER) < 1e-6 for point_uv in inside
    ):
        return "outer_wall"
    if max(map(abs, (corners[1], corners[2], corners[4], corners[5]))) < 1.01 * TUBE_RADIUS:
        return "gas_hole" if abs(corners[0] - TUBE_TIP) < 1e-3 else "gas_tube"
    return "walls"


def mesh(*, fillets: bool, size: float, round_turn: int) -> bytes:
    """A file with a mesh of quadratic tetrahedra, as small a file as Gmsh writes.

    Args: `size`: largest edge, mm. `round_turn`: edges along a full circle, for small radii.
    """
    gmsh.initialize()
    for option, value in (
        ("General.Terminal", 0),
        ("Mesh.MeshSizeMax", size),
        ("Mesh.MeshSizeFromCurvature", round_turn),
        ("Mesh.ElementOrder", 2),
        ("Mesh.HighOrderOptimize", 2),
        ("Mesh.MshFileVersion", 2.2),
        ("Mesh.Binary", 1),
    ):
        gmsh.option.setNumber(option, value)
    volume = with_gas_tube(filleted(sector()) if fillets else sector())
    gmsh.model.occ.synchronize()
    names: dict[str, list[int]] = {}
    for _, face in gmsh.model.getBoundary(volume, oriented=False):
        names.setdefault(name_of(face), []).append(face)
    for name, faces in names.items():
        gmsh.model.addPhysicalGroup(2, faces, name=name)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in volume], name="chamber")
    gmsh.model.mesh.generate(3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chamber.msh"
        gmsh.write(str(path))
        gmsh.finalize()
        return path.read_bytes()


def files(_: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Paths and bytes of both meshes."""
    yield ROOT / "scenes" / "imported_chamber.msh", mesh(fillets=True, size=14.0, round_turn=4)
    data = ROOT / "verification" / "cases" / "gas_tube" / "data"
    yield data / "chamber.msh", mesh(fillets=False, size=9.0, round_turn=5)
