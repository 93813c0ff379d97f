"""VTU files (VTK's unstructured grids in XML): points, cells, and data of cells that have a boundary's name.

Own code, because what a block of compressed data grows to must be bounded before it is unpacked.  Source:
VTK file formats, XML; as text, base64 or raw, compressed by zlib, lzma or not at all.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.contents import Contents, Elements, MeshFileError, numbers_in, whole
from ringbalance.scene.chamber_file.elements import MOST_NODES, NODES, VTK_KINDS
from ringbalance.scene.chamber_file.soundness import KNOWN_NAMES

_MOST_CONNECTED: Final = 12 * MOST_NODES
"""Numbers in the connectivity: of cells of ten nodes, which share most of them."""
_MOST_CELLS: Final = 2 * MOST_NODES
"""With facets among them."""
_MEMORY: Final = 2**26
"""Bytes that unpacking by lzma may take for itself."""
_TYPES: Final = MappingProxyType(
    {
        **{f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
        **{f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
        **{f"Float{8 * size}": f"f{size}" for size in (4, 8)},
    }
)
_RAW: Final = re.compile(rb'<AppendedData\s+encoding="(raw|base64)"\s*>\s*_')
_DAMAGED: Final = "the file is damaged"


@dataclass(frozen=True, kw_only=True)
class _Coding:
    """How arrays are stored in the file."""

    header: np.dtype[np.unsignedinteger]
    order: str
    compressor: str
    appended: bytes
    raw: bool


def read_vtu(content: bytes) -> Contents:
    """What a .vtu file holds. Raises: MeshFileError: it is no such file, or damaged."""
    root, coding = _document(content)
    pieces = root.findall("./UnstructuredGrid/Piece")
    if len(pieces) != 1:
        raise MeshFileError.of(
            f"it has {len(pieces)} pieces of an UnstructuredGrid", "a .vtu file with one piece"
        )
    piece = pieces[0]
    points = _numbers(piece.findall("./Points/DataArray"), coding, "Points", most=3 * MOST_NODES)
    cells = {each.get("Name", ""): each for each in piece.findall("./Cells/DataArray")}
    connectivity, offsets, types = (
        whole(_numbers([cells[name]] if name in cells else [], coding, name, most=most), name)
        for name, most in (
            ("connectivity", _MOST_CONNECTED),
            ("offsets", _MOST_CELLS),
            ("types", _MOST_CELLS),
        )
    )
    if len(points) % 3 or len(offsets) != len(types):
        raise MeshFileError.of(f"the lengths of its arrays do not fit: {_DAMAGED}")
    data = {
        name: _numbers([each], coding, name, most=_MOST_CELLS)
        for each in piece.findall("./CellData/DataArray")
        if (name := each.get("Name", "")) in (*KNOWN_NAMES, "chamber")
    }
    if any(len(values) != len(types) for values in data.values()):
        raise MeshFileError.of(
            "data of cells must have one number for each cell, 0 where the name does not hold"
        )
    marks = {name: values != 0 for name, values in data.items()}
    return Contents(
        node_numbers=np.arange(len(points) // 3),
        coordinates=points.reshape(-1, 3),
        blocks=tuple(_blocks(connectivity, offsets, types, marks)),
        other_names=tuple(each.get("Name", "") for each in piece.findall("./CellData/DataArray")),
    )


def _document(content: bytes) -> tuple[ElementTree.Element, _Coding]:
    """The XML, without the appended data, which need not be XML."""
    match, appended = _RAW.search(content), b""
    if match is not None:
        appended, content = content[match.end() :], content[: match.start()] + b"</VTKFile>"
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise MeshFileError.of("it declares XML entities, which no mesh needs", "a .vtu file without DOCTYPE")
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError) as error:
        raise MeshFileError.of(f"this is not XML, and so no .vtu file: {error}") from error
    if root.tag != "VTKFile" or root.get("type") != "UnstructuredGrid":
        raise MeshFileError.of("this is XML, but not a VTK UnstructuredGrid", "a .vtu file")
    order = {"LittleEndian": "<", "BigEndian": ">"}.get(root.get("byte_order", "LittleEndian"), "<")
    kind = _TYPES.get(root.get("header_type", "UInt32"), "u4")
    raw = match is not None and match[1] == b"raw"
    compressor = root.get("compressor", "")
    if compressor not in ("", "vtkZLibDataCompressor", "vtkLZMADataCompressor"):
        raise MeshFileError.of(
            f"its compressor {compressor[:40]} is not one that is read", "zlib, lzma or none"
        )
    header: np.dtype[np.unsignedinteger] = np.dtype(order + kind)
    return root, _Coding(header=header, order=order, compressor=compressor, appended=appended, raw=raw)


def _numbers(arrays: list[ElementTree.Element], coding: _Coding, what: str, *, most: int) -> FloatArray:
    """The numbers of an array, however it is stored; `most`: as many as a mesh of the largest size has."""
    kind = _TYPES.get(arrays[0].get("type", "")) if arrays else None
    if kind is None:
        raise MeshFileError.of(f"its array {what[:40]} is missing, or of no type that is known: {_DAMAGED}")
    text, form = (arrays[0].text or "").encode(), arrays[0].get("format", "ascii")
    if form == "ascii":
        return numbers_in(text, what)
    offset, size = arrays[0].get("offset", "0"), int(kind[1:])
    if form == "appended" and (not offset.isdigit() or len(offset) > 12):
        raise MeshFileError.of(f"its array {what[:40]} has no place in the appended data: {_DAMAGED}")
    try:
        if form == "appended":
            stored = coding.appended[int(offset) :]
            content = _unpacked(stored, coding, coded=not coding.raw, most=most * size)
        else:
            content = _unpacked(text.strip(), coding, coded=True, most=most * size)
        return np.frombuffer(content, dtype=coding.order + kind).astype(np.float64)
    except (ValueError, IndexError, binascii.Error, zlib.error, lzma.LZMAError, EOFError) as error:
        raise MeshFileError.of(f"its array {what[:40]} cannot be unpacked: {_DAMAGED}") from error


def _unpacked(stored: bytes, coding: _Coding, *, coded: bool, most: int) -> bytes:
    """Bytes of one array: its length, or the lengths of its compressed blocks, stand before it."""
    size = coding.header.itemsize
    if not coding.compressor:
        length = int(_head(stored, coding, 1, coded=coded)[0])
        _bounded(length, most)
        if not coded:
            return stored[size : size + length]
        # Some writers code the length by itself, which ends with padding, and others together with the data.
        ends = _coded_length(size)
        together = not stored[:ends].endswith(b"=")
        return _plain(stored, size + length)[size:] if together else _plain(stored[ends:], length)
    count, block, last = _head(stored, coding, 3, coded=coded).tolist()
    # The last block may be as good as empty.
    _bounded(max(count - 1, 0) * max(block, 1) + last, most)
    _bounded(max(count, block), most)
    lengths = _head(stored, coding, 3 + count, coded=coded)[3:].tolist()
    at = _coded_length((3 + count) * size) if coded else (3 + count) * size
    body = _plain(stored[at:], sum(lengths)) if coded else stored[at:]
    parts = []
    for length in lengths:
        parts.append(_expanded(body[:length], coding.compressor, block))
        body = body[length:]
    return b"".join(parts)


def _head(stored: bytes, coding: _Coding, count: int, *, coded: bool) -> npt.NDArray[np.unsignedinteger]:
    size = coding.header.itemsize * count
    return np.frombuffer(_plain(stored, size) if coded else stored[:size], dtype=coding.header, count=count)


def _coded_length(size: int) -> int:
    return 4 * ((size + 2) // 3)


def _plain(stored: bytes, size: int) -> bytes:
    """The first bytes of what is written in base64; a header has padding of its own."""
    return base64.b64decode(stored[: _coded_length(size)])[:size]


def _expanded(packed: bytes, compressor: str, most: int) -> bytes:
    if compressor == "vtkZLibDataCompressor":
        return zlib.decompressobj().decompress(packed, max(most, 1))
    return lzma.LZMADecompressor(memlimit=_MEMORY).decompress(packed, max(most, 1))


def _bounded(size: int, most: int) -> None:
    """Before anything is unpacked: what is small in the file may grow a thousand times."""
    if not 0 <= size <= most:
        raise MeshFileError.of(
            f"one of its arrays would have {size} bytes",
            f"up to {most} bytes, for {MOST_NODES} nodes or cells",
        )


def _blocks(
    connectivity: IntArray, offsets: IntArray, types: IntArray, marks: dict[str, npt.NDArray[np.bool_]]
) -> Iterator[Elements]:
    """Cells by type and names; their numbers count from 0, as in ParaView."""
    starts = np.concatenate([[0], offsets[:-1]]).astype(np.int64)
    code = sum(
        (mark * 2**place for place, mark in enumerate(marks.values())), np.zeros(len(types), dtype=int)
    )
    for kind, names in sorted(set(zip(types.tolist(), code.tolist(), strict=True))):
        at = np.flatnonzero((types == kind) & (code == names))
        if kind not in VTK_KINDS:
            problem = f"cell {at[0]} is of VTK type {kind}, which no chamber can have"
            raise MeshFileError.of(problem, "tetrahedra or hexahedra of first or second order")
        width = NODES[VTK_KINDS[kind]]
        if (offsets[at] - starts[at] != width).any() or (starts[at] < 0).any():
            raise MeshFileError.of(f"the offsets of its cells do not fit their types: {_DAMAGED}")
        if len(at) and offsets[at].max() > len(connectivity):
            raise MeshFileError.of(f"its connectivity ends too early: {_DAMAGED}")
        held = tuple(name for place, name in enumerate(marks) if names >> place & 1)
        nodes = connectivity[starts[at][:, None] + np.arange(width)]
        yield Elements(kind=VTK_KINDS[kind], numbers=at, nodes=nodes, names=held)
