"""The contents of a mesh file, in its own unit: Gmsh and VTK by meshio, Abaqus by `abaqus_file`.

For a damaged file meshio raises anything, prints, or ends the process; here that is one error.
"""

from __future__ import annotations

import base64
import io
import re
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import MappingProxyType
from typing import Final

import meshio
import numpy as np

from ringbalance.scene.arrays import BoolArray
from ringbalance.scene.chamber_file.abaqus_file import read_abaqus
from ringbalance.scene.chamber_file.body import Contents, Mark, MeshFileError
from ringbalance.scene.chamber_file.elements import MOST_NODES, dimension
from ringbalance.scene.chamber_file.record import KNOWN_NAMES, VOLUME
from ringbalance.scene.platform.memory import bounded_memory

FORMATS: Final = "a mesh of Gmsh 2.2 or 4.1 (.msh), Abaqus (.inp) or VTK (.vtu), or a solid (.step, .stp)"
_GMSH: Final = (
    "Gmsh 2.2 or 4.1 with cells of first or second order (Mesh.ElementOrder) and physical groups alone "
    "(Mesh.SaveAll = 0, Mesh.SaveParametric = 0)"
)
_VTU: Final = "a .vtu file of an UnstructuredGrid, compressed by zlib, lzma or not at all"
_FLUENT: Final = (b"(0", b"(1", b"(2")
_MOST_UNPACKED: Final = 8 * 12 * MOST_NODES
"""Bytes of one array: the connectivity of cells of ten nodes and their facets, which share most nodes."""
_SPARE_MEMORY: Final = 300_000_000
_MEMORY_PER_BYTE: Final = 100
"""Bytes that reading may take in all, and for each of the file: text of a few digits becomes numbers, copied
some times, and lists of them."""
_COMPRESSED: Final = re.compile(rb"<VTKFile[^>]*\bcompressor=")
_INLINE: Final = re.compile(rb"<DataArray[^>]*\bformat=.binary.[^>]*>\s*")
_APPENDED: Final = re.compile(rb"<AppendedData\s+encoding=.(raw|base64).\s*>\s*_")
_OFFSET: Final = re.compile(rb"<DataArray[^>]*\boffset=.(\d{1,12}).")


def read_mesh_file(content: bytes, *, ending: str) -> Contents:
    """The contents of a mesh file's bytes; `ending` is that of its name, one of `READERS`.

    Raises: MeshFileError: it is no such file, or damaged.
    """
    return READERS[ending](content)


def _by_meshio(content: bytes, read: Callable[[str], meshio.Mesh], allowed: str) -> meshio.Mesh:
    """Raises: MeshFileError: the file is no such mesh. Args: `allowed`: what is."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh"
        path.write_bytes(content)
        try:
            with warnings.catch_warnings(), redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                warnings.simplefilter("error", DeprecationWarning)
                warnings.simplefilter("ignore", ResourceWarning)
                with bounded_memory(_SPARE_MEMORY + _MEMORY_PER_BYTE * len(content)):
                    mesh = read(str(path))
        except (Exception, SystemExit) as error:
            # A damaged count asks for all memory that there is.
            reason = " ".join(str(error).split())[:200]
            problem = f"meshio cannot read it, it is damaged or cut off ({type(error).__name__} {reason}"
            raise MeshFileError.of(f"{problem.rstrip()})", allowed) from error
    if mesh.points.ndim != 2 or mesh.points.shape[1] != 3:
        raise MeshFileError.of("its nodes do not have three coordinates each", allowed)
    return mesh


def _contents(mesh: meshio.Mesh, marks: Iterator[Mark], others: tuple[str, ...]) -> Contents:
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
    mesh = _by_meshio(content, meshio.gmsh.read, _GMSH)
    return _contents(mesh, _groups(mesh), tuple(mesh.field_data))


def _groups(mesh: meshio.Mesh) -> Iterator[Mark]:
    """Physical groups: those of version 4.1 as sets, of which an element may have several, and numbers.

    A group that nobody named keeps its number, so that a message can name it.
    """
    for name, sets in mesh.cell_sets.items():
        for block, rows in enumerate(sets if not name.startswith("gmsh:") else ()):
            yield Mark(name=name, block=block, where=_mask(rows, len(mesh.cells[block])))
    names = {(int(of), int(number)): name for name, (number, of) in mesh.field_data.items()}
    for block, numbers in enumerate(mesh.cell_data.get("gmsh:physical", ())):
        of = dimension(mesh.cells[block].type)
        for number in np.unique(np.abs(numbers)).tolist():
            named = names.get((of, number), f"physical group {number}")
            if number and named not in mesh.cell_sets:
                yield Mark(name=named, block=block, where=np.abs(numbers) == number)


def _mask(rows: object, count: int) -> BoolArray:
    mask = np.zeros(count, dtype=np.bool_)
    mask[np.asarray(rows, dtype=np.int64)] = True
    return mask


def _read_vtu(content: bytes) -> Contents:
    """Data of cells that have a boundary's name, and are not zero on its facets, are the names."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MeshFileError.of("it declares XML entities, which no mesh needs", "a .vtu file without DOCTYPE")
    if b"<VTKFile" not in content[:1000]:
        raise MeshFileError.of("this is not a VTK UnstructuredGrid", "a .vtu file")
    if _COMPRESSED.search(content):
        _refuse_bomb(content)
    mesh = _by_meshio(content, meshio.vtu.read, _VTU)
    data = mesh.cell_data
    if any(np.ndim(values) != 1 for name in data for values in data[name] if name in (*KNOWN_NAMES, VOLUME)):
        raise MeshFileError.of("data of cells that have a boundary's name must be one number for each cell")
    marks = (
        Mark(name=name, block=block, where=np.asarray(values) != 0)
        for name in (*KNOWN_NAMES, VOLUME)
        for block, values in enumerate(data.get(name, ()))
    )
    return _contents(mesh, marks, tuple(data))


def _refuse_bomb(content: bytes) -> None:
    """Refuse an array that would grow beyond any mesh, by the sizes that stand before its compressed blocks.

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
        if max(count - 1, 0) * block + last > _MOST_UNPACKED or max(count, block) > _MOST_UNPACKED:
            problem = f"one of its arrays would have {count * block} bytes"
            raise MeshFileError.of(problem, f"up to {MOST_NODES} nodes or cells")


READERS: Final[Mapping[str, Callable[[bytes], Contents]]] = MappingProxyType(
    {".msh": _read_gmsh, ".inp": read_abaqus, ".vtu": _read_vtu}
)
"""By the ending of a file's name."""
