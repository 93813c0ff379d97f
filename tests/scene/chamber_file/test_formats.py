"""Each format and kind of cell gives the same chamber; names, numbers and orders of nodes are kept."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
from drawn_chamber import CHAMBER, NAMES, Drawing, drawn, inp, loaded, msh_2, msh_4, vtu
from vtkmodules import vtkCommonDataModel

from ringbalance.scene import Scene
from ringbalance.scene.chamber_file.elements import CELL_KINDS, NODES, faces, reference_nodes, shape_gradients
from ringbalance.scene.chamber_file.record import ChamberGeometry

Writer = Callable[[Drawing], bytes]


def geometry_of(scene: object) -> ChamberGeometry:
    assert isinstance(scene, Scene)
    assert scene.disc.geometry is not None
    return scene.disc.geometry


def volume(geometry: ChamberGeometry) -> float:
    """By the divergence theorem over straight facets, m^3."""
    facets = np.concatenate([each[:, :3] for each in geometry.boundaries.values()])
    if geometry.kind.startswith("hexa"):
        facets = np.concatenate([facets, *(each[:, [0, 2, 3]] for each in geometry.boundaries.values())])
    one, two, three = geometry.points[facets].transpose(1, 0, 2)
    middle = geometry.points.mean(axis=0)
    return float(
        np.abs(np.einsum("ij,ij->i", np.cross(one - middle, two - middle), three - middle)).sum() / 6
    )


@pytest.mark.parametrize(
    ("kind", "write"),
    [(k, w) for k in CELL_KINDS for w in (msh_2, msh_4, inp) if (k, w) != ("hexahedron27", inp)],
)
def test_every_kind_in_every_format(kind: str, write: Writer, tmp_path: Path) -> None:
    name = "chamber.inp" if write is inp else "chamber.msh"
    scene = loaded(tmp_path, write(drawn(kind)), name)
    geometry = geometry_of(scene)
    assert geometry.kind == kind
    assert set(geometry.boundaries) == set(NAMES)
    assert isinstance(scene, Scene)
    disc = scene.disc
    curved = kind not in ("tetra", "hexahedron")
    inner = 0.02 if curved else 0.02 * np.cos(np.radians(80 / 3 / 2))
    assert disc.outer_radius == pytest.approx(0.04)
    assert disc.inner_radius == pytest.approx(inner, rel=2e-4 if curved else 1e-6)
    assert disc.axial_width == pytest.approx(0.03)
    assert np.degrees(disc.central_angle) == pytest.approx(80)
    assert (disc.chambers, disc.plate_thickness) == (4, 0.0)
    assert scene.origin_of("disc.outer_radius") == "derived"
    assert scene.tube.port_radius == disc.outer_radius
    sector = 0.03 * 3 * np.sin(np.radians(80 / 3)) / 2 * (0.04**2 - 0.02**2)
    assert volume(geometry) == pytest.approx(sector, rel=1e-9)


@pytest.mark.parametrize("kind", CELL_KINDS)
def test_cells_are_positive_and_facets_point_as_their_cells(kind: str) -> None:
    """Shape functions add up to one, reproduce the reference cell, and every face's normal points outward."""
    gradients, nodes = shape_gradients(kind), reference_nodes(kind)
    assert gradients.sum(axis=1) == pytest.approx(0, abs=1e-12)
    identity = np.einsum("pnd,ne->ped", gradients, nodes)
    assert identity == pytest.approx(np.broadcast_to(np.eye(3), identity.shape), abs=1e-12)
    middle = nodes.mean(axis=0)
    for face in faces(kind):
        one, two, three = nodes[list(face[:3])]
        assert np.cross(two - one, three - one) @ (one - middle) > 0


_IN_VTK = {
    "tetra": vtkCommonDataModel.vtkTetra,
    "tetra10": vtkCommonDataModel.vtkQuadraticTetra,
    "hexahedron": vtkCommonDataModel.vtkHexahedron,
    "hexahedron20": vtkCommonDataModel.vtkQuadraticHexahedron,
    "hexahedron27": vtkCommonDataModel.vtkTriQuadraticHexahedron,
}


@pytest.mark.parametrize("kind", CELL_KINDS)
def test_nodes_are_in_the_order_of_vtk(kind: str) -> None:
    """Also those in the middle of faces, which every other test takes from the same table."""
    there = np.reshape(_IN_VTK[kind]().GetParametricCoords(), (-1, 3))
    assert reference_nodes(kind).tolist() == there[: NODES[kind]].tolist()


@pytest.mark.parametrize(("kind", "binary"), [("tetra10", False), *((kind, True) for kind in CELL_KINDS)])
@pytest.mark.parametrize("version", ["gmsh22", "gmsh"])
def test_as_meshio_writes_it(kind: str, version: str, binary: bool, tmp_path: Path) -> None:
    """Another program's file, text and binary: nodes and cells in their order."""
    (tmp_path / "own.msh").write_bytes(msh_2(drawn(kind)) if version == "gmsh22" else msh_4(drawn(kind)))
    there = meshio.read(tmp_path / "own.msh")
    meshio.write(tmp_path / "chamber.msh", there, file_format=version, binary=binary)
    content = (tmp_path / "chamber.msh").read_bytes()
    own = geometry_of(loaded(tmp_path, msh_2(drawn(kind))))
    other = geometry_of(loaded(tmp_path, content))
    assert other.points == pytest.approx(own.points, abs=1e-15)
    assert (other.cells == own.cells).all()
    assert {name: len(each) for name, each in other.boundaries.items()} == {
        name: len(each) for name, each in own.boundaries.items()
    }
    assert own.digest != other.digest


@pytest.mark.parametrize(
    ("kind", "binary", "compression"),
    [
        ("tetra10", False, None),
        ("tetra10", True, None),
        ("tetra10", True, "lzma"),
        *((kind, True, "zlib") for kind in CELL_KINDS),
    ],
)
def test_vtu_as_meshio_writes_it(kind: str, binary: bool, compression: str | None, tmp_path: Path) -> None:
    content = vtu(drawn(kind), tmp_path, binary=binary, compression=compression)
    found = geometry_of(loaded(tmp_path, content, "chamber.vtu"))
    own = geometry_of(loaded(tmp_path, msh_2(drawn(kind))))
    assert found.points == pytest.approx(own.points, abs=1e-12)
    assert set(found.boundaries) == set(NAMES)
    assert volume(found) == pytest.approx(volume(own))


def test_a_mesh_turned_inside_out_is_repaired(tmp_path: Path) -> None:
    """All cells of the other orientation: the file's writer has another convention."""
    drawing = drawn("tetra10")
    for number in drawing.cells():
        a, b, c, d, ab, bc, ca, ad, bd, cd = drawing.elements[number].nodes
        drawing.elements[number].nodes = [b, a, c, d, ab, ca, bc, bd, ad, cd]
    turned = geometry_of(loaded(tmp_path, msh_4(drawing)))
    assert volume(turned) == pytest.approx(volume(geometry_of(loaded(tmp_path, msh_4(drawn("tetra10"))))))


def test_axis_and_middle(tmp_path: Path) -> None:
    """A chamber about x, drawn half a turn on, is the same chamber."""
    own = geometry_of(loaded(tmp_path, msh_4(drawn())))
    drawing = drawn()
    drawing.points = {number: (z + 5, -x, -y) for number, (x, y, z) in drawing.points.items()}
    for keys in ({}, {"mesh_middle": "180 deg"}):
        found = geometry_of(loaded(tmp_path, msh_4(drawing), mesh_axis="x", **keys))
        assert found.points == pytest.approx(own.points, abs=1e-12)
    assert found.digest != own.digest


def test_a_surface_of_abaqus(tmp_path: Path) -> None:
    """*SURFACE by sets and by single elements names the facets that shells name."""
    drawing = drawn("hexahedron")
    walls = drawing.facets("outer_wall")
    corners = [set(drawing.elements[number].nodes) for number in walls]
    cells = [n for n in drawing.cells() for each in corners if each < set(drawing.elements[n].nodes)]
    text = inp(drawing).decode()
    start = text.index("*ELEMENT, TYPE=S4, ELSET=OUTER_WALL")
    text = text[:start] + text[text.index("*ELEMENT, TYPE=S4, ELSET=PLATE_RIGHT") :]
    half = len(cells) // 2
    text += "*ELSET, ELSET=_some\n" + ",".join(map(str, cells[:half])) + "\n"
    text += "*SURFACE, NAME=OUTER_WALL, TYPE=ELEMENT\n_some, S4\n"
    text += "".join(f"{number}, S4\n" for number in cells[half:])
    found = geometry_of(loaded(tmp_path, text.encode(), "chamber.inp"))
    own = geometry_of(loaded(tmp_path, inp(drawn("hexahedron")), "chamber.inp"))
    assert sorted(map(sorted, found.boundaries["outer_wall"].tolist())) == sorted(
        map(sorted, own.boundaries["outer_wall"].tolist())
    )


def in_capitals(drawing: Drawing) -> Drawing:
    drawing.names = {key: name.replace("_wall", "_Wall").title() for key, name in drawing.names.items()}
    return drawing


def renamed(drawing: Drawing, name: str) -> Drawing:
    drawing.names[3, CHAMBER] = name
    return drawing


def with_foreign_name(drawing: Drawing) -> Drawing:
    drawing.names[2, 40] = "heat_flux"
    return drawing


NODE_DATA = b'$NodeData\n1\n"p"\n1\n0.0\n3\n0\n1\n1\n1 2.5\n$EndNodeData\n'


@pytest.mark.parametrize(
    "write",
    [
        lambda: msh_2(in_capitals(drawn())),
        lambda: msh_4(in_capitals(drawn())),
        lambda: msh_2(renamed(drawn(), "my fluid")),
        lambda: msh_4(renamed(drawn(), "all")),
        lambda: msh_4(with_foreign_name(drawn()), more={2: [40]}),
        lambda: msh_2(drawn()) + NODE_DATA,
        lambda: msh_4(drawn()) + NODE_DATA,
    ],
    ids=["capitals 2.2", "capitals 4.1", "fluid", "all", "second name", "data 2.2", "data 4.1"],
)
def test_names_and_data_of_other_programs_do_not_matter(write: Callable[[], bytes], tmp_path: Path) -> None:
    """One group of cells is the chamber, whatever its name; names in any case; results on the nodes."""
    found, own = (geometry_of(loaded(tmp_path, each())) for each in (write, lambda: msh_2(drawn())))
    assert found.points == pytest.approx(own.points)
    assert {name: len(each) for name, each in found.boundaries.items()} == {
        name: len(each) for name, each in own.boundaries.items()
    }


def test_an_abaqus_file_as_other_programs_write_it(tmp_path: Path) -> None:
    """A keyword goes on after a comma, exponents have a D, a blank is zero; sections and steps are passed."""
    drawing = drawn("hexahedron")
    drawing.points = {n: (x, y, 0.0 if z == 0 else z) for n, (x, y, z) in drawing.points.items()}
    own = geometry_of(loaded(tmp_path, inp(drawing), "chamber.inp"))
    lines = inp(drawing).decode().replace("*ELEMENT, TYPE", "*Element,\n type").splitlines()
    start = lines.index("*NODE") + 1
    nodes = [each.split(", ") for each in lines[start : start + len(drawing.points)]]
    rows = [[n, f"{float(x) * 1e3:.12f}D-3", y, "" if float(z) == 0 else z] for n, x, y, z in nodes]
    assert any(not row[3] for row in rows)
    lines[start : start + len(rows)] = [", ".join((*row, "")) for row in rows]
    more = "*SOLID SECTION, ELSET=chamber, MATERIAL=water\n*MATERIAL, NAME=water\n*STEP\n*CLOAD\n1, 2, 3.\n"
    found = geometry_of(loaded(tmp_path, ("\n".join(lines) + "\n" + more).encode(), "chamber.inp"))
    assert found.points == pytest.approx(own.points, abs=1e-12)
    assert set(found.boundaries) == set(own.boundaries)


def test_facets_without_a_name_are_walls(tmp_path: Path) -> None:
    drawing = drawn()
    gone = drawing.facets("end_back")
    for number in gone:
        del drawing.elements[number]
    found = geometry_of(loaded(tmp_path, msh_2(drawing)))
    assert len(found.boundaries["walls"]) == len(gone)


def test_scenes_with_a_mesh_are_compared_by_its_digest(tmp_path: Path) -> None:
    one, two = loaded(tmp_path, msh_4(drawn())), loaded(tmp_path, msh_4(drawn()))
    assert geometry_of(one) == geometry_of(two)
    assert hash(geometry_of(one)) == hash(geometry_of(two))
    assert copy.deepcopy(one) == pickle.loads(pickle.dumps(one)) == one
    drawing = drawn()
    drawing.points[5] = (drawing.points[5][0], drawing.points[5][1], drawing.points[5][2] + 1e-9)
    other = loaded(tmp_path, msh_4(drawing))
    assert geometry_of(other) != geometry_of(one)
    assert other.values_sha256 != one.values_sha256
    assert "disc.outer_radius" not in one.defaulted


def test_one_file_read_in_two_ways_gives_two_chambers(tmp_path: Path) -> None:
    """What is kept of a chamber is found by its digest, so that the way is part of it."""
    content = msh_2(drawn())
    found = [geometry_of(loaded(tmp_path, content, mesh_axis=axis)) for axis in ("z", "-z", "z")]
    assert found[0] != found[1]
    assert found[0] == found[2]
