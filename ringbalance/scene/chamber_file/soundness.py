"""Soundness of a body of cells: their connections, the shape of each, and the names of boundaries.

The names in a file are compared facet by facet with those that a chamber needs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.body import Body, NamedFacets
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
from ringbalance.scene.chamber_file.record import KNOWN_NAMES, OUTER_WALL, VOLUME, WALLS
from ringbalance.scene.faults import closest, did_you_mean
from ringbalance.scene.kinds import Contradiction
from ringbalance.scene.toml import toml_text

_SAME_NODE_SHARE: Final = 1e-7
"""Distance over the extent of the body below which two nodes are meant to be one."""
_ON: Final = 1e-6
"""Distance from a facet over the facet's size below which a node lies on it."""
_MOST_NEAR_PAIRS: Final = 5_000_000
"""Most pairs of a facet and a node near it that are checked, the facets with the fewest first."""


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Sides of all cells; a facet between two cells counts twice."""

    nodes: IntArray
    """Nodes of each side in meshio's order, shape (sides, nodes of a facet)."""
    corners: int
    cells: IntArray
    """Cell of each side."""
    keys: IntArray
    """Key of each side, equal for sides with the same corners."""
    outer: IntArray
    """Sides that belong to one cell only."""
    shared: BoolArray
    """True for each side whose corners more than two cells share."""

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

    def findings(self, body: Body) -> Iterator[Contradiction]:
        """Errors in the connections of cells."""
        ordered = np.sort(body.cells, axis=1)
        twice = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
        yield from _about(body, "cells have a node twice", body.corners[twice], "cells with different nodes")
        again = body.corners[_same_rows(np.sort(body.corners, axis=1))]
        shared = np.flatnonzero(self.shared)
        shared = shared[np.unique(self.keys[shared], return_index=True)[1]]
        rows = self.nodes[shared, : self.corners]
        crowded = [
            *_about(body, "cells stand in the file twice", again, "each cell once"),
            *_about(body, "facets belong to more than two cells", rows, "at most two cells at a facet"),
        ]
        doubled = [*_doubled_nodes(body, self)]
        hanging = [] if doubled else [*_hanging_nodes(body, self)]
        parts = [*_several_volumes(body, self)]
        yield from (*crowded, *doubled, *hanging, *parts)
        if not (crowded or doubled or hanging or parts):
            # Edges at which the outer surface touches itself.
            edges = np.sort(edges_of(self.nodes[self.outer, : self.corners]).reshape(-1, 2), axis=1)
            different, counts = np.unique(edges, axis=0, return_counts=True)
            what = "the surface is open or touches itself along edges"
            allowed = "a closed surface, two facets at each edge"
            yield from _about(body, what, different[counts != 2], allowed)
        unused = np.setdiff1d(np.arange(len(body.points)), np.append(body.cells.ravel(), body.drawing))
        allowed = "nodes of cells only (export the named volume alone)"
        yield from _about(body, "nodes belong to no cell", unused, allowed)


def _about(body: Body, what: str, entities: IntArray, allowed: str) -> Iterator[Contradiction]:
    """One error about nodes, or about entities given as rows of nodes; none if there are no entities."""
    if len(entities):
        yield Contradiction(problem=f"{what} ({len(entities)}): {body.at(entities)}", allowed=allowed)


def _same_rows(rows: IntArray) -> IntArray:
    """Indices of rows that repeat an earlier one: rows are sorted by a number made of each."""
    weights = np.random.default_rng(0).integers(1, 2**62, size=rows.shape[1], dtype=np.int64)
    with np.errstate(over="ignore"):
        code = (rows * weights).sum(axis=1)
    order = np.argsort(code, kind="stable")
    same = (rows[order[1:]] == rows[order[:-1]]).all(axis=1)
    return np.asarray(order[1:][same], dtype=np.int64)


def _doubled_nodes(body: Body, facets: Facets) -> Iterator[Contradiction]:
    """Error about distinct nodes at one point: the body has a slit there."""
    nodes = np.unique(facets.nodes[facets.outer])
    points = body.points[nodes]
    step = _SAME_NODE_SHARE * (float(np.ptp(points, axis=0).max()) or 1.0)
    same = [_same_rows(np.floor(points / step + shift).astype(np.int64)) for shift in (0.0, 0.5)]
    twice = nodes[np.unique(np.concatenate(same))]
    allowed = "merged nodes (Gmsh: Coherence Mesh), so that cells meet"
    yield from _about(body, "nodes lie where another node lies already", twice, allowed)


def _hanging_nodes(body: Body, facets: Facets) -> Iterator[Contradiction]:
    """Error about nodes that lie on a facet without being its corner."""
    middles = np.unique(body.cells[:, CORNERS[body.kind] :])
    mixed = np.intersect1d(middles, body.corners)
    outer = facets.nodes[facets.outer, : facets.corners]
    triangles = outer if facets.corners == 3 else np.concatenate([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])
    owners = outer if facets.corners == 3 else np.concatenate([outer, outer])
    wrong = np.union1d(mixed, _on_triangles(body.points, triangles, owners))
    what = "nodes hang, on a facet or an edge of which they are no corner"
    yield from _about(body, what, wrong, "cells that meet at whole facets")


def _on_triangles(points: FloatArray, triangles: IntArray, owners: IntArray) -> IntArray:
    """Nodes that lie on triangles, but at none of their corners."""
    nodes = np.unique(triangles)
    if not len(nodes):
        return nodes
    corners = points[triangles]
    middles = corners.mean(axis=1)
    radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    tree = cKDTree(points[nodes])
    counts = tree.query_ball_point(middles, radii, return_length=True)
    order = np.argsort(counts, kind="stable")
    near = order[np.cumsum(counts[order]) <= _MOST_NEAR_PAIRS]
    lists = tree.query_ball_point(middles[near], radii[near])
    which = np.repeat(near, [len(each) for each in lists])
    candidates = nodes[np.fromiter((node for each in lists for node in each), dtype=np.int64)]
    foreign = (owners[which] != candidates[:, None]).all(axis=1)
    which, candidates = which[foreign], candidates[foreign]
    first, second, third = corners[which].transpose(1, 0, 2)
    # Barycentric coordinates of each candidate, and its height over the plane.
    node, side, other = points[candidates] - first, second - first, third - first
    normal = np.cross(side, other)
    area = np.maximum((normal**2).sum(axis=1), 1e-300)
    height = np.abs((node * normal).sum(axis=1)) / np.sqrt(area)
    at_second = (np.cross(node, other) * normal).sum(axis=1) / area
    at_third = (np.cross(side, node) * normal).sum(axis=1) / area
    shares = np.column_stack([1 - at_second - at_third, at_second, at_third])
    flat = height < _ON * np.sqrt(np.sqrt(area))
    return np.unique(candidates[flat & (shares > -_ON).all(axis=1) & (shares < 1 - _ON).all(axis=1)])


def _several_volumes(body: Body, facets: Facets) -> Iterator[Contradiction]:
    order = np.argsort(facets.keys, kind="stable")
    meet = np.flatnonzero(facets.keys[order[1:]] == facets.keys[order[:-1]])
    cell, neighbour = facets.cells[order[meet]], facets.cells[order[meet + 1]]
    graph = coo_array((np.ones(len(cell)), (cell, neighbour)), shape=(len(body.cells), len(body.cells)))
    count, part = connected_components(graph, directed=False)
    if count > 1:
        _, first = np.unique(part, return_index=True)
        problem = f"it falls into {count} separate volumes, which begin {body.at(body.corners[first])}"
        yield Contradiction(problem=problem, allowed="one chamber, whose cells meet at facets")


_CELLS_AT_ONCE: Final = 4096
"""Number of cells whose Jacobians are in memory at one time."""
_FLAT: Final = 1e-9
"""Jacobian over the cube of the longest diagonal below which rounding exceeds a cell's volume."""


def oriented(body: Body) -> tuple[Body, tuple[Contradiction, ...]]:
    """The body with positive cells, and errors about cells that are inverted, folded or flat.

    A body with only negative cells was written in the opposite orientation, and is converted.
    """
    lowest, highest, size = _jacobians(body)
    flat = np.maximum(np.abs(lowest), np.abs(highest)) < _FLAT * size**3
    if not flat.all() and (highest[~flat] <= 0).all():
        body = replace(body, cells=body.cells[:, _mirrored(body.kind)])
        lowest, highest = -highest, -lowest
    inverted = ~flat & (highest <= 0)
    folded = ~flat & (lowest <= _FLAT * size**3) & (highest > 0)
    return body, tuple(_misshapen(body, flat=flat, inverted=inverted, folded=folded))


def _jacobians(body: Body) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lowest and highest Jacobian of each cell, m^3, and its longest extent, m."""
    gradients = shape_gradients(body.kind)
    places, nodes, _ = gradients.shape
    slopes = gradients.transpose(1, 0, 2).reshape(nodes, places * 3)
    extremes = np.empty((3, len(body.cells)))
    for start in range(0, len(body.cells), _CELLS_AT_ONCE):
        part = slice(start, start + _CELLS_AT_ONCE)
        at = body.points[body.cells[part]].transpose(0, 2, 1)
        derivatives = (at @ slopes).reshape(len(at), 3, places, 3)
        d_first, d_second, d_third = (derivatives[..., axis].transpose(1, 0, 2) for axis in range(3))
        volume = (
            d_first[0] * (d_second[1] * d_third[2] - d_second[2] * d_third[1])
            + d_first[1] * (d_second[2] * d_third[0] - d_second[0] * d_third[2])
            + d_first[2] * (d_second[0] * d_third[1] - d_second[1] * d_third[0])
        )
        extremes[:, part] = volume.min(axis=1), volume.max(axis=1), np.ptp(at, axis=2).max(axis=1)
    return extremes[0], extremes[1], extremes[2]


def _misshapen(
    body: Body, *, flat: BoolArray, inverted: BoolArray, folded: BoolArray
) -> Iterator[Contradiction]:
    yield from _about(
        body,
        "cells are degenerate, without volume",
        body.corners[flat],
        "cells whose corners do not lie in one plane",
    )
    # If most cells have a negative Jacobian, the others may be the wrong ones.
    fewer = np.count_nonzero(inverted) <= len(inverted) / 2
    word = "are inverted" if fewer else "have another orientation than the others"
    allowed = "cells that all have the same orientation"
    yield from _about(body, f"cells {word}", body.corners[inverted], allowed)
    corners = between(body.kind)
    for each in _about(body, "cells fold over", body.corners[folded], "a positive Jacobian everywhere"):
        hint = ""
        if len(corners) > CORNERS[body.kind]:
            nodes = body.cells[np.flatnonzero(folded)[0]]
            points = body.points[nodes]
            straight = np.array([points[list(ends)].mean(axis=0) for ends in corners])
            farthest = nodes[[np.linalg.norm(points - straight, axis=1).argmax()]]
            hint = f"; farthest from the middle of its side is the node {body.at(farthest)}"
        yield replace(each, problem=each.problem + hint)


@cache
def _mirrored(kind: str) -> IntArray:
    """The order in which a cell's nodes make the cell of opposite orientation."""
    nodes = reference_nodes(kind).round(3).tolist()
    return np.array([nodes.index([y, x, z]) for x, y, z in nodes], dtype=np.int64)


def boundaries_of(body: Body, facets: Facets) -> tuple[dict[str, IntArray], tuple[Contradiction, ...]]:
    """Facets of a body by name, with the node order of their cells, and errors of the names."""
    wrong = [*_volume_names(body), *_missing(body)]
    sides = facets.outer[np.argsort(facets.keys[facets.outer], kind="stable")]
    held = np.zeros((len(KNOWN_NAMES), len(sides)), dtype=np.bool_)
    for each in body.named:
        at, real = _places(body, facets, each, facets.keys[sides])
        # Named elements that are not on the outer surface: between two cells, or of no cell.
        _, side = _places(body, facets, each, np.sort(facets.keys))
        for strange, what in ((side & ~real, "lie between two cells"), (~side, "are no side of any cell")):
            what = f"facets named {toml_text(each.name)} {what}"
            wrong += _about(body, what, each.corners[strange], "facets of the chamber's surface")
        nodes, nodes_of_cell = each.nodes[real], facets.nodes[sides[at[real]]]
        if nodes_of_cell.shape[1] == nodes.shape[1]:
            other = (np.sort(nodes_of_cell, axis=1) != np.sort(nodes, axis=1)).any(axis=1)
            what = "named facets have other mid-side nodes than their cells"
            wrong += _about(body, what, nodes[other], "facets and cells with the same nodes")
        if each.name in KNOWN_NAMES:
            held[KNOWN_NAMES.index(each.name), at[real]] = True
    for each in (named for named in body.named if named.name not in KNOWN_NAMES):
        # Facets with an unknown name and without a known one.
        at, real = _places(body, facets, each, facets.keys[sides])
        alone = ~(real & held[:, at].any(axis=0))
        what = f"facets have the unknown name {toml_text(each.name)}{did_you_mean(each.name, KNOWN_NAMES)}"
        wrong += _about(body, what, each.corners[alone], ", ".join(KNOWN_NAMES))
    several = held.sum(axis=0) > 1
    if several.any():
        both = [KNOWN_NAMES[index] for index in np.flatnonzero(held[:, several][:, 0])]
        what = f"facets have two names, {' and '.join(map(toml_text, both))}"
        wrong += _about(body, what, facets.nodes[sides[several], : facets.corners], "one name for each facet")
    held[KNOWN_NAMES.index(WALLS)] |= ~held.any(axis=0)
    marked = {name: facets.nodes[sides[inside]] for name, inside in zip(KNOWN_NAMES, held, strict=True)}
    return {name: each for name, each in marked.items() if len(each)}, tuple(wrong)


def _places(body: Body, facets: Facets, named: NamedFacets, keys: IntArray) -> tuple[IntArray, BoolArray]:
    """Indices of named facets among sorted keys, and which facets have one."""
    corners = named.corners
    wanted = key_of(corners, len(body.points))
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return at, (keys[at] == wanted) & (corners.shape[1] == facets.corners)


def _volume_names(body: Body) -> Iterator[Contradiction]:
    """Error unless all cells belong to the volume or none is named; a single group of cells is the volume."""
    groups = dict(body.cell_names)
    volume = next(iter(groups)) if len(groups) == 1 else VOLUME
    inside = groups.get(volume, np.zeros(len(body.cells), dtype=np.bool_))
    for name, cells in groups.items():
        what = f"cells of the volume {toml_text(name)} are not the chamber{did_you_mean(name, [VOLUME])}"
        allowed = f'the name "{VOLUME}", or one named volume'
        if name != volume:
            yield from _about(body, what, body.corners[cells & ~inside], allowed)
    if len(groups) == 1:
        what = f"cells do not belong to the volume {toml_text(volume)}"
        yield from _about(body, what, body.corners[~inside], f"every cell in {toml_text(volume)}")


def _missing(body: Body) -> Iterator[Contradiction]:
    """An error where no facet is the outer wall, with the names that the file does have."""
    names = dict.fromkeys(each.name for each in body.named)
    if any(closest(name, KNOWN_NAMES) == OUTER_WALL for name in names):
        return
    volumes = [name for name, _ in body.cell_names]
    if OUTER_WALL in (*body.lesser, *volumes):
        what = "lines or points" if OUTER_WALL in body.lesser else "cells"
        yield Contradiction(
            problem=f'"{OUTER_WALL}" names {what}, not facets', allowed="a name of surface elements"
        )
        return
    all_names = dict.fromkeys([*names, *volumes, *body.lesser, *body.other_names])
    listed = ", ".join(map(toml_text, all_names)) or "none"
    problem = f'no facets have the name "{OUTER_WALL}"; names in the file: {listed[:300]}'
    yield Contradiction(problem=problem, allowed=f'a named boundary "{OUTER_WALL}" (Gmsh: Physical Surface)')
