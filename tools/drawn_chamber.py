"""A chamber drawn in code: a sector of whole cells, named, and written as each format writes it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import numpy as np

from ringbalance.scene import AnyScene, bundled_scene, load_scene
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import (
    CORNERS,
    FACET_KINDS,
    GMSH_KINDS,
    GMSH_ORDER,
    between,
    dimension,
    faces,
)

GMSH_NUMBERS = {name: number for number, name in GMSH_KINDS.items()}
DIVISIONS = (2, 3, 2)
"""Cells in the directions of radius, angle and shaft."""
CHAMBER, NAMES = 7, ("inner_wall", "outer_wall", "plate_right", "plate_left", "end_back", "end_front")
"""Physical number of the volume, and names of the sides, whose physical numbers count from 1."""
_SIX_TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


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
    places, cells = _lattice(kind)
    cells, places = _second_order(kind, cells, places)
    points = {number + 1: tuple(_bent(place)) for number, place in enumerate(places)}
    drawing = Drawing(points=points, elements={}, names={(3, CHAMBER): "chamber"})  # type: ignore[arg-type]
    for count, name in enumerate(NAMES):
        drawing.names[2, count + 1] = name
    for side, nodes in _sides(kind, cells, places):
        _add(drawing, FACET_KINDS[len(nodes)], nodes, side + 1)
    for cell in cells:
        _add(drawing, kind, cell.tolist(), CHAMBER)
    return drawing


def _add(drawing: Drawing, kind: str, nodes: Sequence[int], group: int) -> None:
    drawing.elements[len(drawing.elements) + 101] = Element(kind, [node + 1 for node in nodes], group)


def _lattice(kind: str) -> tuple[FloatArray, IntArray]:
    """Corners in the unit cube, and cells."""
    steps = [np.linspace(0, 1, count + 1) for count in DIVISIONS]
    places = np.array(list(product(*steps)))
    shape = tuple(count + 1 for count in DIVISIONS)
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    hexahedra = [
        [int(np.ravel_multi_index(tuple(first + corner), shape)) for corner in cube]
        for first in product(*(range(count) for count in DIVISIONS))
    ]
    if CORNERS[kind] == 8:
        return places, np.array(hexahedra)
    return places, np.array([[cell[c] for c in four] for cell in hexahedra for four in _SIX_TETRAHEDRA])


def _second_order(kind: str, cells: IntArray, places: FloatArray) -> tuple[IntArray, FloatArray]:
    """Nodes in the middles of corners, one for all cells that share them."""
    rows, every, numbers = [], list(map(tuple, places.tolist())), dict[frozenset[int], int]()
    for cell in cells:
        row = cell.tolist()
        for corners in between(kind)[CORNERS[kind] :]:
            key = frozenset(row[corner] for corner in corners)
            if key not in numbers:
                numbers[key] = len(every)
                every.append(tuple(places[sorted(key)].mean(axis=0).tolist()))
            row = [*row, numbers[key]]
        rows.append(row)
    return np.array(rows), np.array(every)


def _bent(place: FloatArray) -> list[float]:
    radius, angle, along = 20 + 20 * place[0], np.radians(-40 + 80 * place[1]), -15 + 30 * place[2]
    return [float(radius * np.cos(angle)), float(radius * np.sin(angle)), float(along)]


def _sides(kind: str, cells: IntArray, places: FloatArray) -> list[tuple[int, list[int]]]:
    """Facets on the six sides of the cube, in the order of `NAMES`."""
    found = []
    for side, (axis, value) in enumerate(product(range(3), (0.0, 1.0))):
        for cell in cells:
            for face in faces(kind):
                nodes = [int(cell[place]) for place in face]
                if (np.abs(places[nodes, axis] - value) < 1e-9).all():
                    found.append((side, nodes))
    return found


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
