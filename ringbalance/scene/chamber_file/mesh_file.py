"""The contents of a mesh file, in its own unit: Gmsh and VTK by meshio, Abaqus by a reader of its own.

For a damaged file meshio raises any exception, prints, or ends the process; this module reports one error.
"""

from __future__ import annotations

import base64
import io
import re
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

import meshio
import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.body import Contents, Mark, MeshFileError
from ringbalance.scene.chamber_file.elements import (
    CELL_KINDS,
    FACET_KINDS,
    MOST_NODES,
    NODES,
    dimension,
    faces,
)
from ringbalance.scene.chamber_file.record import KNOWN_NAMES, VOLUME
from ringbalance.scene.platform.memory import bounded_memory

FORMATS: Final = "a mesh of Gmsh 2.2 or 4.1 (.msh), Abaqus (.inp) or VTK (.vtu), or a solid (.step, .stp)"
_GMSH: Final = (
    "Gmsh 2.2 or 4.1, not partitioned, with cells of first or second order (Mesh.ElementOrder) and "
    "physical groups alone (Mesh.SaveAll = 0, Mesh.SaveParametric = 0)"
)
_NO_GROUP: Final = "elements of it are in no physical group, as with Mesh.SaveAll = 1"
_UNREAD_GMSH: Final = MappingProxyType(
    {
        r"\$MeshFormat\s+4(\.0)?\s": "it is of version 4.0 of Gmsh's format",
        r"\$MeshFormat\s+(?!2|4)": "it is of another version of Gmsh's format",
        r"\$PartitionedEntities": "it is partitioned",
        r"\$ParametricNodes|parametric nodes": "its nodes have parametric coordinates",
        r"Incompatible cell data": _NO_GROUP,
    }
)
_GMSH_DATA: Final = re.compile(rb"(?ms)^\$(NodeData|ElementData|ElementNodeData)\s.*?\$End\1\s*")
"""Results on the mesh, which meshio requires for every node; left out."""
_VTU: Final = "a .vtu file of an UnstructuredGrid, compressed by zlib, lzma or not at all"
_FLUENT: Final = (b"(0", b"(1", b"(2")
_MOST_UNPACKED_BYTES: Final = 8 * 12 * MOST_NODES
"""Largest size of one array, bytes: connectivity of ten-node cells and facets, which share most nodes."""
_SPARE_BYTES: Final = 300_000_000
_BYTES_PER_FILE_BYTE: Final = 100
"""Bytes that reading may take for each byte of the file, besides `_SPARE_BYTES`: short texts become numbers,
copied several times, and lists of numbers."""
_COMPRESSED: Final = re.compile(rb"<VTKFile[^>]*\bcompressor=")
_INLINE: Final = re.compile(rb"<DataArray[^>]*\bformat=.binary.[^>]*>\s*")
_APPENDED: Final = re.compile(rb"<AppendedData\s+encoding=.(raw|base64).\s*>\s*_")
_OFFSET: Final = re.compile(rb"<DataArray[^>]*\boffset=.(\d{1,12}).")


def _by_meshio(
    content: bytes,
    read: Callable[[str], meshio.Mesh],
    allowed: str,
    unread: Mapping[str, str] = MappingProxyType({}),
) -> meshio.Mesh:
    """Read a file with meshio. Raises: MeshFileError: the file is no such mesh.

    Args: `allowed`: accepted files. `unread`: sentences on sound files, by a text in the file or the error.
    """
    bound = _SPARE_BYTES + _BYTES_PER_FILE_BYTE * len(content)
    quiet = redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO())
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(), quiet[0], quiet[1]:
        warnings.simplefilter("error", DeprecationWarning)
        warnings.simplefilter("ignore", ResourceWarning)
        path = Path(folder) / "mesh"
        path.write_bytes(content)
        with bounded_memory(bound):
            try:
                mesh = read(str(path))
            except (Exception, SystemExit) as error:
                # A damaged count may request all memory.
                reason = " ".join(str(error).split())[:200]
                for pattern, text in unread.items():
                    if re.search(pattern.encode(), content) or re.search(pattern, reason):
                        raise MeshFileError.of(text, allowed) from error
                problem = f"meshio cannot read it, it is damaged or cut off ({type(error).__name__} {reason}"
                raise MeshFileError.of(f"{problem.rstrip()})", allowed) from error
    if mesh.points.ndim != 2 or mesh.points.shape[1] != 3:
        raise MeshFileError.of("its nodes do not have three coordinates each", allowed)
    return mesh


def _contents(mesh: meshio.Mesh, marks: Iterable[Mark], others: tuple[str, ...]) -> Contents:
    blocks = tuple((block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells)
    points = np.asarray(mesh.points, dtype=np.float64)
    return Contents(points=points, blocks=blocks, marks=tuple(marks), other_names=others)


def _read_gmsh(content: bytes) -> Contents:
    if content.lstrip()[:2] in _FLUENT:
        raise MeshFileError.of(
            "this is an ANSYS Fluent mesh, which has the same file ending as Gmsh's", FORMATS
        )
    if b"$MeshFormat" not in content:
        raise MeshFileError.of("this is not a Gmsh mesh: it has no $MeshFormat", FORMATS)
    for section in (b"MeshFormat", b"Nodes", b"Elements"):
        if content.count(b"\n$" + section) + content.startswith(b"$" + section) > 1:
            problem = f"section ${section.decode()} stands in the file twice"
            raise MeshFileError.of(problem, "each section once")
    mesh = _by_meshio(_GMSH_DATA.sub(b"", content), meshio.gmsh.read, _GMSH, _UNREAD_GMSH)
    marks = tuple(_groups(mesh))
    if mesh.field_data and not any(mark.where.any() for mark in marks):
        raise MeshFileError.of(_NO_GROUP, _GMSH)
    return _contents(mesh, marks, tuple(mesh.field_data))


def _groups(mesh: meshio.Mesh) -> Iterator[Mark]:
    """Physical groups: the sets of version 4.1, of which an element may have several, or group numbers.

    A group without a name keeps its number, so that a message can name it.
    """
    for name, sets in mesh.cell_sets.items():
        for block, rows in enumerate(sets if not name.startswith("gmsh:") else ()):
            mask = np.zeros(len(mesh.cells[block]), dtype=np.bool_)
            mask[np.asarray(rows, dtype=np.int64)] = True
            yield Mark(name=_known(name), block=block, where=mask)
    names = {(int(of), int(number)): name for name, (number, of) in mesh.field_data.items()}
    for block, numbers in enumerate(mesh.cell_data.get("gmsh:physical", ())):
        of = dimension(mesh.cells[block].type)
        for number in np.unique(np.abs(numbers)).tolist():
            named = names.get((of, number), f"physical group {number}")
            if number and named not in mesh.cell_sets:
                yield Mark(name=_known(named), block=block, where=np.abs(numbers) == number)


def _known(name: str) -> str:
    """Name of a boundary or of the volume in lower case; any other name unchanged."""
    lower = name.strip().lower()
    return lower if lower in (*KNOWN_NAMES, VOLUME) else name


def _read_vtu(content: bytes) -> Contents:
    """Contents of a .vtu file: cell data with the name of a boundary are non-zero on its facets."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MeshFileError.of("it declares XML entities, which no mesh needs", "a .vtu file without DOCTYPE")
    if b"<VTKFile" not in content[:1000]:
        raise MeshFileError.of("this is not a VTK UnstructuredGrid", "a .vtu file")
    if _COMPRESSED.search(content):
        _refuse_bomb(content)
    mesh = _by_meshio(content, meshio.vtu.read, _VTU)
    data = [(_known(name), each) for name, each in mesh.cell_data.items()]
    named = [(name, each) for name, each in data if name in (*KNOWN_NAMES, VOLUME)]
    if any(np.ndim(values) != 1 for _, each in named for values in each):
        raise MeshFileError.of("data of cells that have a boundary's name must be one number for each cell")
    marks = (
        Mark(name=name, block=block, where=np.asarray(values) != 0)
        for name, each in named
        for block, values in enumerate(each)
    )
    return _contents(mesh, marks, tuple(mesh.cell_data))


def _refuse_bomb(content: bytes) -> None:
    """Refuse an array larger than any mesh, by the sizes stated before its compressed blocks.

    Raises: MeshFileError.
    Source: VTK file formats, XML: number of blocks, size of a block, size of the last one.
    """
    header = content[: content.find(b">", content.find(b"<VTKFile"))]
    order = ">" if b"BigEndian" in header else "<"
    number = struct.Struct(order + ("3Q" if b"UInt64" in header else "3I"))
    inline = [(match.end(), True) for match in _INLINE.finditer(content)]
    appended = _APPENDED.search(content)
    if appended is not None:
        coded = appended[1] == b"base64"
        inline += [(appended.end() + int(match[1]), coded) for match in _OFFSET.finditer(content)]
    for start, coded in inline:
        head = content[start : start + number.size + 8]
        try:
            count, block, last = number.unpack((base64.b64decode(head) if coded else head)[: number.size])
        except (ValueError, struct.error):
            continue
        if (
            max(count - 1, 0) * block + last > _MOST_UNPACKED_BYTES
            or max(count, block) > _MOST_UNPACKED_BYTES
        ):
            problem = f"one of its arrays would have {count * block} bytes"
            raise MeshFileError.of(problem, f"up to {MOST_NODES} nodes or cells")


_SHELL: Final = r"(CPS|CPE|CAX|S|M3D|SFM3D|R3D|DS)"
_KINDS: Final = (
    (r"(D?C3D|AC3D|F3D)4\D*", "tetra"),
    (r"(D?C3D|AC3D)10\D*", "tetra10"),
    (r"(D?C3D|AC3D|F3D)8\D*", "hexahedron"),
    (r"(D?C3D|AC3D)20\D*", "hexahedron20"),
    (_SHELL + r"3\D*|STRI3", "triangle"),
    (_SHELL + r"6\D*|STRI65", "triangle6"),
    (_SHELL + r"4\D*5?", "quad"),
    (_SHELL + r"8\D*5?", "quad8"),
    (r"T[23]D2|B[23]1", "line"),
    (r"T[23]D3|B[23]2", "line3"),
)
_EXPONENTS: Final = str.maketrans("dD", "ee")
_NODES: Final = MappingProxyType({"line": 2, "line3": 3, **NODES})
_ALLOWED: Final = "C3D4, C3D10, C3D8 or C3D20 for the chamber, S3, S4, S6 or S8 for its faces"
_FACES: Final = MappingProxyType(
    {
        4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)),
        6: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7)),
    }
)
"""Corners of the faces S1, S2, ... by their number."""
_READ: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "node": ("nset", "system=r"),
        "element": ("type", "elset"),
        "elset": ("elset", "generate", "instance", "internal", "unsorted"),
        "surface": ("name", "type=element", "type=node", "internal"),
        "part": ("name",),
        "end part": (),
        "assembly": ("name",),
        "end assembly": (),
        "instance": ("name", "part"),
        "end instance": (),
    }
)
"""Keywords of a mesh with their accepted options, some with a single accepted value."""
_PASSED: Final = re.compile(
    r"heading|preprint|nset|material|density|elastic|(solid|shell|membrane|surface) section"
)
"""Keywords that do not change the mesh."""
_SKIPPED: Final = re.compile(r"(surface|line|volume)\d+|_.*|", re.IGNORECASE)
"""Names that programs assign automatically."""


@dataclass
class _MeshContent:
    """Content read so far; names in lower case."""

    nodes: list[FloatArray] = field(default_factory=list)
    """Nodes: rows of number and coordinates."""
    elements: list[tuple[str, str, IntArray]] = field(default_factory=list)
    """Kind, name, and rows of element number and node numbers."""
    sets: dict[str, list[IntArray]] = field(default_factory=dict)
    """Element numbers by name of the set."""
    surfaces: list[tuple[str, str, str]] = field(default_factory=list)
    """Name, element or set, and face of each line of a surface."""


def _read_abaqus(content: bytes) -> Contents:
    """The contents of an .inp file up to its first step: nodes, elements, element sets and surfaces.

    Own code: meshio passes over *SURFACE, keeps the last of several *NODE, *ELSET or *ELEMENT of one name,
    and assigns the set of one *ELEMENT to another where some have none, all without a warning.
    Raises: MeshFileError: no such file, or a damaged one.
    Source: Abaqus keywords reference, *NODE, *ELEMENT, *ELSET, *SURFACE; faces of solid elements as its
        element library numbers them.
    """
    parts = _MeshContent()
    for keyword, options, data in _keywords(content.decode("utf-8", errors="replace")):
        if keyword == "step":
            break
        if not _PASSED.fullmatch(keyword):
            _add(parts, keyword, options, data)
    if not parts.nodes or not parts.elements:
        raise MeshFileError.of(
            "this is not an Abaqus mesh: it has no *NODE or no *ELEMENT", "an Abaqus .inp file"
        )
    nodes = np.concatenate(parts.nodes)
    order = np.argsort(nodes[:, 0], kind="stable")
    numbers = _whole(nodes[order, 0], "*NODE")
    if (numbers[1:] == numbers[:-1]).any():
        raise MeshFileError.of(f"*NODE has number {numbers[1:][numbers[1:] == numbers[:-1]][0]} twice")

    def places(of: IntArray) -> IntArray:
        at = np.minimum(np.searchsorted(numbers, of), len(numbers) - 1)
        return np.where(numbers[at] == of, order[at], -1)

    sides = list(_sides(parts))
    blocks = [(kind, places(rows[:, 1:])) for kind, _, rows in parts.elements]
    blocks += [(FACET_KINDS[rows.shape[1]], places(rows)) for _, rows in sides]
    named = (
        Mark(name=name, block=len(parts.elements) + number, where=np.ones(len(rows), dtype=np.bool_))
        for number, (name, rows) in enumerate(sides)
    )
    return Contents(
        points=nodes[:, 1:],
        blocks=tuple(blocks),
        marks=(*_marks(parts), *named),
        other_names=tuple(name for name in parts.sets if not _SKIPPED.fullmatch(name)),
    )


def _keywords(text: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Each keyword with its options and its data lines; text before the first keyword is ignored."""
    for block in re.split(r"(?m)^\*(?!\*)", re.sub(r"(?m)^\*\*.*$", "", text))[1:]:
        head, *data = (line for line in block.splitlines() if line.strip())
        while head.rstrip().endswith(",") and data and data[0].lstrip()[0].isalpha():
            head += data.pop(0)
        word, *rest = (part.strip() for part in head.split(","))
        pairs = (part.partition("=") for part in rest)
        options = {key.strip().lower(): value.strip().strip('"').lower() for key, _, value in pairs}
        yield " ".join(word.lower().split()), {key: value for key, value in options.items() if key}, data


def _add(parts: _MeshContent, keyword: str, options: dict[str, str], data: list[str]) -> None:
    """Add the data of a keyword to the content.

    Raises: MeshFileError: a keyword or an option that is not supported and might change the mesh.
    """
    if keyword == "include":
        raise MeshFileError.of("it includes another file, which is not read", "one file with the whole mesh")
    if keyword not in _READ:
        names = ", ".join(f"*{name.upper()}" for name in _READ if " " not in name)
        raise MeshFileError.of(f"it has *{keyword.upper()[:40]}, which is not read", names)
    for key, value in options.items():
        if not {key, f"{key}={value}"} & set(_READ[keyword]):
            option = f"{key}={value}".rstrip("=").upper()[:40]
            names = ", ".join(each.upper() for each in _READ[keyword]) or "none"
            raise MeshFileError.of(f"*{keyword.upper()} has the option {option}, which is not read", names)
    if keyword == "instance" and data:
        raise MeshFileError.of(
            "*INSTANCE moves the part", "a part in its final place, or a mesh without parts"
        )
    if keyword == "node":
        parts.nodes.append(_table(data, 4, "*NODE"))
    elif keyword == "element":
        name = options.get("type", "").upper()
        kind = next((kind for pattern, kind in _KINDS if re.fullmatch(pattern, name)), None)
        if kind is None:
            raise MeshFileError.of(f"*ELEMENT has the unknown type {name[:20] or 'none'}", _ALLOWED)
        rows = _whole(_table(data, 1 + _NODES[kind], "*ELEMENT"), "*ELEMENT")
        parts.elements.append((kind, options.get("elset", ""), rows))
    elif keyword == "elset":
        numbers = _set(data, "generate" in options, parts)
        parts.sets.setdefault(options.get("elset", ""), []).append(numbers)
    elif keyword == "surface" and options.get("type", "element") == "element":
        for line in data:
            first, _, side = line.partition(",")
            parts.surfaces.append((options.get("name", ""), first.strip().lower(), side.strip(" ,").upper()))


def _table(data: list[str], width: int, what: str) -> FloatArray:
    """Numbers in rows; an exponent may be written with D, and a blank between commas is zero."""
    text = "\n".join(data).translate(_EXPONENTS)
    text = re.sub(r",(?=[ \t]*,)", ",0", text).replace(",", " ")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise MeshFileError.of(f"{what} holds something other than numbers") from error
    if not len(values) or len(values) % width:
        raise MeshFileError.of(f"{what} does not have {width} numbers for each entry")
    return values.reshape(-1, width)


def _whole(values: FloatArray, what: str) -> IntArray:
    """Convert numbers to integers. Raises: MeshFileError: one of them is none."""
    with np.errstate(invalid="ignore"):
        numbers = values.astype(np.int64)
    if not ((numbers == values) & (np.abs(values) < 2**53)).all():
        raise MeshFileError.of(f"{what} has a fraction where a whole number belongs")
    return numbers


def _set(data: list[str], generate: bool, parts: _MeshContent) -> IntArray:
    """Numbers of elements in a set: listed, as first, last and step, or by the names of other sets."""
    words = [word.strip().lower() for line in data for word in line.split(",") if word.strip()]
    listed = [word for word in words if word.isdigit()]
    numbers = _whole(_table(listed, 1, "*ELSET")[:, 0], "*ELSET") if listed else np.empty(0, dtype=np.int64)
    if not generate:
        return np.concatenate([numbers, *(_numbers_in(word, parts) for word in words)])
    every = np.concatenate([np.empty(0, dtype=np.int64), *(rows[:, 0] for _, _, rows in parts.elements)])
    ranges = np.append(numbers, 1) if len(numbers) == 2 else numbers
    inside = np.zeros(len(every), dtype=np.bool_)
    for first, last, step in ranges[: len(ranges) // 3 * 3].reshape(-1, 3).tolist():
        inside |= (every >= first) & (every <= last) & ((every - first) % max(step, 1) == 0)
    return every[inside]


def _numbers_in(name: str, parts: _MeshContent) -> IntArray:
    """Numbers of the elements under a name, given by a set or by the option of *ELEMENT."""
    named = [rows[:, 0] for _, block, rows in parts.elements if block == name]
    return np.concatenate([np.empty(0, dtype=np.int64), *named, *parts.sets.get(name, [])])


def _marks(parts: _MeshContent) -> Iterator[Mark]:
    """Names of elements; a set of cells counts only if named `chamber`."""
    names = dict.fromkeys([*parts.sets, *(name for _, name, _ in parts.elements)])
    for name in (each for each in names if not _SKIPPED.fullmatch(each)):
        numbers = _numbers_in(name, parts)
        for block, (kind, _, rows) in enumerate(parts.elements):
            if dimension(kind) < 3 or name == "chamber":
                yield Mark(name=name, block=block, where=np.isin(rows[:, 0], numbers))


def _sides(parts: _MeshContent) -> Iterator[tuple[str, IntArray]]:
    """Name and facets of each line of a *SURFACE, as numbers of nodes in meshio's order."""
    for name, first, side in parts.surfaces:
        is_element = first.isdigit() and len(first) < 16
        numbers = np.array([int(first)]) if is_element else _numbers_in(first, parts)
        for kind, _, rows in parts.elements:
            inside = np.isin(rows[:, 0], numbers)
            if not inside.any():
                continue
            # A shell element is itself a face.
            face = list(range(_NODES[kind]))
            if kind in CELL_KINDS:
                cell_faces = faces(kind)
                corners = {f"S{i}": set(each) for i, each in enumerate(_FACES[len(cell_faces)], start=1)}
                if side not in corners:
                    problem = f"*SURFACE names face {side[:9]} of {kind} cells, which have no such face"
                    raise MeshFileError.of(problem, "S1 to S6")
                wanted = corners[side]
                face = next(list(each) for each in cell_faces if set(each[: len(wanted)]) == wanted)
            yield name, rows[inside, 1:][:, face]


READERS: Final[Mapping[str, Callable[[bytes], Contents]]] = MappingProxyType(
    {".msh": _read_gmsh, ".inp": _read_abaqus, ".vtu": _read_vtu}
)
"""Readers by the ending of a file's name."""
