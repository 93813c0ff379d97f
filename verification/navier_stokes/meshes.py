"""Curved, graded meshes for flow problems, put together from patches of structured nodes.

A patch is an array of nodes, shape (2 m + 1, 2 n + 1, 2): every second node is a vertex, the others are the
mid-nodes of a quadratic mesh and lie on the true geometry.  Patches that share nodes are glued.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from skfem import MeshQuad2

from ringbalance.scene.arrays import FloatArray, IntArray

# An irrational factor keeps dyadic coordinates away from the rounding boundaries of the gluing.
_GLUE = 0.7548776662e9


@dataclass(frozen=True, kw_only=True, eq=False)
class Patch:
    """Structured nodes and the names of those of its four sides that are boundaries."""

    nodes: FloatArray
    """Coordinates, shape (2 m + 1, 2 n + 1, 2)."""
    sides: Mapping[str, str] = field(default_factory=dict)
    """Boundary name by side: "west" i = 0, "east" i = 2 m, "south" j = 0, "north" j = 2 n."""

    @classmethod
    def ruled(
        cls,
        *,
        inner: FloatArray,
        outer: FloatArray,
        blend: FloatArray,
        sides: Mapping[str, str] | None = None,
    ) -> Patch:
        """Patch between two curves of nodes, at j = 0 and at j = 2 n, joined by straight lines.

        Args: `blend`: share of the way from inner to outer, shape (2 n + 1,), from 0 to 1.
        """
        share = blend[None, :, None]
        nodes = (1 - share) * inner[:, None, :] + share * outer[:, None, :]
        return cls(nodes=nodes, sides=sides or {})

    @classmethod
    def tensor(cls, *, x: FloatArray, y: FloatArray, sides: Mapping[str, str] | None = None) -> Patch:
        """Rectangular patch from nodes along its two directions, shapes (2 m + 1,) and (2 n + 1,)."""
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        return cls(nodes=grid, sides=sides or {})


def with_midpoints(*, vertices: npt.ArrayLike) -> FloatArray:
    """Nodes of quadratic cells on a line: the vertices with their midpoints between them."""
    v = np.asarray(vertices, dtype=np.float64)
    nodes = np.empty(2 * v.size - 1)
    nodes[::2] = v
    nodes[1::2] = (v[1:] + v[:-1]) / 2
    return nodes


def geometric_vertices(*, cells: int, ratio: float) -> FloatArray:
    """Vertices on [0, 1] whose cells grow by one factor; `ratio` is that of the last cell over the first."""
    growth = np.linspace(0.0, 1.0, cells) if cells > 1 else np.zeros(1)
    lengths = ratio**growth
    return np.asarray(np.concatenate(([0.0], np.cumsum(lengths))) / lengths.sum(), dtype=np.float64)


def _numbered(patches: Sequence[Patch]) -> tuple[FloatArray, list[IntArray]]:
    """Glued node coordinates (N, 2) and each patch's node numbers."""
    points = np.concatenate([patch.nodes.reshape(-1, 2) for patch in patches])
    extent = float(np.ptp(points, axis=0).max())
    keys = np.round((points - points.min(axis=0)) / extent * _GLUE).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    numbers = np.split(
        inverse.ravel(), np.cumsum([p.nodes.shape[0] * p.nodes.shape[1] for p in patches])[:-1]
    )
    shaped = [n.reshape(p.nodes.shape[:2]).astype(np.int64) for n, p in zip(numbers, patches, strict=True)]
    return points[first], shaped


def _quads(number: IntArray) -> IntArray:
    """Nine nodes per cell: four vertices, four mid-sides, the centre; shape (9, cells)."""
    a, b, c = slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)
    order = [(a, a), (c, a), (c, c), (a, c), (b, a), (c, b), (b, c), (a, b), (b, b)]
    return np.stack([number[i, j].ravel() for i, j in order])


def _side(number: IntArray, side: str) -> IntArray:
    chains = {"west": number[0], "east": number[-1], "south": number[:, 0], "north": number[:, -1]}
    return np.asarray(chains[side], dtype=np.int64)


def _named_facets(mesh: Any, nodes: FloatArray, patches: Sequence[Patch], numbers: list[IntArray]) -> Any:
    """Boundary facets by name: those whose two vertices lie on one named side of a patch."""
    where = {tuple(point): index for index, point in enumerate(mesh.doflocs.T[: mesh.nvertices])}
    facets = {tuple(sorted(pair)): index for index, pair in enumerate(mesh.facets.T.tolist())}
    named: dict[str, list[int]] = {}
    for patch, number in zip(patches, numbers, strict=True):
        for side, name in patch.sides.items():
            chain = [where[tuple(nodes[n])] for n in _side(number, side)[::2]]
            pairs = pairwise(chain)
            named.setdefault(name, []).extend(facets[(min(p), max(p))] for p in pairs)
    return {name: np.array(sorted(found)) for name, found in named.items()}


def patch_mesh(patches: Sequence[Patch]) -> Any:
    """Nine-node quadrilaterals of patches, glued where nodes coincide, with named boundaries."""
    nodes, numbers = _numbered(patches)
    mesh = MeshQuad2(np.ascontiguousarray(nodes.T), np.concatenate([_quads(n) for n in numbers], axis=1))
    return mesh.with_boundaries(_named_facets(mesh, nodes, patches, numbers))
