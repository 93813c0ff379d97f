"""The single body of cells of a mesh file, with named facets; messages name entities by coordinates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import CELL_KINDS, CORNERS, FACET_KINDS, MOST_NODES, dimension
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.kinds import Contradiction

_KINDS: Final = f"cells of one kind: {', '.join(CELL_KINDS)}"
_MOST_SHOWN: Final = 4
"""Most coordinates that one message lists; further ones are counted."""
_LARGEST_COORDINATE: Final = 1e9


class MeshFileError(Exception):
    """A mesh that cannot be used. Args: `findings`: at least one error."""

    def __init__(self, findings: Iterable[Contradiction]) -> None:
        self.findings = tuple(findings)
        super().__init__("; ".join(each.problem for each in self.findings))

    @classmethod
    def of(cls, problem: str, allowed: str = "") -> MeshFileError:
        """Error of a file that cannot be checked further."""
        return cls([Contradiction(problem=problem, allowed=allowed)])


@dataclass(frozen=True, kw_only=True)
class Mark:
    """A name and the elements of one block with this name."""

    name: str
    block: int
    where: BoolArray
    """True for elements with the name, shape (elements of the block,)."""


@dataclass(frozen=True, kw_only=True)
class Contents:
    """Content of a mesh file; kinds of elements and orders of nodes are meshio's."""

    points: FloatArray
    """Coordinates in the file's unit, shape (nodes, 3)."""
    blocks: tuple[tuple[str, IntArray], ...]
    """Kind of elements, and indices of their nodes in `points`, shape (elements, nodes of one)."""
    marks: tuple[Mark, ...]
    other_names: tuple[str, ...] = ()
    """Further names in the file, perhaps of no element, for messages."""


@dataclass(frozen=True, kw_only=True)
class NamedFacets:
    """Facets of one kind with a name."""

    name: str
    kind: str
    nodes: IntArray
    """Indices of nodes in the body's points, shape (facets, nodes of a facet)."""

    @property
    def corners(self) -> IntArray:
        """Corner nodes, the first nodes of each facet."""
        return self.nodes[:, : CORNERS[self.kind]]


@dataclass(frozen=True, kw_only=True)
class Body:
    """The cells of a file, in its axes and in metres."""

    kind: CellKind
    points: FloatArray
    cells: IntArray
    """Indices of nodes in `points`, shape (cells, nodes of a cell)."""
    cell_names: tuple[tuple[str, BoolArray], ...]
    """Names of cells, each with the cells that have it."""
    named: tuple[NamedFacets, ...]
    lesser: tuple[str, ...]
    """Names of lines and points."""
    other_names: tuple[str, ...]
    """Further names in the file, perhaps of no element."""
    drawing: IntArray
    """Nodes of points and lines of the drawing, such as centres of arcs."""

    @property
    def corners(self) -> IntArray:
        """Indices of the cells' corner nodes."""
        return self.cells[:, : CORNERS[self.kind]]

    def at(self, nodes: IntArray) -> str:
        """Coordinates of nodes, or of the middles of rows of nodes, for a message."""
        places = self.points[nodes[:_MOST_SHOWN]]
        middles = places.mean(axis=1) if places.ndim == 3 else places
        few = ", ".join(f"({x:.4g}, {y:.4g}, {z:.4g}) mm" for x, y, z in (1e3 * middles).tolist())
        more = len(nodes) - _MOST_SHOWN
        return f"at {few} and {more} more" if more > 0 else f"at {few}"

    @classmethod
    def of(cls, contents: Contents, *, scale: float) -> Body:
        """The single body of a file's contents.

        Args: `scale`: metres in the file's unit.
        Raises: MeshFileError: cells or nodes that prevent all further checks.
        """
        blocks = contents.blocks
        solid = [number for number, (kind, _) in enumerate(blocks) if dimension(kind) == 3]
        wrong = [*_wrong_kinds(contents, solid), *_wrong_nodes(contents)]
        if wrong:
            raise MeshFileError(wrong)
        cell_names: dict[str, dict[int, BoolArray]] = {}
        # A file has a block for each face of the drawing.
        facets: dict[tuple[str, str], list[IntArray]] = {}
        lesser: dict[str, None] = {}
        for mark in (mark for mark in contents.marks if mark.where.any()):
            kind, nodes = blocks[mark.block]
            if dimension(kind) == 3:
                none = {number: np.zeros(len(blocks[number][1]), dtype=np.bool_) for number in solid}
                parts = cell_names.setdefault(mark.name, none)
                parts[mark.block] = parts[mark.block] | mark.where
            elif dimension(kind) == 2:
                facets.setdefault((mark.name, kind), []).append(nodes[mark.where])
            else:
                lesser[mark.name] = None
        drawing = [nodes.ravel() for kind, nodes in blocks if dimension(kind) < 2]
        return cls(
            kind=next(kind for kind in CELL_KINDS if kind == blocks[solid[0]][0]),
            points=contents.points * scale,
            cells=np.concatenate([blocks[number][1] for number in solid]),
            cell_names=tuple((name, np.concatenate([*parts.values()])) for name, parts in cell_names.items()),
            named=tuple(
                NamedFacets(name=name, kind=kind, nodes=np.concatenate(parts))
                for (name, kind), parts in facets.items()
            ),
            lesser=tuple(lesser),
            other_names=contents.other_names,
            drawing=np.concatenate([np.empty(0, dtype=np.int64), *drawing]),
        )


def _wrong_kinds(contents: Contents, solid: list[int]) -> Iterator[Contradiction]:
    counts: dict[str, int] = {}
    for kind, nodes in (contents.blocks[number] for number in solid):
        if len(nodes):
            counts[kind] = counts.get(kind, 0) + len(nodes)
    total = sum(counts.values())
    if max(total, len(contents.points)) > MOST_NODES:
        problem = f"it has {len(contents.points)} nodes and {total} cells, more than can be checked"
        yield Contradiction(problem=problem, allowed=f"up to {MOST_NODES} of each; a larger mesh size")
    if not total:
        elements = "only lines and surface elements" if contents.blocks else "no elements"
        yield Contradiction(problem=f"it has no cells, {elements}: not a mesh of a volume", allowed=_KINDS)
    readable = (*CELL_KINDS, *FACET_KINDS.values())
    unknown = dict.fromkeys(
        kind for kind, _ in contents.blocks if dimension(kind) > 1 and kind not in readable
    )
    for kind in unknown:
        yield Contradiction(
            problem=f"it has elements of the kind {kind}", allowed=f"{_KINDS}, and their facets"
        )
    if len(counts) > 1:
        mixture = "; ".join(f"{count} {kind}" for kind, count in counts.items())
        yield Contradiction(problem=f"it mixes kinds of cells: {mixture}", allowed=_KINDS)


def _wrong_nodes(contents: Contents) -> Iterator[Contradiction]:
    points = contents.points
    wrong = ~np.isfinite(points).all(axis=1)
    if wrong.any():
        yield Contradiction(problem=f"coordinates are no finite numbers ({wrong.sum()} nodes)", allowed="")
    elif points.size and np.abs(points).max() > _LARGEST_COORDINATE:
        yield Contradiction(problem=f"a coordinate is above {_LARGEST_COORDINATE:g}", allowed="")
    for kind, nodes in contents.blocks:
        lost = ((nodes < 0) | (nodes >= len(points))).any(axis=1)
        if lost.any():
            problem = f"{kind} elements have nodes that the file does not give ({lost.sum()})"
            yield Contradiction(problem=problem, allowed="")
