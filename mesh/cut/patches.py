"""The walls of an imported chamber as polynomial patches, each X(u, v) = sum c_ij u^i v^j, i and j up to 2.

Facets of all kinds are of that form: bilinear and serendipity quadrilaterals as they are, triangles with
their corner 2 drawn out to the side v = 1, xi = u (1 - v), eta = v.
"""

from __future__ import annotations

from functools import cache
from math import comb
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.chamber_file.elements import boundary_facets, corners_of, key_of
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry

Powers = tuple[tuple[int, int], ...]
_QUAD: Final[Powers] = ((0, 0), (1, 0), (1, 1), (0, 1))
_SERENDIPITY: Final[Powers] = (*_QUAD, (2, 0), (0, 2), (2, 1), (1, 2))
_TRIANGLE: Final[Powers] = ((0, 0), (1, 0), (0, 1))
_SHAPES: Final[dict[int, tuple[Powers, Powers]]] = {
    3: (_TRIANGLE, ((0, 0), (2, 0), (0, 2))),
    6: (((*_TRIANGLE, (2, 0), (1, 1), (0, 2))), ((0, 0), (2, 0), (0, 2), (1, 0), (1, 1), (0, 1))),
    4: (_QUAD, ((0, 0), (2, 0), (2, 2), (0, 2))),
    8: (_SERENDIPITY, ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))),
    9: (
        (*_SERENDIPITY, (2, 2)),
        ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)),
    ),
}
"""Monomials, and places of the nodes in halves, by the number of nodes."""


@cache
def _coefficients(nodes: int) -> FloatArray:
    """From the places of a facet's nodes to c_ij, shape (9, nodes)."""
    monomials, places = _SHAPES[nodes]
    xi, eta = (np.array(p) / 2 for p in zip(*places, strict=True))
    local = np.linalg.inv(np.stack([xi**i * eta**j for i, j in monomials], axis=1))
    spread = np.zeros((3, 3, nodes))
    for (i, j), row in zip(monomials, local, strict=True):
        if nodes in (3, 6):  # u^i (1 - v)^i v^j
            for k in range(i + 1):
                spread[i, j + k] += comb(i, k) * (-1) ** k * row
        else:
            spread[i, j] += row
    return spread.reshape(9, nodes)


def wall_patches(geometry: ChamberGeometry) -> tuple[FloatArray, BoolArray]:
    """All walls of a chamber, X_u x X_v outward.

    Returns: c, m, shape (patches, 3, 3, 3) by power of u, of v, and axis; whether it is of the outer wall.
    """
    facets = boundary_facets(geometry)
    patches = _coefficients(facets.shape[1]) @ geometry.points[facets]
    corners, nodes = corners_of(geometry.kind), len(geometry.points)
    outer = key_of(geometry.boundaries[OUTER_WALL][:, :corners], nodes)
    return patches.reshape(-1, 3, 3, 3), np.isin(key_of(facets[:, :corners], nodes), outer)


@cache
def to_bernstein(degree: int) -> FloatArray:
    """From powers to Bernstein coefficients, by which a polynomial is bounded on [0, 1]."""
    size = degree + 1
    return np.array([[comb(j, i) / comb(degree, i) for i in range(size)] for j in range(size)])


@cache
def _half_maps(degree: int) -> tuple[FloatArray, ...]:
    """On powers: of the two halves of [0, 1]."""
    to = to_bernstein(degree)
    low = np.array([[comb(j, i) / 2**j for i in range(degree + 1)] for j in range(degree + 1)])
    return tuple(np.asarray(np.linalg.solve(to, half @ to)) for half in (low, low[::-1, ::-1]))


@cache
def mirror(degree: int) -> FloatArray:
    """On powers: from u to 1 - u."""
    to = to_bernstein(degree)
    return np.asarray(np.linalg.solve(to, to[::-1]))


def halved(values: FloatArray, *, across: BoolArray) -> FloatArray:
    """The polynomials sum c_ij u^i v^j on both halves of the unit square, shape (2 n, ...).

    Args: `across`: whether it is cut at v = 1/2 and not at u = 1/2, shape (n,).
    """
    turned = np.where(across.reshape(-1, *[1] * (values.ndim - 1)), values.swapaxes(1, 2), values)
    parts = [np.einsum("ai,ni...->na...", half, turned) for half in _half_maps(values.shape[1] - 1)]
    return np.concatenate(
        [np.where(across.reshape(-1, *[1] * (values.ndim - 1)), p.swapaxes(1, 2), p) for p in parts]
    )


def split_patches(patches: FloatArray, flags: BoolArray, *, longest: float) -> tuple[FloatArray, BoolArray]:
    """Patches halved until none is longer across the shaft than a share of its distance from it."""
    done: list[tuple[FloatArray, BoolArray]] = []
    for _ in range(_SPLITS):
        control = np.einsum("ai,bj,nijx->nabx", to_bernstein(2), to_bernstein(2), patches)[..., :2]
        distance = np.linalg.norm(control, axis=-1).mean(axis=(1, 2))
        length = [np.linalg.norm(np.ptp(control, axis=a), axis=-1).max(axis=1) for a in (1, 2)]
        large = np.maximum(*length) > longest * distance
        done.append((patches[~large], flags[~large]))
        patches, flags = (
            halved(patches[large], across=(length[1] > length[0])[large]),
            np.tile(flags[large], 2),
        )
    done.append((patches, flags))
    return np.concatenate([p for p, _ in done]), np.concatenate([f for _, f in done])


_SPLITS: Final = 16
