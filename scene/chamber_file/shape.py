"""The shape of cells: orientation, volume, and whether a curved cell folds over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.chamber_file.assembly import Body
from ringbalance.scene.chamber_file.elements import CORNERS, between, reference_nodes, shape_gradients
from ringbalance.scene.rules.check import Finding

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
