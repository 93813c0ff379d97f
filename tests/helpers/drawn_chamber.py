"""A chamber drawn in code: a sector of whole cells, named, and written as each format writes it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

import meshio
import numpy as np
from block_discs import sector_chamber

from ringbalance.scene import AnyScene, bundled_scene, load_scene
from ringbalance.scene.chamber_file.elements import FACET_KINDS, dimension
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry

GMSH_NUMBERS = {
    "line": 1,
    "triangle": 2,
    "quad": 3,
    "tetra": 4,
    "hexahedron": 5,
    "wedge": 6,
    "triangle6": 9,
    "quad9": 10,
    "tetra10": 11,
    "hexahedron27": 12,
    "quad8": 16,
    "hexahedron20": 17,
}
_SECOND = (0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)
GMSH_ORDER = {
    "tetra10": (0, 1, 2, 3, 4, 5, 6, 7, 9, 8),
    "hexahedron20": _SECOND,
    "hexahedron27": (*_SECOND, 22, 23, 21, 24, 20, 25, 26),
}
"""Places of the nodes of a Gmsh element in the order of VTK; other kinds have the same order."""
DIVISIONS = (2, 3, 2)
"""Cells in the directions of radius, angle and shaft."""
CHAMBER, NAMES = 7, ("inner_wall", "outer_wall", "plate_right", "plate_left", "end_back", "end_front")
"""Physical number of the volume, and names of the sides, whose physical numbers count from 1."""


@dataclass
class Element:
    """One element of a drawing."""

    kind: str
    nodes: list[int]
    """In meshio's order."""
    group: int


@dataclass
class Drawing:
    """A mesh that a test may spoil; lengths in mm."""

    points: dict[int, tuple[float, float, float]]
    elements: dict[int, Element]
    """By number."""
    names: dict[tuple[int, int], str] = field(default_factory=dict)
    """Of physical groups, by dimension and number."""

    def cells(self) -> list[int]:
        """Numbers of the cells."""
        return [number for number, each in self.elements.items() if dimension(each.kind) == 3]

    def facets(self, name: str) -> list[int]:
        """Numbers of the facets of a name."""
        group = next(number for (_, number), each in self.names.items() if each == name)
        found = self.elements.items()
        return [number for number, each in found if dimension(each.kind) == 2 and each.group == group]


def drawn(kind: str = "tetra") -> Drawing:
    """A sector of 80 deg about the x axis, radii 20 mm and 40 mm, 30 mm long, of cells of a kind."""
    radii, angle = (20.0, 40.0), float(np.radians(80))
    chamber = sector_chamber(DIVISIONS, radii=radii, angle=angle, width=30.0, kind=cast(CellKind, kind))
    return drawing_of(chamber)


def drawing_of(chamber: ChamberGeometry) -> Drawing:
    """The mesh of a chamber with its named boundaries, in the unit of its points."""
    used = np.unique(chamber.cells).tolist()
    numbers = {node: count + 1 for count, node in enumerate(used)}
    x, y, z = chamber.points[used].T.tolist()
    points = dict(zip(numbers.values(), zip(x, y, z, strict=True), strict=True))
    drawing = Drawing(points=points, elements={}, names={(3, CHAMBER): "chamber"})
    for group, (name, facets) in enumerate(chamber.boundaries.items(), start=1):
        drawing.names[2, group] = name
        for facet in facets.tolist():
            _add(drawing, FACET_KINDS[len(facet)], [numbers[node] for node in facet], group)
    for cell in chamber.cells.tolist():
        _add(drawing, chamber.kind, [numbers[node] for node in cell], CHAMBER)
    return drawing


def _add(drawing: Drawing, kind: str, nodes: list[int], group: int) -> None:
    drawing.elements[len(drawing.elements) + 101] = Element(kind, nodes, group)


def msh_2(drawing: Drawing) -> bytes:
    """As Gmsh writes version 2.2; each group is its own entity."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", *_names(drawing)]
    lines += ["$Nodes", str(len(drawing.points))]
    lines += [f"{number} {x!r} {y!r} {z!r}" for number, (x, y, z) in drawing.points.items()]
    lines += ["$EndNodes", "$Elements", str(len(drawing.elements))]
    for number, each in drawing.elements.items():
        nodes = " ".join(map(str, _in_gmsh(each)))
        lines.append(f"{number} {GMSH_NUMBERS[each.kind]} 2 {each.group} {each.group} {nodes}")
    return ("\n".join([*lines, "$EndElements"]) + "\n").encode()


def msh_4(drawing: Drawing, *, more: dict[int, list[int]] | None = None) -> bytes:
    """As Gmsh writes version 4.1. Args: `more`: further physical numbers of a group's entity."""
    groups = sorted({(dimension(each.kind), each.group) for each in drawing.elements.values()})
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", *_names(drawing), "$Entities"]
    lines.append(" ".join(str(sum(each == count for each, _ in groups)) for count in range(4)))
    sides = [group for each, group in groups if each == 2 and group]
    for each, group in groups:
        tags = [group, *(more or {}).get(group, [])] if group else []
        box = "0 0 0" if each == 0 else "0 0 0 1 1 1"
        bounded = "" if each == 0 else f" {len(sides)} {' '.join(map(str, sides))}" if each == 3 else " 0"
        lines.append(f"{group} {box} {len(tags)} {' '.join(map(str, tags))}{bounded}")
    lines += ["$EndEntities", "$Nodes", *_nodes_4(drawing, sides)]
    blocks = list(dict.fromkeys((each.kind, each.group) for each in drawing.elements.values()))
    total = len(drawing.elements)
    lines += ["$EndNodes", "$Elements", f"{len(blocks)} {total} 1 {total}"]
    for kind, group in blocks:
        inside = {n: e for n, e in drawing.elements.items() if (e.kind, e.group) == (kind, group)}
        lines.append(f"{dimension(kind)} {group} {GMSH_NUMBERS[kind]} {len(inside)}")
        lines += [f"{number} {' '.join(map(str, _in_gmsh(each)))}" for number, each in inside.items()]
    return ("\n".join([*lines, "$EndElements"]) + "\n").encode()


def _nodes_4(drawing: Drawing, sides: list[int]) -> list[str]:
    """One node on each side, and all others in the volume: every entity has one, as meshio asks for."""
    count = len(drawing.points)
    lines, rest = [f"{len(sides) + 1} {count} 1 {count}"], list(drawing.points)
    for each, tag, size in (*((2, side, 1) for side in sides), (3, CHAMBER, count - len(sides))):
        inside, rest = rest[:size], rest[size:]
        lines += [f"{each} {tag} 0 {size}", *map(str, inside)]
        lines += [" ".join(map(repr, drawing.points[number])) for number in inside]
    return lines


def _names(drawing: Drawing) -> list[str]:
    rows = [f'{each} {number} "{name}"' for (each, number), name in drawing.names.items()]
    return ["$PhysicalNames", str(len(rows)), *rows, "$EndPhysicalNames"]


def _in_gmsh(element: Element) -> list[int]:
    order = GMSH_ORDER.get(element.kind)
    if order is None:
        return element.nodes
    found = [0] * len(order)
    for node, place in zip(element.nodes, order, strict=True):
        found[place] = node
    return found


_ABAQUS = {
    "tetra": "C3D4",
    "tetra10": "C3D10",
    "hexahedron": "C3D8",
    "hexahedron20": "C3D20",
    "triangle": "S3",
    "triangle6": "STRI65",
    "quad": "S4",
    "quad8": "S8R",
}


def inp(drawing: Drawing) -> bytes:
    """As an Abaqus file with facets as shell elements."""
    lines = ["*HEADING", "a chamber", "*NODE"]
    lines += [f"{number}, {x!r}, {y!r}, {z!r}" for number, (x, y, z) in drawing.points.items()]
    for (_, group), name in drawing.names.items():
        inside = {n: e for n, e in drawing.elements.items() if e.group == group}
        kind = next(iter(inside.values())).kind
        lines.append(f"*ELEMENT, TYPE={_ABAQUS[kind]}, ELSET={name.upper()}")
        for number, each in inside.items():
            words = [str(number), *map(str, each.nodes)]
            lines += [", ".join(words[:12]) + ("," if len(words) > 12 else "")]
            lines += [", ".join(words[12:])] if len(words) > 12 else []
    return ("\n".join(lines) + "\n").encode()


def vtu(drawing: Drawing, folder: Path, *, binary: bool, compression: str | None = "zlib") -> bytes:
    """As meshio writes it, each named part a field of its own."""
    (folder / "own.msh").write_bytes(msh_2(drawing))
    there = meshio.read(folder / "own.msh")
    groups = there.cell_data["gmsh:physical"]
    data = {name: [(each == number + 1) * 1 for each in groups] for number, name in enumerate(NAMES)}
    mesh = meshio.Mesh(there.points, there.cells, cell_data=data)
    meshio.vtu.write(folder / "own.vtu", mesh, binary=binary, compression=compression)
    return (folder / "own.vtu").read_bytes()


def scene_text(mesh: str, **disc: str | int) -> str:
    """The paper's scene with a mesh in place of its dimensions.

    Args: `disc`: further keys of [disc]; an empty one is left out.
    """
    text = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    text = text[: text.index("[uncertainty]")] + text[text.index("[run]") :]
    gone = "outer_radius|inner_radius|axial_width|central_angle|plate_thickness|port_radius|hump_radius"
    text = re.sub(rf"(?m)^({gone}) = .*\n", "", text).replace(
        'origin = { plate_thickness = "inferred" }\n', ""
    )
    lines = "".join(f"{key} = {value!r}\n" for key, value in disc.items() if value != "")
    return text.replace("[disc]\n", f"[disc]\nmesh = {mesh!r}\n{lines}", 1)


def loaded(folder: Path, content: bytes, name: str = "chamber.msh", **disc: str | int) -> AnyScene:
    """The scene of a mesh file's bytes; in mm unless `disc` says otherwise."""
    (folder / name).write_bytes(content)
    keys = {"mesh_unit": "mm", **disc}
    (folder / "my_disc.toml").write_text(scene_text(name, **keys), encoding="utf-8")
    return load_scene(folder / "my_disc.toml")


def without(drawing: Drawing, *numbers: int) -> Drawing:
    """A drawing without some elements."""
    return replace(drawing, elements={n: e for n, e in drawing.elements.items() if n not in numbers})
