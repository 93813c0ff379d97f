"""Files that hold no mesh, or a damaged one: each is named, and nothing is a traceback."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from drawn_chamber import drawn, inp, loaded, msh_2, msh_4

from ringbalance.scene import SceneError


class Broken(NamedTuple):
    """A file, and what its message must say."""

    content: Callable[[], bytes]
    words: tuple[str, ...]
    name: str = "chamber.msh"


def text(old: str, new: str) -> Callable[[], bytes]:
    """A file of version 4.1 with some text replaced."""
    return lambda: msh_4(drawn()).replace(old.encode(), new.encode(), 1)


FILES: dict[str, Broken] = {
    "empty": Broken(lambda: b"", ("the file is empty",)),
    "spaces": Broken(lambda: b" \n" * 99, ("the file is empty",)),
    "another format": Broken(lambda: b"solid\n", ("ends with .stl",), "chamber.stl"),
    "no mesh at all": Broken(lambda: b"hello\n", ("not a Gmsh mesh",)),
    "ansys": Broken(lambda: b'(0 "ANSYS")\n(2 3)\n', ("ANSYS Fluent",)),
    "old version": Broken(text("4.1 0 8", "4 0 8"), ("Gmsh version 4 is not one", "2.2 or 4.1")),
    "single precision": Broken(text("4.1 0 8", "4.1 0 4"), ("numbers of 8 bytes",)),
    "no nodes": Broken(text("$Nodes", "$Knots"), ("section $Knots ends",)),
    "no elements": Broken(
        lambda: msh_4(drawn()).replace(b"$Elements", b"$Others").replace(b"$EndElements", b"$EndOthers"),
        ("no section $Elements",),
    ),
    "cut off": Broken(lambda: msh_4(drawn())[:-400], ("section $Elements ends before",)),
    "too many announced": Broken(
        text("3 7 4 72", "3 7 4 999999999999"), ("section $Elements ends before all that it announces",)
    ),
    "negative count": Broken(text("3 7 4 72", "3 7 4 -72"), ("section $Elements ends before",)),
    "word among numbers": Broken(text("3 7 4 72", "3 7 four 72"), ("$Elements holds something other",)),
    "fraction of a node": Broken(text("3 7 4 72", "3 7 4 72.5"), ("fraction where a whole number",)),
    "two sections": Broken(lambda: msh_2(drawn()) * 2, ("$MeshFormat stands in the file twice",)),
    "third order": Broken(text("3 7 4 72", "3 7 29 72"), ("Gmsh type 29", "Mesh.ElementOrder")),
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
    "vtu no xml": Broken(lambda: b"<VTKFile", ("this is not XML",), "chamber.vtu"),
    "vtu other xml": Broken(lambda: b"<svg/>", ("not a VTK UnstructuredGrid",), "chamber.vtu"),
    "vtu entities": Broken(
        lambda: b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile>&b;</VTKFile>',
        ("declares XML entities",),
        "chamber.vtu",
    ),
    "vtu no piece": Broken(
        lambda: b'<VTKFile type="UnstructuredGrid"><UnstructuredGrid/></VTKFile>',
        ("0 pieces",),
        "chamber.vtu",
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_each_is_named(name: str, tmp_path: Path) -> None:
    broken = FILES[name]
    with pytest.raises(SceneError) as caught:
        loaded(tmp_path, broken.content(), broken.name)
    assert [fault.key for fault in caught.value.faults] == ["mesh"]
    for word in broken.words:
        assert word in str(caught.value)
