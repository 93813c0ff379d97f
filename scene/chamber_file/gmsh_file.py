"""Gmsh files of versions 2.2 and 4.1, text and binary: all that a chamber needs, and nothing else is read.

Own code, because meshio keeps neither the numbers of nodes and elements nor a second physical name of a
face, and both belong into messages.  Counts in a file are only compared with what follows them, so that a
false one costs nothing.  Source: Gmsh reference manual, chapter "Gmsh file formats".
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final, Protocol

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.contents import Contents, Elements, MeshFileError, numbers_in, whole
from ringbalance.scene.chamber_file.elements import GMSH_KINDS, GMSH_ORDER, NODES, dimension

_FORMATS: Final = "Gmsh 2.2 or 4.1 (File > Export, or -format msh41), Abaqus .inp, .vtu, or .step"
_SECTION: Final = re.compile(rb"^\$(\w{1,40})[ \t]*\r?\n", re.MULTILINE)
_NAME: Final = re.compile(r'^\s*([0-3])\s+(\d{1,9})\s+"(.*)"\s*$')
_READ: Final = ("MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements")
Names = Mapping[tuple[int, int], str]
"""By dimension and physical number."""


class _Stream(Protocol):
    """Numbers one after the other; which type they have matters in a binary file only."""

    def integers(self, count: int) -> IntArray: ...
    def sizes(self, count: int) -> IntArray: ...
    def reals(self, count: int) -> FloatArray: ...


class _Text:
    def __init__(self, body: bytes, what: str) -> None:
        self._values = numbers_in(body, what)
        self._what = what
        self.at = 0

    def reals(self, count: int) -> FloatArray:
        if not 0 <= count <= len(self._values) - self.at:
            raise _short(self._what)
        self.at += count
        return self._values[self.at - count : self.at]

    def integers(self, count: int) -> IntArray:
        return whole(self.reals(count), self._what)

    sizes = integers

    def rest(self) -> FloatArray:
        return self.reals(len(self._values) - self.at)


class _Binary:
    def __init__(self, body: bytes, what: str) -> None:
        self._body = body
        self._what = what
        self._at = 0

    def _take(self, count: int, kind: str) -> FloatArray | IntArray:
        size = count * np.dtype(kind).itemsize
        if not 0 <= size <= len(self._body) - self._at:
            raise _short(self._what)
        self._at += size
        return np.frombuffer(self._body, dtype=kind, count=count, offset=self._at - size)

    def integers(self, count: int) -> IntArray:
        return self._take(count, "<i4").astype(np.int64)

    def sizes(self, count: int) -> IntArray:
        return self._take(count, "<i8").astype(np.int64)

    def reals(self, count: int) -> FloatArray:
        return self._take(count, "<f8").astype(np.float64)


def _short(what: str) -> MeshFileError:
    return MeshFileError.of(f"{what} ends before all that it announces: the file is damaged or cut off")


def read_gmsh(content: bytes) -> Contents:
    """What a .msh file holds. Raises: MeshFileError: it is no such file, or damaged."""
    if content.lstrip()[:2] in (b"(0", b"(1", b"(2"):
        raise MeshFileError.of(
            "this is an ANSYS Fluent mesh, which has the same file ending as Gmsh's", _FORMATS
        )
    sections = _sections(content)
    version, binary = _version(sections)
    names = _physical_names(sections.get("PhysicalNames", b""))
    for name in ("Nodes", "Elements"):
        if name not in sections:
            raise MeshFileError.of(f"the file has no section ${name}", _FORMATS)
    return _read_2(sections, names, binary) if version == "2.2" else _read_4(sections, names, binary)


def _sections(content: bytes) -> dict[str, bytes]:
    """Bodies of the sections that are read; others, such as results, are passed over."""
    found: dict[str, bytes] = {}
    at = 0
    while (match := _SECTION.search(content, at)) is not None:
        name = match[1].decode()
        end = content.find(b"$End" + match[1], match.end())
        if end < 0:
            raise _short(f"section ${name}")
        if name in found:
            raise MeshFileError.of(f"section ${name} stands in the file twice", "each section once")
        if name in _READ:
            found[name] = content[match.end() : end]
        at = end + len(match[1]) + 4
    if "MeshFormat" not in found:
        raise MeshFileError.of("this is not a Gmsh mesh: it has no $MeshFormat", _FORMATS)
    return found


def _version(sections: Mapping[str, bytes]) -> tuple[str, bool]:
    line, _, rest = sections["MeshFormat"].partition(b"\n")
    words = line.decode("ascii", errors="replace").split()
    if len(words) != 3 or words[0] not in ("2.2", "4.1"):
        problem = f"its Gmsh version {words[0][:20] if words else 'missing'} is not one that is read"
        raise MeshFileError.of(problem, _FORMATS)
    if words[1] not in ("0", "1") or words[2] != "8":
        raise MeshFileError.of("its $MeshFormat is neither text nor binary with numbers of 8 bytes", _FORMATS)
    if words[1] == "1" and rest[:4] != b"\x01\x00\x00\x00":
        raise MeshFileError.of("it is a binary file of a machine with another byte order", "a text file")
    return words[0], words[1] == "1"


def _physical_names(body: bytes) -> Names:
    found: dict[tuple[int, int], str] = {}
    for line in body.decode("utf-8", errors="replace").splitlines()[1:]:
        match = _NAME.match(line)
        if match is None:
            raise MeshFileError.of("$PhysicalNames has a line that is not: dimension, number, name in quotes")
        found[int(match[1]), int(match[2])] = match[3]
    return found


def _stream(sections: Mapping[str, bytes], name: str, binary: bool) -> _Stream:
    what = f"section ${name}"
    return _Binary(sections[name], what) if binary else _Text(sections[name], what)


def _read_4(sections: Mapping[str, bytes], names: Names, binary: bool) -> Contents:
    physical = _entities(_stream(sections, "Entities", binary)) if "Entities" in sections else {}
    numbers, places = _nodes_4(_stream(sections, "Nodes", binary))
    blocks = list(_elements_4(_stream(sections, "Elements", binary), physical, names))
    return _contents(numbers, places, blocks, names)


def _entities(stream: _Stream) -> dict[tuple[int, int], tuple[int, ...]]:
    """Physical numbers of each entity, by dimension and number."""
    found = {}
    for of, count in enumerate(stream.sizes(4).tolist()):
        for _ in range(count):
            tag = int(stream.integers(1)[0])
            stream.reals(3 if of == 0 else 6)
            groups = stream.integers(int(stream.sizes(1)[0]))
            found[of, tag] = tuple(dict.fromkeys(np.abs(groups).tolist()))
            if of:
                stream.integers(int(stream.sizes(1)[0]))
    return found


def _nodes_4(stream: _Stream) -> tuple[IntArray, FloatArray]:
    numbers, places = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    for _ in range(int(stream.sizes(4)[0])):
        dimension, _tag, parametric = stream.integers(3).tolist()
        count = int(stream.sizes(1)[0])
        numbers.append(stream.sizes(count))
        width = 3 + (dimension if parametric and 0 < dimension <= 3 else 0)
        places.append(stream.reals(count * width).reshape(count, width)[:, :3])
    return np.concatenate(numbers), np.concatenate(places)


def _elements_4(
    stream: _Stream, physical: Mapping[tuple[int, int], tuple[int, ...]], names: Names
) -> Iterator[Elements]:
    for _ in range(int(stream.sizes(4)[0])):
        dimension, tag, kind = stream.integers(3).tolist()
        count = int(stream.sizes(1)[0])
        width = 1 + _nodes_of(kind)
        rows = stream.sizes(count * width).reshape(count, width)
        named = tuple(_name(names, dimension, group) for group in physical.get((dimension, tag), ()))
        yield _block(kind, rows[:, 0], rows[:, 1:], named)


def _read_2(sections: Mapping[str, bytes], names: Names, binary: bool) -> Contents:
    count, body = _counted(sections["Nodes"], "section $Nodes")
    if binary:
        if len(body) < count * 28:
            raise _short("section $Nodes")
        rows = np.frombuffer(body[: count * 28], dtype=[("number", "<i4"), ("place", "<f8", 3)])
        numbers, places = rows["number"].astype(np.int64), rows["place"].astype(np.float64)
    else:
        stream = _Text(body, "section $Nodes")
        table = stream.reals(count * 4).reshape(count, 4)
        numbers, places = whole(table[:, 0], "section $Nodes"), table[:, 1:]
    count, body = _counted(sections["Elements"], "section $Elements")
    runs = list(_runs_binary(body, count) if binary else _runs_text(body, count))
    blocks = [block for kind, tags, rows in runs for block in _named_2(kind, tags, rows, names)]
    return _contents(numbers, places, blocks, names)


def _counted(body: bytes, what: str) -> tuple[int, bytes]:
    line, _, rest = body.partition(b"\n")
    if not line.strip().isdigit() or len(line) > 20:
        raise MeshFileError.of(f"{what} does not begin with its count: the file is damaged")
    return int(line), rest


def _runs_text(body: bytes, count: int) -> Iterator[tuple[int, int, IntArray]]:
    """Type, number of tags, and rows (number, tags, nodes) of neighbours that agree in type and tags."""
    values = whole(_Text(body, "section $Elements").rest(), "section $Elements")
    at = done = 0
    while done < count:
        if at + 3 > len(values):
            raise _short("section $Elements")
        kind, tags = values[at + 1 : at + 3].tolist()
        width = 3 + tags + _nodes_of(kind)
        room = values[at : at + min(count - done, (len(values) - at) // width) * width].reshape(-1, width)
        if tags < 0 or not len(room):
            raise _short("section $Elements")
        other = np.flatnonzero((room[:, 1] != kind) | (room[:, 2] != tags))
        rows = room[: int(other[0])] if len(other) else room
        yield kind, tags, np.delete(rows, [1, 2], axis=1)
        at, done = at + rows.size, done + len(rows)


def _runs_binary(body: bytes, count: int) -> Iterator[tuple[int, int, IntArray]]:
    stream, done = _Binary(body, "section $Elements"), 0
    while done < count:
        kind, following, tags = stream.integers(3).tolist()
        width = 1 + tags + _nodes_of(kind)
        if tags < 0 or following < 1:
            raise _short("section $Elements")
        yield kind, tags, stream.integers(following * width).reshape(following, width)
        done += following


def _named_2(kind: int, tags: int, rows: IntArray, names: Names) -> Iterator[Elements]:
    """Elements of one kind by the group that each belongs to; group 0 is no name."""
    of = dimension(GMSH_KINDS[kind])
    groups = np.abs(rows[:, 1]) if tags else np.zeros(len(rows), dtype=np.int64)
    block = _block(kind, rows[:, 0], rows[:, 1 + tags :], ())
    for group in np.unique(groups).tolist():
        inside = groups == group
        named = (_name(names, of, group),) if group else ()
        yield replace(block, numbers=block.numbers[inside], nodes=block.nodes[inside], names=named)


def _nodes_of(kind: int) -> int:
    """Number of nodes of a type; an unknown type ends the reading, as its length is unknown."""
    if kind not in GMSH_KINDS:
        problem = f"section $Elements has elements of Gmsh type {kind}, of third order or none of a mesh"
        raise MeshFileError.of(problem, "elements of first or second order (Mesh.ElementOrder = 1 or 2)")
    return NODES[GMSH_KINDS[kind]]


def _name(names: Names, dimension: int, group: int) -> str:
    """A physical group that nobody named keeps its number, so that a message can name it."""
    return names.get((dimension, group), f"physical group {group}")


def _block(kind: int, numbers: IntArray, nodes: IntArray, named: tuple[str, ...]) -> Elements:
    name = GMSH_KINDS[kind]
    order = GMSH_ORDER.get(name)
    ordered = nodes if order is None else nodes[:, list(order)]
    return Elements(kind=name, numbers=numbers, nodes=ordered, names=named)


def _contents(numbers: IntArray, places: FloatArray, blocks: list[Elements], names: Names) -> Contents:
    used = {name for block in blocks for name in block.names}
    other = tuple(name for name in names.values() if name not in used)
    return Contents(node_numbers=numbers, coordinates=places, blocks=tuple(blocks), other_names=other)
