"""What a mesh file holds, in its own numbers and unit, and the one body of cells that it makes.

Whatever the format, kinds, numbers and coordinates are checked here, and said to be wrong.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.elements import CELL_KINDS, CORNERS, MOST_NODES, dimension
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.kinds import Finding


class MeshFileError(Exception):
    """A mesh that cannot be used. Args: `findings`: what is wrong, at least one."""

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("; ".join(each.problem for each in self.findings))

    @classmethod
    def of(cls, problem: str, allowed: str = "") -> MeshFileError:
        """The error of a file in which nothing further can be looked at."""
        return cls([Finding(problem=problem, allowed=allowed)])


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Elements of one kind that have the same names."""

    kind: str
    """Name of meshio; of a kind that no chamber has, what its format calls it."""
    numbers: IntArray
    """As the file has them."""
    nodes: IntArray
    """Numbers of their nodes as the file has them, in meshio's order, shape (elements, nodes)."""
    names: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Contents:
    """What a mesh file holds."""

    node_numbers: IntArray
    """As the file has them."""
    coordinates: FloatArray
    """In the file's unit, shape (nodes, 3)."""
    blocks: tuple[Elements, ...]
    other_names: tuple[str, ...] = ()
    """Names that no element has, for messages."""


def numbers_in(body: bytes, what: str) -> FloatArray:
    """The numbers of a text between spaces and line ends. Raises: MeshFileError: it holds anything else."""
    if not body.strip():
        return np.empty(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(body, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise MeshFileError.of(
                f"{what} holds something other than numbers: the file is damaged"
            ) from error


def whole(values: FloatArray, what: str) -> IntArray:
    """The same numbers as integers. Raises: MeshFileError: one of them is none."""
    with np.errstate(invalid="ignore"):
        found = values.astype(np.int64)
        exact = (found == values) & (np.abs(values) < 2**53)
    if not exact.all():
        raise MeshFileError.of(f"{what} has a fraction where a whole number belongs: the file is damaged")
    return found


_MOST: Final = MOST_NODES
"""Nodes, and cells: the checks of as many tetrahedra take 15 s and 1.5 GB."""
_KINDS: Final = f"cells of one kind: {', '.join(CELL_KINDS)}"
_MOST_SHOWN = 4
"""Entities that one message lists; more are counted."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """The cells of a file, with its numbers for messages; its axes, in metres."""

    kind: CellKind
    node_numbers: IntArray
    points: FloatArray
    cell_numbers: IntArray
    cells: IntArray
    """Places of nodes in `points`, shape (cells, nodes of a cell)."""
    cell_names: tuple[tuple[str, BoolArray], ...]
    """Names that cells have, and which cells."""
    named: tuple[Elements, ...]
    """Facets with at least one name; their nodes are places in `points`."""
    lesser: tuple[str, ...]
    """Names of lines and points."""
    other_names: tuple[str, ...]
    """Names that nothing has."""

    @property
    def corners(self) -> IntArray:
        """Places of the corners of the cells."""
        return self.cells[:, : CORNERS[self.kind]]

    def node_labels(self, nodes: IntArray) -> str:
        """Some nodes with their numbers and places, for a message."""
        few = nodes.tolist()[:5]
        labels = [f"node {self.node_numbers[node]} at {_place(self.points[node])}" for node in few]
        return _shown(labels + [""] * (len(nodes) - len(few)))

    def cell_labels(self, cells: IntArray) -> str:
        """Some cells with their numbers and places."""
        few = cells.tolist()[:5]
        middles = [self.points[self.corners[cell]].mean(axis=0) for cell in few]
        labels = [f"cell {self.cell_numbers[c]} at {_place(m)}" for c, m in zip(few, middles, strict=True)]
        return _shown(labels + [""] * (len(cells) - len(few)))

    def facet_labels(self, facets: IntArray, numbers: IntArray | None = None) -> str:
        """Some facets, given as rows of places of their corners, with their own number or their nodes'."""
        few = facets[:5]
        middles = [self.points[row].mean(axis=0) for row in few]
        names = (
            [f"nodes {', '.join(map(str, self.node_numbers[row]))}" for row in few]
            if numbers is None
            else [f"element {number}" for number in numbers[:5]]
        )
        labels = [f"facet ({n}) at {_place(m)}" for n, m in zip(names, middles, strict=True)]
        return _shown(labels + [""] * (len(facets) - len(few)))

    @classmethod
    def of(cls, contents: Contents, *, scale: float) -> Body:
        """One body of what a file holds.

        Args: `scale`: metres in the file's unit.
        Raises: MeshFileError: its cells or nodes are such that nothing further can be looked at.
        """
        cells = [block for block in contents.blocks if dimension(block.kind) == 3]
        found = [*_wrong_kinds(contents, cells), *_wrong_nodes(contents)]
        if found:
            raise MeshFileError(found)
        order = np.argsort(contents.node_numbers, kind="stable")
        numbered = contents.node_numbers[order]
        lost = [each for block in contents.blocks if (each := _lost(block, numbered)) is not None]
        if lost:
            raise MeshFileError(lost)

        def placed(block: Elements) -> Elements:
            return replace(block, nodes=order[np.searchsorted(numbered, block.nodes)])

        facets = (placed(b) for b in contents.blocks if b.names and dimension(b.kind) == 2)
        lower = [b for b in contents.blocks if dimension(b.kind) < 2]
        return cls(
            kind=next(kind for kind in CELL_KINDS if kind == cells[0].kind),
            node_numbers=contents.node_numbers,
            points=contents.coordinates * scale,
            cell_numbers=np.concatenate([block.numbers for block in cells]),
            cells=np.concatenate([placed(block).nodes for block in cells]),
            cell_names=tuple(_cell_names(cells)),
            named=tuple(facets),
            lesser=tuple(dict.fromkeys(name for block in lower for name in block.names)),
            other_names=contents.other_names,
        )


def _place(point: FloatArray) -> str:
    """A place in mm, in the axes of the file."""
    return "(" + ", ".join(f"{1e3 * value:.4g}" for value in point) + ") mm"


def _wrong_kinds(contents: Contents, cells: Sequence[Elements]) -> Iterator[Finding]:
    count = sum(len(block.numbers) for block in cells)
    if max(count, len(contents.node_numbers)) > _MOST:
        problem = f"it has {len(contents.node_numbers)} nodes and {count} cells, more than can be checked"
        yield Finding(problem=problem, allowed=f"up to {_MOST} of each; a larger mesh size")
    if not count:
        flat = any(len(block.numbers) for block in contents.blocks)
        there = "only lines and surface elements" if flat else "no elements"
        yield Finding(problem=f"it has no cells, {there}: not a mesh of a volume", allowed=_KINDS)
        return
    kinds = dict.fromkeys(block.kind for block in cells if len(block.numbers))
    for kind in kinds:
        if kind not in CELL_KINDS:
            numbers = np.concatenate([block.numbers for block in cells if block.kind == kind])
            examples = _shown([f"cell {number}" for number in numbers.tolist()])
            yield Finding(problem=f"it has cells of the kind {kind}: {examples}", allowed=_KINDS)
    if len(kinds) > 1:
        counts = (
            f"{sum(len(b.numbers) for b in cells if b.kind == kind)} {kind}, the first of them cell "
            f"{next(b.numbers[0] for b in cells if b.kind == kind)}"
            for kind in kinds
        )
        yield Finding(problem=f"it mixes kinds of cells: {'; '.join(counts)}", allowed=_KINDS)


def _wrong_nodes(contents: Contents) -> Iterator[Finding]:
    numbers = contents.node_numbers
    ordered = np.sort(numbers)
    twice = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    if len(twice):
        labels = _shown([f"node {number}" for number in twice.tolist()])
        yield Finding(problem=f"it has more than one node of the same number: {labels}", allowed="")
    wrong = numbers[~np.isfinite(contents.coordinates).all(axis=1)]
    if len(wrong):
        labels = _shown([f"node {number}" for number in wrong.tolist()])
        yield Finding(problem=f"coordinates are no finite numbers: {labels}", allowed="")
    elif len(numbers) and np.abs(contents.coordinates).max() > 1e9:
        node = numbers[np.abs(contents.coordinates).max(axis=1).argmax()]
        yield Finding(problem=f"a coordinate is above 1e9: node {node}", allowed="")


def _lost(block: Elements, numbered: IntArray) -> Finding | None:
    """An error for elements whose nodes the file does not have."""
    if not len(numbered):
        raise MeshFileError.of("it has elements, but no nodes")
    at = np.minimum(np.searchsorted(numbered, block.nodes), len(numbered) - 1)
    missing = numbered[at] != block.nodes
    rows = np.flatnonzero(missing.any(axis=1))
    if not len(rows):
        return None
    labels = [
        f"{block.kind} {block.numbers[row]} has node {block.nodes[row][missing[row]][0]}" for row in rows
    ]
    return Finding(problem=f"elements have nodes that the file does not give: {_shown(labels)}", allowed="")


def _cell_names(cells: Sequence[Elements]) -> Iterator[tuple[str, BoolArray]]:
    sizes = [len(block.numbers) for block in cells]
    ends = np.cumsum(sizes)
    for name in dict.fromkeys(name for block in cells for name in block.names):
        mark = np.zeros(ends[-1], dtype=np.bool_)
        for block, end, size in zip(cells, ends.tolist(), sizes, strict=True):
            mark[end - size : end] = name in block.names
        yield name, mark


def _shown(labels: Sequence[str]) -> str:
    """A few labels, and the number of the others."""
    few = ", ".join(labels[:_MOST_SHOWN])
    more = len(labels) - _MOST_SHOWN
    return f"{few} and {more} more" if more > 0 else few
