"""Meshes with errors, and files without a mesh: each is named with entity and place, with no traceback."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from drawn_chamber import CHAMBER, Drawing, Element, drawn, inp, loaded, msh_2, msh_4, without

from ringbalance.scene import Scene, SceneError
from ringbalance.scene.chamber_file.body import Body
from ringbalance.scene.chamber_file.soundness import oriented


class Broken(NamedTuple):
    """A file, and what its message must say, in this order."""

    content: Callable[[], bytes]
    words: tuple[str, ...]
    name: str = "chamber.msh"
    keys: dict[str, str | int] = {}  # noqa: RUF012


def spoilt(
    change: Callable[[Drawing], object],
    kind: str = "tetra",
    write: Callable[[Drawing], bytes] = msh_2,
) -> Callable[[], bytes]:
    """A drawing that a function changes, in place or by its result, as a Gmsh file."""

    def content() -> bytes:
        drawing = drawn(kind)
        changed = change(drawing)
        return write(changed if isinstance(changed, Drawing) else drawing)

    return content


def moved(drawing: Drawing, node: int, x: float, y: float, z: float) -> None:
    drawing.points[node] = (float(x), float(y), float(z))


def add(drawing: Drawing, kind: str, nodes: list[int], group: int = CHAMBER) -> int:
    number = max(drawing.elements) + 1
    drawing.elements[number] = Element(kind, nodes, group)
    return number


def named(drawing: Drawing, old: str, new: str) -> None:
    drawing.names = {key: new if name == old else name for key, name in drawing.names.items()}


def grouped(drawing: Drawing, number: int, name: str) -> None:
    drawing.elements[number].group = next(group for (_, group), each in drawing.names.items() if each == name)


def twice_named_facet(drawing: Drawing) -> None:
    facet = drawing.elements[drawing.facets("outer_wall")[0]]
    grouped(drawing, add(drawing, facet.kind, facet.nodes), "end_back")


def inner_facet(drawing: Drawing) -> None:
    outside = [set(drawing.elements[n].nodes) for n in drawing.elements if n not in drawing.cells()]
    corners = next(
        face
        for n in drawing.cells()
        for face in [drawing.elements[n].nodes[:3], drawing.elements[n].nodes[1:]]
        if set(face) not in outside
    )
    grouped(drawing, add(drawing, "triangle", list(corners)), "outer_wall")


def split_in_two(drawing: Drawing) -> None:
    """Each cell gets its own nodes: nothing hangs together any more."""
    first = drawing.cells()[0]
    fresh = {node: node + 1000 for node in drawing.elements[first].nodes}
    drawing.points |= {new: drawing.points[old] for old, new in fresh.items()}
    for each in drawing.elements.values():
        if each is drawing.elements[first]:
            each.nodes = [fresh[node] for node in each.nodes]


def triangles_on_hexahedra(drawing: Drawing) -> None:
    for number in drawing.facets("end_back"):
        facet = drawing.elements[number]
        facet.kind, facet.nodes = "triangle", facet.nodes[:3]


def far_copy(drawing: Drawing) -> None:
    nodes = drawing.elements[drawing.cells()[0]].nodes
    fresh = [node + 1000 for node in nodes]
    for old, new in zip(nodes, fresh, strict=True):
        x, y, z = drawing.points[old]
        moved(drawing, new, x, y, z + 100)
    add(drawing, "tetra", fresh)


def third_cell(drawing: Drawing) -> None:
    """A further cell on a facet that two cells have already."""
    cells = [drawing.elements[n].nodes for n in drawing.cells()]
    shared = next(
        sorted(set(one) & set(two)) for one in cells for two in cells if one != two and len({*one, *two}) == 5
    )
    moved(drawing, 999, 30.0, 1.0, 0.5)
    add(drawing, "tetra", [*shared, 999])


def hanging(drawing: Drawing) -> None:
    """The cells at one side of a facet are refined by a node in its middle, the other cell is not."""
    cells = {n: drawing.elements[n].nodes for n in drawing.cells()}
    one, shared = next(
        (a, sorted(set(cells[a]) & set(cells[b])))
        for a in cells
        for b in cells
        if a != b and len(set(cells[a]) & set(cells[b])) == 3
    )
    apex = next(node for node in cells[one] if node not in shared)
    del drawing.elements[one]
    middle = np.mean([drawing.points[node] for node in shared], axis=0)
    moved(drawing, 999, *middle)
    for gone in range(3):
        corners = [999 if place == gone else node for place, node in enumerate(shared)]
        nodes = [*corners, apex]
        edges = np.diff([drawing.points[node] for node in nodes], axis=0)
        add(drawing, "tetra", nodes if np.linalg.det(edges) > 0 else [nodes[1], nodes[0], *nodes[2:]])


def inverted(drawing: Drawing) -> None:
    nodes = drawing.elements[drawing.cells()[4]].nodes
    nodes[0], nodes[1] = nodes[1], nodes[0]


def flat(drawing: Drawing) -> None:
    nodes = drawing.elements[drawing.cells()[0]].nodes
    drawing.points[nodes[3]] = drawing.points[nodes[0]]


def folded(drawing: Drawing) -> None:
    """A mid-side node beyond the end of its side."""
    nodes = drawing.elements[drawing.cells()[0]].nodes
    a, b = (np.array(drawing.points[node]) for node in nodes[:2])
    moved(drawing, nodes[4], *(a + 1.6 * (b - a)))


def crack(drawing: Drawing) -> None:
    facet = drawing.elements[drawing.facets("outer_wall")[0]]
    x, y, z = drawing.points[facet.nodes[3]]
    moved(drawing, 9999, 1.01 * x, y, z)
    facet.nodes = [*facet.nodes[:3], 9999, *facet.nodes[4:]]


def turned(degrees: float) -> Callable[[Drawing], None]:
    """The whole chamber seen from another axis, or stretched about it."""

    def change(drawing: Drawing) -> None:
        for number, (x, y, z) in drawing.points.items():
            radius, angle = math.hypot(x, y), math.atan2(y, x) * degrees / 80
            moved(drawing, number, radius * math.cos(angle), radius * math.sin(angle), z)

    return change


def lines_only(drawing: Drawing) -> None:
    """The outer wall is the name of a line."""
    for number in drawing.facets("outer_wall"):
        del drawing.elements[number]
    drawing.names.pop((2, 2))
    drawing.names[1, 30] = "outer_wall"
    add(drawing, "line", [1, 2], 30)


def port_on_inner_wall(drawing: Drawing) -> None:
    drawing.names[2, 40] = "port"
    drawing.elements[drawing.facets("inner_wall")[0]].group = 40


def exchanged(drawing: Drawing) -> None:
    named(drawing, "outer_wall", "end_wall")
    named(drawing, "inner_wall", "outer_wall")
    named(drawing, "end_wall", "inner_wall")


def only_cells(*indices: int) -> Callable[[Drawing], Drawing]:
    """Some of the cells, with all named facets."""

    def change(drawing: Drawing) -> Drawing:
        keep = [drawing.cells()[index] for index in indices]
        return without(drawing, *(number for number in drawing.cells() if number not in keep))

    return change


def other_volume(drawing: Drawing) -> None:
    """One cell in a second group of cells."""
    drawing.names[3, 8] = "chambre"
    drawing.elements[drawing.cells()[0]].group = 8


MESHES: dict[str, Broken] = {
    "surface only": Broken(
        spoilt(lambda d: without(d, *d.cells())), ("no cells", "only lines and surface elements")
    ),
    "prisms": Broken(
        spoilt(lambda d: add(d, "wedge", [1, 2, 3, 4, 5, 6])), ("of the kind wedge", "mixes kinds")
    ),
    "mixed kinds": Broken(
        spoilt(
            lambda d: add(d, "tetra", [d.elements[d.cells()[0]].nodes[i] for i in (0, 1, 3, 4)]), "hexahedron"
        ),
        ("mixes kinds of cells: 12 hexahedron", "1 tetra"),
    ),
    "node missing": Broken(
        spoilt(lambda d: d.points.pop(5)), ("tetra elements have nodes that the file does not give (12)",)
    ),
    "number twice": Broken(
        lambda: msh_2(drawn()).replace(b"\n5 ", b"\n4 ", 1),
        ("nodes that the file does not give",),
    ),
    "not finite": Broken(spoilt(lambda d: moved(d, 7, math.nan, 0.0, 0.0)), ("no finite numbers (1 nodes)",)),
    "unmerged nodes": Broken(
        spoilt(split_in_two),
        ("lie where another node lies already (4): at (15.32", "2 separate volumes"),
    ),
    "two volumes": Broken(
        spoilt(far_copy),
        ("falls into 2 separate volumes, which begin at (24.17, -11.49, -11.25) mm, (24.17",),
    ),
    "touching at an edge": Broken(spoilt(only_cells(0, 2)), ("separate volumes",)),
    "open along an edge": Broken(
        spoilt(only_cells(0, 8, 1, 3, 9), "hexahedron"),
        ("touches itself along edges (1): at (29.19, -6.9", "no side of any cell"),
    ),
    "three cells at a facet": Broken(
        spoilt(third_cell), ("belong to more than two cells (1): at (24.57, -8.898, -10) mm",)
    ),
    "hanging node": Broken(spoilt(hanging), ("nodes hang", "(1): at (24.57, -8.898, -10) mm")),
    "cell twice": Broken(
        spoilt(lambda d: add(d, "tetra", d.elements[d.cells()[3]].nodes)),
        ("stand in the file twice",),
    ),
    "node twice in a cell": Broken(
        spoilt(lambda d: add(d, "tetra", [1, 1, 2, 5])), ("have a node twice (1): at (",)
    ),
    "inverted": Broken(spoilt(inverted), ("cells are inverted (1): at (20.7, -12.98, -3.75) mm",)),
    "flat": Broken(spoilt(flat), ("without volume",)),
    "folded": Broken(
        spoilt(folded, "tetra10"),
        ("cells fold over (2", "of its side is the node at ("),
    ),
    "unused node": Broken(
        spoilt(lambda d: moved(d, 500, 30.0, 0.0, 1.0)),
        ("nodes belong to no cell (1): at (30, 0, 1) mm",),
    ),
    "no names": Broken(
        spoilt(lambda d: without(d, *(n for n in d.elements if n not in d.cells()))),
        ('no facets have the name "outer_wall"',),
    ),
    "misspelt name": Broken(
        spoilt(lambda d: named(d, "outer_wall", "outerwall")),
        ('facets have the unknown name "outerwall" (did you mean "outer_wall"?) (12): at (',),
    ),
    "name of another wall": Broken(
        spoilt(lambda d: named(d, "outer_wall", "rim")),
        ('no facets have the name "outer_wall"; names in the file: ', '"rim"'),
    ),
    "number for a name": Broken(
        spoilt(lambda d: d.names.pop((2, 5))), ('unknown name "physical group 5" (12): at (',)
    ),
    "volume of another name": Broken(
        spoilt(other_volume), ('"chambre" are not the chamber (did you mean "chamber"?) (1): at (',)
    ),
    "cells without the name": Broken(
        spoilt(lambda d: setattr(d.elements[d.cells()[0]], "group", 0)),
        ('do not belong to the volume "chamber" (1): at (',),
    ),
    "line named": Broken(spoilt(lines_only), ('"outer_wall" names lines or points, not facets',)),
    "two names on a facet": Broken(
        spoilt(twice_named_facet), ('facets have two names, "outer_wall" and "end_back" (1): at (',)
    ),
    "two names on a surface": Broken(
        lambda: msh_4(drawn(), more={2: [5]}),
        ('facets have two names, "outer_wall" and "end_back" (12): at (',),
    ),
    "facet inside": Broken(spoilt(inner_facet), ('named "outer_wall" lie between two cells (1): at (',)),
    "triangles on hexahedra": Broken(
        spoilt(triangles_on_hexahedra, "hexahedron"), ('named "end_back" are no side of any cell (6)',)
    ),
    "facet of no cell": Broken(
        spoilt(lambda d: grouped(d, add(d, "triangle", [1, 2, 30]), "outer_wall")),
        ('named "outer_wall" are no side of any cell (1): at (',),
    ),
    "other mid-side nodes": Broken(spoilt(crack, "tetra10"), ("other mid-side nodes than their cells",)),
    "names exchanged": Broken(spoilt(exchanged), ("names exchanged",)),
    "unit missing": Broken(lambda: msh_4(drawn()), ("[disc] mesh_unit is missing",), keys={"mesh_unit": ""}),
    "too large for a disc": Broken(
        lambda: msh_4(drawn()),
        ('in "m" the chamber reaches', "40000 mm: wrong scale"),
        keys={"mesh_unit": "m"},
    ),
    "outside the opening": Broken(
        spoilt(turned(100)),
        ("outside the opening angle, 360 deg / 4 chambers", "farthest", "within 45 deg"),
    ),
    "beside its middle": Broken(
        lambda: msh_4(drawn()), ("outside the opening angle", "mesh_middle"), keys={"mesh_middle": "30 deg"}
    ),
    "wrong axis": Broken(lambda: msh_4(drawn()), ("see mesh_axis and the origin",), keys={"mesh_axis": "x"}),
    "round the axis": Broken(
        spoilt(lambda d: d.points.update({n: (x - 30.0, y, z) for n, (x, y, z) in d.points.items()})),
        ("the shaft's axis", "mesh_axis and the origin"),
    ),
    "port elsewhere": Broken(spoilt(port_on_inner_wall), ("does not cover port_radius, 19.52",)),
}


def text(old: str, new: str) -> Callable[[], bytes]:
    """A file of version 4.1 with some text replaced."""
    return lambda: msh_4(drawn()).replace(old.encode(), new.encode(), 1)


UNREAD = "meshio cannot read it, it is damaged or cut off"
FILES: dict[str, Broken] = {
    "empty": Broken(lambda: b"", ("the file is empty",)),
    "spaces": Broken(lambda: b" \n" * 99, ("the file is empty",)),
    "another format": Broken(lambda: b"solid\n", ("ends with .stl",), "chamber.stl"),
    "no mesh at all": Broken(lambda: b"hello\n", ("not a Gmsh mesh",)),
    "ansys": Broken(lambda: b'(0 "ANSYS")\n(2 3)\n', ("ANSYS Fluent",)),
    "old version": Broken(text("4.1 0 8", "1 0 8"), ("it is of another version", "allowed: Gmsh 2.2 or 4.1")),
    "version 4.0": Broken(
        lambda: re.sub(rb"(s\n\d+ \d+) 1 \d+", rb"\1", msh_4(drawn()).replace(b"4.1 0 8", b"4 0 8")),
        ("it is of version 4.0 of Gmsh's format",),
    ),
    "partitioned": Broken(
        lambda: (
            msh_4(drawn()).replace(b"3 7 4 72", b"3 9 4 72")
            + b"$PartitionedEntities\n$EndPartitionedEntities\n"
        ),
        ("it is partitioned",),
    ),
    "parametric 4.1": Broken(text("3 7 0 ", "3 7 1 "), ("its nodes have parametric coordinates",)),
    "parametric 2.2": Broken(
        lambda: msh_2(drawn()).replace(b"Nodes", b"ParametricNodes"),
        ("its nodes have parametric coordinates",),
    ),
    "all saved 4.1": Broken(
        spoilt(lambda d: add(d, "line", [1, 2], 0), write=msh_4), ("elements of it are in no physical group",)
    ),
    "all saved 2.2": Broken(
        spoilt(lambda d: replace(d, elements={n: replace(e, group=0) for n, e in d.elements.items()})),
        ("elements of it are in no physical group, as with Mesh.SaveAll = 1",),
    ),
    "no nodes": Broken(text("$Nodes", "$Knots"), (UNREAD,)),
    "no elements": Broken(
        lambda: msh_4(drawn()).replace(b"$Elements", b"$Others").replace(b"$EndElements", b"$EndOthers"),
        (UNREAD, "$Element section not found"),
    ),
    "cut off": Broken(lambda: msh_4(drawn())[:-400], (UNREAD,)),
    "too many announced": Broken(text("3 7 4 72", "3 7 4 999999999999"), (UNREAD,)),
    "negative count": Broken(text("3 7 4 72", "3 7 4 -72"), (UNREAD,)),
    "word among numbers": Broken(text("3 7 4 72", "3 7 four 72"), (UNREAD,)),
    "fraction of a node": Broken(text("3 7 4 72", "3 7 4 72.5"), (UNREAD,)),
    "two sections": Broken(lambda: msh_2(drawn()) * 2, ("$MeshFormat stands in the file twice",)),
    "third order": Broken(text("3 7 4 72", "3 7 29 72"), (UNREAD,)),
    "abaqus without nodes": Broken(lambda: b"*HEADING\n", ("not an Abaqus mesh",), "chamber.inp"),
    "abaqus element": Broken(
        lambda: inp(drawn()).replace(b"C3D4", b"C3D9"), ("unknown type C3D9",), "chamber.inp"
    ),
    "abaqus include": Broken(
        lambda: b"*INCLUDE, INPUT=/etc/passwd\n" + inp(drawn()), ("includes another file",), "chamber.inp"
    ),
    "abaqus moved part": Broken(
        lambda: inp(drawn()) + b"*INSTANCE, NAME=a, PART=b\n1., 0., 0.\n", ("*INSTANCE moves",), "chamber.inp"
    ),
    "abaqus cylindrical": Broken(
        lambda: inp(drawn()).replace(b"*NODE\n", b"*Node, Nset=all, System=c\n", 1),
        ("*NODE has the option SYSTEM=C, which is not read",),
        "chamber.inp",
    ),
    "abaqus continued": Broken(
        lambda: inp(drawn()).replace(b"*NODE\n", b"*NODE, NSET=all,\n SYSTEM=C\n", 1),
        ("*NODE has the option SYSTEM=C, which is not read",),
        "chamber.inp",
    ),
    **{
        f"abaqus {word}": Broken(
            lambda word=word: f"*{word}\n0., 0., 0., 1.\n".encode() + inp(drawn()),  # type: ignore[misc]
            (f"it has *{word}, which is not read",),
            "chamber.inp",
        )
        for word in ("SYSTEM", "NCOPY", "UNKNOWN WORD")
    },
    "abaqus half a node": Broken(
        lambda: inp(drawn()).replace(b"*NODE\n", b"*NODE\n1, 2\n", 1),
        ("*NODE does not have 4",),
        "chamber.inp",
    ),
    "abaqus face": Broken(
        lambda: inp(drawn()) + b"*SURFACE, NAME=port\nchamber, S6\n",
        ("face S6 of tetra cells",),
        "chamber.inp",
    ),
    "vtu no xml": Broken(lambda: b"<VTKFile", (UNREAD,), "chamber.vtu"),
    "vtu other xml": Broken(lambda: b"<svg/>", ("not a VTK UnstructuredGrid",), "chamber.vtu"),
    "vtu entities": Broken(
        lambda: b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile>&b;</VTKFile>',
        ("declares XML entities",),
        "chamber.vtu",
    ),
    "vtu no piece": Broken(
        lambda: b'<VTKFile type="UnstructuredGrid"><UnstructuredGrid/></VTKFile>',
        (UNREAD, "No Piece found"),
        "chamber.vtu",
    ),
}


@pytest.mark.parametrize("broken", [*MESHES.values(), *FILES.values()], ids=[*MESHES, *FILES])
def test_each_is_named(broken: Broken, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as caught:
        loaded(tmp_path, broken.content(), broken.name, **broken.keys)
    message = str(caught.value)
    at = 0
    for word in broken.words:
        assert word in message[at:], message
        at = message.index(word, at)
    assert all(fault.table == "disc" and fault.key.startswith("mesh") for fault in caught.value.faults), (
        message
    )


def test_all_errors_are_reported_together(tmp_path: Path) -> None:
    drawing = drawn()
    inverted(drawing)
    twice_named_facet(drawing)
    named(drawing, "end_front", "end_frond")
    moved(drawing, 500, 30.0, 0.0, 1.0)
    with pytest.raises(SceneError) as caught:
        loaded(tmp_path, msh_2(drawing))
    message = str(caught.value)
    for word in ("are inverted", "have two names", 'did you mean "end_front"', "belong to no cell"):
        assert word in message
    assert len(caught.value.faults) == 4


def test_nothing_is_said_of_a_sound_mesh(tmp_path: Path) -> None:
    assert isinstance(loaded(tmp_path, msh_2(drawn())), Scene)


@pytest.mark.parametrize(("height", "faults"), [(0.9e-9, 1), (1.5e-9, 0)])
def test_a_cell_has_no_volume_below_a_billionth_of_its_cubed_size(height: float, faults: int) -> None:
    body = Body(
        kind="tetra",
        points=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, height]]),
        cells=np.array([[0, 1, 2, 3]]),
        cell_names=(),
        named=(),
        lesser=(),
        other_names=(),
        drawing=np.array([], dtype=np.int64),
    )
    assert len(oriented(body)[1]) == faults
