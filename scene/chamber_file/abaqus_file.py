"""Abaqus input files: nodes, elements, element sets and surfaces; no other keyword is looked at.

Own code, because meshio passes over *SURFACE without a word and loses the numbers of nodes and elements.
Source: Abaqus keywords reference, *NODE, *ELEMENT, *ELSET, *SURFACE; faces of solid elements as its element
library numbers them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.contents import Contents, Elements, MeshFileError, numbers_in, whole
from ringbalance.scene.chamber_file.elements import CELL_KINDS, FACET_KINDS, NODES, faces

_KINDS: Final = (
    (r"C3D4H?T?|DC3D4|AC3D4|F3D4", "tetra"),
    (r"C3D10[MHIST]*|DC3D10|AC3D10", "tetra10"),
    (r"C3D8[RHIT]*|DC3D8|AC3D8R?|F3D8", "hexahedron"),
    (r"C3D20[RHT]*|DC3D20|AC3D20", "hexahedron20"),
    (r"C3D6[HRT]*", "wedge"),
    (r"C3D15[HVT]*", "wedge15"),
    (r"C3D5H?", "pyramid"),
    (r"(CPS|CPE|CAX|S|M3D|STRI|SFM3D|R3D|DS)3[RS]*", "triangle"),
    (r"(CPS|CPE|CAX|M3D|SFM3D)6M?|STRI65", "triangle6"),
    (r"(CPS|CPE|CAX|S|M3D|SFM3D|R3D|DS)4[RIS5W]*", "quad"),
    (r"(CPS|CPE|CAX|S|M3D|SFM3D)8[R5]*", "quad8"),
    (r"(T3D|B3|T2D|B2)[12]?2?", "line"),
    (r"(T3D|T2D)3", "line3"),
)
_FACES: Final = MappingProxyType(
    {
        4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)),
        6: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7)),
    }
)
"""Corners of the faces S1, S2, ... by their number."""
_SKIPPED: Final = re.compile(r"(surface|line|volume)\d+|_.*", re.IGNORECASE)
"""Names that programs give by themselves."""


@dataclass
class _Parts:
    """What was read so far."""

    numbers: list[IntArray] = field(default_factory=list)
    places: list[FloatArray] = field(default_factory=list)
    blocks: list[tuple[str, str, IntArray]] = field(default_factory=list)
    """Kind, name, rows of number and nodes."""
    sets: dict[str, list[IntArray]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)


def read_abaqus(content: bytes) -> Contents:
    """What an .inp file holds. Raises: MeshFileError: it is no such file, or damaged."""
    parts = _Parts()
    for keyword, options, data in _keywords(content.decode("utf-8", errors="replace")):
        _add(parts, keyword, options, data)
    if not parts.numbers or not parts.blocks:
        raise MeshFileError.of(
            "this is not an Abaqus mesh: it has no *NODE or no *ELEMENT", "an Abaqus .inp file"
        )
    sets = {name: np.concatenate(each) for name, each in parts.sets.items()}
    blocks = [block for each in parts.blocks for block in _named(*each, sets)]
    surfaces = [block for name, sides in parts.surfaces.items() for block in _sides(name, sides, parts, sets)]
    return Contents(
        node_numbers=np.concatenate(parts.numbers),
        coordinates=np.concatenate(parts.places),
        blocks=(*blocks, *surfaces),
        other_names=tuple(name for name in sets if not _SKIPPED.fullmatch(name)),
    )


def _keywords(text: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Each keyword with its options and the lines of data under it; text before the first is none."""
    keyword, options, data = "", dict[str, str](), list[str]()
    for line in text.splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if not line.startswith("*"):
            data.append(line)
            continue
        if keyword:
            yield keyword, options, data
        word, *rest = (part.strip() for part in line[1:].split(","))
        pairs = (part.partition("=") for part in rest)
        options = {key.strip().lower(): value.strip().strip('"').lower() for key, _, value in pairs}
        keyword, data = word.lower(), []
    if keyword:
        yield keyword, options, data


def _add(parts: _Parts, keyword: str, options: dict[str, str], data: list[str]) -> None:
    if keyword == "include":
        raise MeshFileError.of("it includes another file, which is not read", "one file with the whole mesh")
    if keyword == "instance" and data:
        raise MeshFileError.of(
            "*INSTANCE moves the part", "a part in its final place, or a mesh without parts"
        )
    if keyword == "node":
        table = _table(data, 4, "*NODE")
        parts.numbers.append(whole(table[:, 0], "*NODE"))
        parts.places.append(table[:, 1:])
    elif keyword == "element":
        kind = _kind(options.get("type", ""))
        rows = whole(_table(data, 1 + NODES[kind], "*ELEMENT"), "*ELEMENT")
        parts.blocks.append((kind, options.get("elset", ""), rows))
    elif keyword == "elset":
        parts.sets.setdefault(options.get("elset", ""), []).append(_set(data, "generate" in options, parts))
    elif keyword == "surface" and options.get("type", "element") == "element":
        sides = [line.partition(",")[::2] for line in data]
        inside = parts.surfaces.setdefault(options.get("name", ""), [])
        inside += [(first.strip().lower(), side.strip(" ,").upper()) for first, side in sides]


def _table(data: list[str], width: int, what: str) -> FloatArray:
    values = numbers_in(" ".join(data).replace(",", " ").encode(), what)
    if not len(values) or len(values) % width:
        raise MeshFileError.of(f"{what} does not have {width} numbers for each entry: the file is damaged")
    return values.reshape(-1, width)


def _kind(name: str) -> str:
    found = next((kind for pattern, kind in _KINDS if re.fullmatch(pattern, name.upper())), None)
    if found is None:
        allowed = "C3D4, C3D10, C3D8 or C3D20 for the chamber, S3, S4, S6 or S8 for its faces"
        raise MeshFileError.of(f"*ELEMENT has the unknown type {name[:20].upper() or 'none'}", allowed)
    return found


def _set(data: list[str], generate: bool, parts: _Parts) -> IntArray:
    """Numbers of elements in a set: listed, as first, last and step, or by the names of other sets."""
    words = [word.strip() for line in data for word in line.split(",") if word.strip()]
    inside = [each for word in words for each in parts.sets.get(word.lower(), [])]
    inside += [rows[:, 0] for word in words for _, name, rows in parts.blocks if name == word.lower()]
    plain = " ".join(word for word in words if word.lstrip("-").isdigit())
    numbers = whole(numbers_in(plain.encode(), "*ELSET"), "*ELSET")
    if not generate:
        return np.concatenate([numbers, *inside])
    every = np.concatenate([rows[:, 0] for _, _, rows in parts.blocks] or [numbers[:0]])
    ranges = np.concatenate([numbers, [1]]) if len(numbers) == 2 else numbers
    found = [numbers[:0]]
    for first, last, step in ranges[: len(ranges) // 3 * 3].reshape(-1, 3).tolist():
        found.append(every[(every >= first) & (every <= last) & ((every - first) % max(step, 1) == 0)])
    return np.concatenate(found)


def _named(kind: str, name: str, rows: IntArray, sets: dict[str, IntArray]) -> Iterator[Elements]:
    """Elements of one *ELEMENT by the sets that hold them; a set of cells matters as `chamber` only."""
    solid = kind.startswith(("tetra", "hexa", "wedge", "pyra"))
    known = {
        each: np.isin(rows[:, 0], numbers)
        for each, numbers in sets.items()
        if (each == "chamber" if solid else not _SKIPPED.fullmatch(each))
    }
    if name and (name == "chamber" if solid else not _SKIPPED.fullmatch(name)):
        known[name] = np.ones(len(rows), dtype=bool)
    marks = np.array([*known.values(), np.ones(len(rows), dtype=bool)])
    combinations, which = np.unique(marks, axis=1, return_inverse=True)
    for place, held in enumerate(combinations[:-1].T):
        at = which.ravel() == place
        names = tuple(each for each, inside in zip(known, held, strict=True) if inside)
        yield Elements(kind=kind, numbers=rows[at, 0], nodes=rows[at, 1:], names=names)


def _sides(
    name: str, sides: list[tuple[str, str]], parts: _Parts, sets: dict[str, IntArray]
) -> Iterator[Elements]:
    """Facets of a *SURFACE: a set or an element, and the face of it."""
    for first, side in sides:
        wanted = np.array([int(first)]) if first.isdigit() and len(first) < 16 else sets.get(first)
        for kind, block, rows in parts.blocks:
            inside = np.isin(rows[:, 0], wanted) if wanted is not None else np.full(len(rows), block == first)
            if inside.any():
                nodes = rows[inside, 1:][:, _face(kind, side)]
                facet = FACET_KINDS[nodes.shape[1]]
                yield Elements(kind=facet, numbers=rows[inside, 0], nodes=nodes, names=(name,))


def _face(kind: str, side: str) -> list[int]:
    """Nodes of a face of a cell, in meshio's order; of a shell, its own."""
    if kind in FACET_KINDS.values():
        return list(range(NODES[kind]))
    found = faces(kind) if kind in CELL_KINDS else ()
    numbered = _FACES.get(len(found), ())
    if side not in [f"S{count}" for count in range(1, 1 + len(numbered))]:
        raise MeshFileError.of(
            f"*SURFACE names face {side[:9]} of {kind} cells, which have no such face", "S1 to S6"
        )
    corners = set(numbered[int(side[1]) - 1])
    return next(list(each) for each in found if set(each[: len(corners)]) == corners)
