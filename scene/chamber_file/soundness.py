"""Whether a body of cells is sound: how they hang together, the shape of each, and names of boundaries.

What a file has as names is compared with what a chamber needs, facet by facet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.contents import Body, Elements
from ringbalance.scene.chamber_file.elements import (
    CORNERS,
    between,
    corners_of,
    edges_of,
    key_of,
    reference_nodes,
    repeats,
    shape_gradients,
    sides_of,
)
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.faults import closest, did_you_mean
from ringbalance.scene.kinds import Finding
from ringbalance.scene.toml import toml_text

_SAME: Final = 1e-7
"""Distance, as a share of the body, below which two nodes are meant to be one."""
_ON: Final = 1e-6
"""Distance from a facet, as a share of its size, below which a node lies on it."""
_MOST_NEAR: Final = 5_000_000
"""Pairs of facets and nodes near them that are looked at, the facets with the fewest first."""


@dataclass(frozen=True, kw_only=True)
class Facets:
    """All sides of all cells; two cells that meet have one each."""

    nodes: IntArray
    """Shape (sides, nodes of a facet), in meshio's order."""
    corners: int
    cells: IntArray
    """Cell of each side."""
    keys: IntArray
    """Equal for sides with the same corners."""
    outer: IntArray
    """Sides that no other cell has."""
    shared: BoolArray
    """Keys in rising order that more than two cells have."""

    @classmethod
    def of(cls, body: Body) -> Facets:
        """The sides of all cells of a body."""
        nodes, corners = sides_of(body.cells, body.kind), corners_of(body.kind)
        keys = key_of(nodes[:, :corners], len(body.points))
        counts = repeats(keys)
        return cls(
            nodes=nodes,
            corners=corners,
            cells=np.repeat(np.arange(len(body.cells)), len(nodes) // len(body.cells)),
            keys=keys,
            outer=np.flatnonzero(counts == 1),
            shared=counts > 2,
        )

    def findings(self, body: Body, *, drawing_nodes: IntArray) -> Iterator[Finding]:
        """What is wrong with how cells hang together.

        Args: `drawing_nodes`: numbers of nodes of the drawing.
        """
        yield from _repeated(body)
        crowded = [*_same_cells(body), *_crowded_facets(body, self)]
        yield from crowded
        doubled = [*_doubled_nodes(body, self)]
        hanging = [] if doubled else [*_hanging_nodes(body, self)]
        yield from (*doubled, *hanging)
        parts = [*_several_volumes(body, self)]
        yield from parts
        if not (crowded or doubled or hanging or parts):
            yield from _pinched(body, self)
        yield from _unused(body, drawing_nodes)


def _repeated(body: Body) -> Iterator[Finding]:
    ordered = np.sort(body.cells, axis=1)
    wrong = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(wrong):
        problem = f"cells have a node twice ({len(wrong)}): {body.cell_labels(wrong)}"
        yield Finding(problem=problem, allowed="cells with different nodes")


def _same_rows(rows: IntArray) -> IntArray:
    """Places of rows that stand before, in any order of rows: sorted by a number made of each."""
    weights = np.random.default_rng(0).integers(1, 2**62, size=rows.shape[1], dtype=np.int64)
    with np.errstate(over="ignore"):
        code = (rows * weights).sum(axis=1)
    order = np.argsort(code, kind="stable")
    same = (rows[order[1:]] == rows[order[:-1]]).all(axis=1)
    return np.asarray(order[1:][same], dtype=np.int64)


def _same_cells(body: Body) -> Iterator[Finding]:
    wrong = _same_rows(np.sort(body.corners, axis=1))
    if len(wrong):
        problem = f"cells stand in the file twice ({len(wrong)}): {body.cell_labels(wrong)}"
        yield Finding(problem=problem, allowed="each cell once")


def _crowded_facets(body: Body, facets: Facets) -> Iterator[Finding]:
    wrong = np.flatnonzero(facets.shared)
    _, first = np.unique(facets.keys[wrong], return_index=True)
    if len(first):
        labels = body.facet_labels(facets.nodes[wrong[first], : facets.corners])
        problem = f"facets belong to more than two cells ({len(first)}): {labels}"
        yield Finding(problem=problem, allowed="at most two cells at a facet")


def _doubled_nodes(body: Body, facets: Facets) -> Iterator[Finding]:
    """Nodes at one place that are not the same node: the body has a slit there."""
    nodes = np.unique(facets.nodes[facets.outer])
    points = body.points[nodes]
    step = _SAME * (float(np.ptp(points, axis=0).max()) or 1.0)
    found = [_same_rows(np.floor(points / step + shift).astype(np.int64)) for shift in (0.0, 0.5)]
    twice = nodes[np.unique(np.concatenate(found))]
    if len(twice):
        problem = f"nodes lie where another node lies already ({len(twice)}): {body.node_labels(twice)}"
        yield Finding(problem=problem, allowed="merged nodes (Gmsh: Coherence Mesh), so that cells meet")


def _hanging_nodes(body: Body, facets: Facets) -> Iterator[Finding]:
    """Nodes that lie on a facet of which they are no corner."""
    middles = np.setdiff1d(np.unique(body.cells[:, CORNERS[body.kind] :]), [])
    mixed = np.intersect1d(middles, body.corners)
    outer = facets.nodes[facets.outer, : facets.corners]
    triangles = outer if facets.corners == 3 else np.concatenate([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])
    owners = outer if facets.corners == 3 else np.concatenate([outer, outer])
    wrong = np.union1d(mixed, _on_triangles(body.points, triangles, owners))
    if len(wrong):
        problem = f"nodes hang, on a facet or an edge of which they are no corner ({len(wrong)}): "
        yield Finding(problem=problem + body.node_labels(wrong), allowed="cells that meet at whole facets")


def _on_triangles(points: FloatArray, triangles: IntArray, owners: IntArray) -> IntArray:
    nodes = np.unique(triangles)
    if not len(nodes):
        return nodes
    corners = points[triangles]
    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    tree = cKDTree(points[nodes])
    counts = tree.query_ball_point(middles, radii, return_length=True)
    order = np.argsort(counts, kind="stable")
    near = order[np.cumsum(counts[order]) <= _MOST_NEAR]
    lists = tree.query_ball_point(middles[near], radii[near])
    which = np.repeat(near, [len(each) for each in lists])
    candidates = nodes[np.fromiter((node for each in lists for node in each), dtype=np.int64)]
    foreign = (owners[which] != candidates[:, None]).all(axis=1)
    which, candidates = which[foreign], candidates[foreign]
    first, one, two = corners[which].transpose(1, 0, 2)
    inside = _inside(points[candidates] - first, one - first, two - first)
    return np.unique(candidates[inside])


def _inside(at: FloatArray, one: FloatArray, two: FloatArray) -> BoolArray:
    """Whether places, seen from a corner, lie on the triangles of two sides, away from their corners."""
    normal = np.cross(one, two)
    area = np.maximum((normal**2).sum(axis=1), 1e-300)
    height = np.abs((at * normal).sum(axis=1)) / np.sqrt(area)
    share_one = (np.cross(at, two) * normal).sum(axis=1) / area
    share_two = (np.cross(one, at) * normal).sum(axis=1) / area
    shares = np.column_stack([1 - share_one - share_two, share_one, share_two])
    flat = height < _ON * np.sqrt(np.sqrt(area))
    return np.asarray(flat & (shares > -_ON).all(axis=1) & (shares < 1 - _ON).all(axis=1), dtype=np.bool_)


def _several_volumes(body: Body, facets: Facets) -> Iterator[Finding]:
    order = np.argsort(facets.keys, kind="stable")
    meet = np.flatnonzero(facets.keys[order[1:]] == facets.keys[order[:-1]])
    one, two = facets.cells[order[meet]], facets.cells[order[meet + 1]]
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(len(body.cells), len(body.cells)))
    count, part = connected_components(graph, directed=False)
    if count > 1:
        _, first = np.unique(part, return_index=True)
        problem = f"it falls into {count} separate volumes, which begin with {body.cell_labels(first)}"
        yield Finding(problem=problem, allowed="one chamber, whose cells meet at facets")


def _pinched(body: Body, facets: Facets) -> Iterator[Finding]:
    """Edges at which the outer surface meets itself."""
    outer = facets.nodes[facets.outer, : facets.corners]
    edges = np.sort(edges_of(outer).reshape(-1, 2), axis=1)
    _, first, counts = np.unique(
        edges[:, 0] * len(body.points) + edges[:, 1], return_index=True, return_counts=True
    )
    wrong = edges[first[counts != 2]]
    if len(wrong):
        problem = f"the surface is open or touches itself along edges ({len(wrong)}): "
        labels = body.facet_labels(wrong).replace("facet", "edge")
        yield Finding(problem=problem + labels, allowed="a closed surface, two facets at each edge")


def _unused(body: Body, drawing_nodes: IntArray) -> Iterator[Finding]:
    used = np.zeros(len(body.points), dtype=np.bool_)
    used[body.cells] = True
    wrong = np.flatnonzero(~used & ~np.isin(body.node_numbers, drawing_nodes))
    if len(wrong):
        problem = f"nodes belong to no cell ({len(wrong)}): {body.node_labels(wrong)}"
        yield Finding(problem=problem, allowed="nodes of cells only (export the named volume alone)")


_AT_ONCE: Final = 4096
"""Cells whose Jacobians are held at one time."""
_FLAT: Final = 1e-9
"""Jacobian over the cube of the longest diagonal below which a cell has no volume that rounding leaves."""


def oriented(body: Body) -> tuple[Body, tuple[Finding, ...]]:
    """The body with positive cells, and cells that are inverted, folded or flat.

    A body whose every cell is negative was written in the other orientation, and is turned round.
    """
    lowest, highest, size = _jacobians(body)
    flat = np.maximum(np.abs(lowest), np.abs(highest)) < _FLAT * size**3
    if not flat.all() and (highest[~flat] <= 0).all():
        body = replace(body, cells=body.cells[:, _mirrored(body.kind)])
        lowest, highest = -highest, -lowest
    inverted = ~flat & (highest <= 0)
    folded = ~flat & (lowest <= _FLAT * size**3) & (highest > 0)
    return body, (*_flat(body, np.flatnonzero(flat)), *_inverted(body, inverted), *_folded(body, folded))


def _jacobians(body: Body) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lowest and highest Jacobian of each cell, m^3, and its longest extent, m."""
    gradients = shape_gradients(body.kind)
    places, nodes, _ = gradients.shape
    slopes = gradients.transpose(1, 0, 2).reshape(nodes, places * 3)
    found = np.empty((3, len(body.cells)))
    for start in range(0, len(body.cells), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        at = body.points[body.cells[part]].transpose(0, 2, 1)
        along = (at @ slopes).reshape(len(at), 3, places, 3)
        one, two, three = (along[..., axis].transpose(1, 0, 2) for axis in range(3))
        volume = (
            one[0] * (two[1] * three[2] - two[2] * three[1])
            + one[1] * (two[2] * three[0] - two[0] * three[2])
            + one[2] * (two[0] * three[1] - two[1] * three[0])
        )
        found[:, part] = volume.min(axis=1), volume.max(axis=1), np.ptp(at, axis=2).max(axis=1)
    return found[0], found[1], found[2]


def _flat(body: Body, cells: IntArray) -> Iterator[Finding]:
    if len(cells):
        problem = f"cells are degenerate, without volume ({len(cells)}): {body.cell_labels(cells)}"
        yield Finding(problem=problem, allowed="cells whose corners do not lie in one plane")


def _inverted(body: Body, mark: BoolArray) -> Iterator[Finding]:
    """Cells of negative Jacobian; where they are most, the others may be the wrong ones."""
    cells = np.flatnonzero(mark)
    if len(cells):
        rest = len(mark) - len(cells)
        word = "are inverted" if len(cells) <= rest else "have another orientation than the others"
        problem = f"cells {word} ({len(cells)} of {len(mark)}): {body.cell_labels(cells)}"
        yield Finding(problem=problem, allowed="cells that all have the same orientation")


def _folded(body: Body, mark: BoolArray) -> Iterator[Finding]:
    cells = np.flatnonzero(mark)
    if not len(cells):
        return
    problem = f"cells fold over ({len(cells)}): {body.cell_labels(cells)}"
    if len(between(body.kind)) > CORNERS[body.kind]:
        node = _farthest_middle(body, int(cells[0]))
        problem += f"; farthest from the middle of its side is {body.node_labels(np.array([node]))}"
    yield Finding(problem=problem, allowed="cells with a positive Jacobian everywhere")


def _farthest_middle(body: Body, cell: int) -> int:
    """The mid-side node of a cell that is farthest from where a straight cell would have it."""
    points = body.points[body.cells[cell]]
    straight = np.array([points[list(corners)].mean(axis=0) for corners in between(body.kind)])
    return int(body.cells[cell][np.linalg.norm(points - straight, axis=1).argmax()])


@cache
def _mirrored(kind: str) -> IntArray:
    """The order in which a cell's nodes make the cell of opposite orientation."""
    nodes = reference_nodes(kind).round(3).tolist()
    return np.array([nodes.index([y, x, z]) for x, y, z in nodes], dtype=np.int64)


PORT: Final = "port"
_WALLS: Final = "walls"
_VOLUME: Final = "chamber"
MEANINGS: Final[Mapping[str, str]] = MappingProxyType(
    {
        OUTER_WALL: "farthest from the shaft, where the liquid lies; needed",
        "inner_wall": "nearest to the shaft",
        "plate_left": "radial plate at the higher angle about the shaft",
        "plate_right": "radial plate at the lower angle",
        "end_back": "end wall at the lower coordinate along the shaft",
        "end_front": "end wall at the higher coordinate along the shaft",
        "gas_tube": "outside of a tube or a pin inside the chamber",
        "gas_hole": "mouth of the gas line, or of a gas tube",
        PORT: "opening of the connecting tube; without `port_radius` its mean radius is used",
        _WALLS: "any other wall; facets without a name count as this",
    }
)
KNOWN_NAMES: Final = tuple(MEANINGS)


def boundaries_of(body: Body, facets: Facets) -> tuple[dict[str, IntArray], tuple[Finding, ...]]:
    """Facets of a body by name, each as its cell has them, and what is wrong with the names."""
    found = [*_volume_names(body), *_unknown(body), *_missing(body)]
    sides = facets.outer[np.argsort(facets.keys[facets.outer], kind="stable")]
    held = np.zeros((len(KNOWN_NAMES), len(sides)), dtype=np.bool_)
    for block in body.named:
        at, real = _places(body, facets, block, facets.keys[sides])
        found += _no_facets(body, facets, block, real)
        found += _other_middles(body, facets.nodes[sides[at[real]]], block, real)
        for name in set(block.names) & set(KNOWN_NAMES):
            held[KNOWN_NAMES.index(name), at[real]] = True
    found += _named_twice(body, facets.nodes[sides, : facets.corners], held)
    held[KNOWN_NAMES.index(_WALLS)] |= ~held.any(axis=0)
    marked = {name: facets.nodes[sides[inside]] for name, inside in zip(KNOWN_NAMES, held, strict=True)}
    return {name: each for name, each in marked.items() if len(each)}, tuple(found)


def _places(body: Body, facets: Facets, block: Elements, keys: IntArray) -> tuple[IntArray, BoolArray]:
    """Where the facets of a block stand among sorted keys, and which of them do."""
    wanted = key_of(block.nodes[:, : CORNERS[block.kind]], len(body.points))
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return at, (keys[at] == wanted) & (CORNERS[block.kind] == facets.corners)


def _volume_names(body: Body) -> Iterator[Finding]:
    """All cells have the name of the volume, or none has a name."""
    for name, cells in body.cell_names:
        if name != _VOLUME:
            hint = did_you_mean(name, [_VOLUME])
            problem = f"the cells of the volume {toml_text(name)} are not the chamber{hint}: "
            labels = body.cell_labels(np.flatnonzero(cells))
            yield Finding(problem=problem + labels, allowed=f'the name "{_VOLUME}", or no named volume')
    marks = [cells for name, cells in body.cell_names if name == _VOLUME]
    if marks and not marks[0].all() and len(body.cell_names) == 1:
        problem = (
            f'cells do not belong to the volume "{_VOLUME}": {body.cell_labels(np.flatnonzero(~marks[0]))}'
        )
        yield Finding(problem=problem, allowed=f'every cell in "{_VOLUME}"')


def _unknown(body: Body) -> Iterator[Finding]:
    for name in dict.fromkeys(name for block in body.named for name in block.names):
        if name in KNOWN_NAMES:
            continue
        blocks = [block for block in body.named if name in block.names]
        corners = blocks[0].nodes[:, : CORNERS[blocks[0].kind]]
        labels = body.facet_labels(corners, blocks[0].numbers)
        problem = f"unknown name of a boundary, {toml_text(name)}{did_you_mean(name, KNOWN_NAMES)}: {labels}"
        yield Finding(problem=problem, allowed=", ".join(KNOWN_NAMES))


def _missing(body: Body) -> Iterator[Finding]:
    """An error where no facet is the outer wall, with the names that the file does have."""
    names = dict.fromkeys(name for block in body.named for name in block.names)
    if any(closest(name, KNOWN_NAMES) == OUTER_WALL for name in names):
        return
    volumes = [name for name, _ in body.cell_names]
    if OUTER_WALL in (*body.lesser, *volumes):
        what = "lines or points" if OUTER_WALL in body.lesser else "cells"
        yield Finding(
            problem=f'"{OUTER_WALL}" names {what}, not facets', allowed="a name of surface elements"
        )
        return
    there = [*names, *volumes, *body.lesser, *body.other_names]
    listed = ", ".join(toml_text(name) for name in dict.fromkeys(there)) or "none"
    problem = f'no facets have the name "{OUTER_WALL}"; names in the file: {listed[:300]}'
    yield Finding(problem=problem, allowed=f'a named boundary "{OUTER_WALL}" (Gmsh: Physical Surface)')


def _no_facets(body: Body, facets: Facets, block: Elements, real: BoolArray) -> Iterator[Finding]:
    """Named elements that are no outer facet: between two cells, or of no cell."""
    every = np.sort(facets.keys)
    _, side = _places(body, facets, block, every)
    names = " and ".join(toml_text(name) for name in block.names)
    for wrong, what in ((side & ~real, "lie between two cells"), (~side, "are no side of any cell")):
        if wrong.any():
            corners = block.nodes[wrong, : CORNERS[block.kind]]
            labels = body.facet_labels(corners, block.numbers[wrong])
            problem = f"facets named {names} {what} ({len(corners)}): {labels}"
            yield Finding(problem=problem, allowed="facets of the chamber's surface")


def _other_middles(body: Body, cell: IntArray, block: Elements, real: BoolArray) -> Iterator[Finding]:
    """Facets of second order whose mid-side nodes are not those of their cell."""
    if cell.shape[1] != block.nodes.shape[1]:
        return
    nodes = block.nodes[real]
    wrong = (np.sort(cell, axis=1) != np.sort(nodes, axis=1)).any(axis=1)
    if wrong.any():
        corners = nodes[wrong, : CORNERS[block.kind]]
        labels = body.facet_labels(corners, block.numbers[real][wrong])
        problem = f"named facets have other mid-side nodes than their cells ({len(corners)}): {labels}"
        yield Finding(problem=problem, allowed="facets and cells with the same nodes")


def _named_twice(body: Body, corners: IntArray, held: BoolArray) -> Iterator[Finding]:
    wrong = held.sum(axis=0) > 1
    if wrong.any():
        both = held[:, np.flatnonzero(wrong)[0]]
        names = " and ".join(toml_text(KNOWN_NAMES[place]) for place in np.flatnonzero(both))
        problem = f"facets have two names, {names} ({wrong.sum()}): {body.facet_labels(corners[wrong])}"
        yield Finding(problem=problem, allowed="one name for each facet")
