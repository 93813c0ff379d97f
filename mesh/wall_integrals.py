"""Integrals over the liquid outside a free surface, exactly, by integrals over the walls alone.

The walls of an imported chamber are polynomial patches, X(u, v) = sum c_ij u^i v^j, i and j up to 2. Facets
of all kinds are of that form: bilinear and serendipity quadrilaterals as they are, triangles with their
corner 2 stretched to the side v = 1, xi = u (1 - v), eta = v.

The liquid is where q = |r - c|^2 - s z exceeds L: outside a circle about c (s = 0) or a paraboloid. With h =
q - L, w = (r - c).n/|r - c|^2 dA, e the direction of r - c across the shaft and a^2 = |r - c|^2 - h, the
divergence theorem gives, over the walls outside the surface,

    V = int h/2 w,    int (r - c) dV = int (|r - c|^3 - a^3)/3 e w,

because h e/(2 |r - c|) has the divergence 1 and vanishes on the free surface. A wall that the surface
crosses is halved until the crossing is a graph over one of its two coordinates; then Gauss points on either
side of its ends give all digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import comb
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
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
    9: ((*_SERENDIPITY, (2, 2)), ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))),
}
"""Monomials, and positions of the nodes in halves, by the number of nodes."""


@cache
def _coefficients(nodes: int) -> FloatArray:
    """Matrix from the coordinates of a facet's nodes to c_ij, shape (9, nodes)."""
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
    """Patches of all walls of a chamber, X_u x X_v outward.

    Returns: c, m, shape (patches, 3, 3, 3) by power of u, of v, and axis; true for patches of the outer wall.
    """
    facets = boundary_facets(geometry)
    patches = _coefficients(facets.shape[1]) @ geometry.points[facets]
    corners, nodes = corners_of(geometry.kind), len(geometry.points)
    outer = key_of(geometry.boundaries[OUTER_WALL][:, :corners], nodes)
    return patches.reshape(-1, 3, 3, 3), np.isin(key_of(facets[:, :corners], nodes), outer)


@cache
def _to_bernstein(degree: int) -> FloatArray:
    """Matrix from powers to Bernstein coefficients, which bound a polynomial on [0, 1]."""
    size = degree + 1
    return np.array([[comb(j, i) / comb(degree, i) for i in range(size)] for j in range(size)])


@cache
def _half_maps(degree: int) -> tuple[FloatArray, ...]:
    """Matrices from powers on [0, 1] to powers on either half, scaled to [0, 1]."""
    to = _to_bernstein(degree)
    low = np.array([[comb(j, i) / 2**j for i in range(degree + 1)] for j in range(degree + 1)])
    return tuple(np.asarray(np.linalg.solve(to, half @ to)) for half in (low, low[::-1, ::-1]))


@cache
def _mirror(degree: int) -> FloatArray:
    """Matrix from powers of u to powers of 1 - u."""
    to = _to_bernstein(degree)
    return np.asarray(np.linalg.solve(to, to[::-1]))


def _halved(values: FloatArray, *, across: BoolArray) -> FloatArray:
    """Polynomials sum c_ij u^i v^j on both halves of the unit square, shape (2 n, ...).

    Args: `across`: true for a cut at v = 1/2, false at u = 1/2, shape (n,).
    """
    turned = np.where(across.reshape(-1, *[1] * (values.ndim - 1)), values.swapaxes(1, 2), values)
    parts = [np.einsum("ai,ni...->na...", half, turned) for half in _half_maps(values.shape[1] - 1)]
    return np.concatenate(
        [np.where(across.reshape(-1, *[1] * (values.ndim - 1)), p.swapaxes(1, 2), p) for p in parts]
    )


def split_patches(patches: FloatArray, flags: BoolArray, *, longest: float) -> tuple[FloatArray, BoolArray]:
    """Patches halved until none is longer across the shaft than `longest` times its distance from it."""
    done: list[tuple[FloatArray, BoolArray]] = []
    for _ in range(_SPLITS):
        control = np.einsum("ai,bj,nijx->nabx", _to_bernstein(2), _to_bernstein(2), patches)[..., :2]
        distance = np.linalg.norm(control, axis=-1).mean(axis=(1, 2))
        length = [np.linalg.norm(np.ptp(control, axis=a), axis=-1).max(axis=1) for a in (1, 2)]
        large = np.maximum(*length) > longest * distance
        done.append((patches[~large], flags[~large]))
        patches, flags = (
            _halved(patches[large], across=(length[1] > length[0])[large]),
            np.tile(flags[large], 2),
        )
    done.append((patches, flags))
    return np.concatenate([p for p, _ in done]), np.concatenate([f for _, f in done])


_SPLITS: Final = 16


PLAIN_POINTS: Final = 6
"""Gauss points along each side of a patch that no surface crosses."""
CUT_POINTS: Final = 6
LONGEST_SIDE_RATIO: Final = 1 / 3
"""Longest side of a patch over its distance from the shaft: 1/|r|^2 then errs by 1e-10 with six points."""
_STEEP: Final = 0.05
"""Least over largest slope of h along the lines on which the surface is located."""
_HALVINGS: Final = 30
_NEGLIGIBLE: Final = 1e-12
"""Largest fraction of the volume in a piece of wall whose crossing is not located."""
COLUMNS: Final = 4
"""Volume, moment along x and along y, and int h dA over the outer wall; then their derivatives by L."""


@cache
def gauss(points: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights on [0, 1]."""
    places, weights = np.polynomial.legendre.leggauss(points)
    return np.asarray((1 + places) / 2), np.asarray(weights / 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Walls:
    """Patches of the walls that contribute, about one centre, with their integrands at Gauss points."""

    patches: FloatArray
    """Coefficients c relative to the centre, m, shape (n, 3, 3, 3)."""
    outer: BoolArray
    level: FloatArray
    """Coefficients of q by powers of u and v, m^2, shape (n, 5, 5)."""
    lowest: FloatArray
    highest: FloatArray
    """Bounds of q on each patch, m^2."""
    centre: FloatArray
    slope: float
    """Coefficient s of z in q, m."""
    samples: FloatArray
    """Result of `_samples` at the Gauss points, shape (6, n, points); weights included."""


def walls_about(
    patches: FloatArray, outer: BoolArray, *, centre: FloatArray | None = None, slope: float = 0.0
) -> Walls:
    """Walls for surfaces |r - c|^2 - s z = L about a centre, m, without patches that contribute nothing."""
    origin = np.zeros(2) if centre is None else centre
    moved = patches.copy()
    moved[:, 0, 0, :2] -= origin
    samples = _plain(moved, outer)
    scale = np.abs(samples[4]).max(axis=1)
    counts = (scale > 1e-13 * scale.max(initial=0.0)) | outer
    moved, flags = moved[counts], outer[counts]
    level = np.zeros((len(moved), 5, 5))
    for i in range(3):
        for j in range(3):
            level[:, i : i + 3, j : j + 3] += (moved[:, i, j, None, None, :2] * moved[..., :2]).sum(axis=-1)
    level[:, :3, :3] -= slope * moved[..., 2]
    bounds = _bernstein(level).reshape(-1, 25)
    return Walls(
        patches=moved,
        outer=flags,
        level=level,
        lowest=bounds.min(axis=1, initial=np.inf),
        highest=bounds.max(axis=1, initial=-np.inf),
        centre=origin,
        slope=slope,
        samples=samples[:, counts],
    )


def _bernstein(level: FloatArray) -> FloatArray:
    to = _to_bernstein(4)
    return np.asarray(to @ level @ to.T)


def _plain(patches: FloatArray, outer: BoolArray) -> FloatArray:
    places, weights = gauss(PLAIN_POINTS)
    n = len(patches)
    v = np.broadcast_to(places, (n, PLAIN_POINTS))
    u = np.broadcast_to(places, (n, PLAIN_POINTS, PLAIN_POINTS))
    weight = np.broadcast_to(np.outer(weights, weights), u.shape)
    return _samples(patches, outer, v, u, weight).reshape(6, n, PLAIN_POINTS**2)


def _samples(
    patches: FloatArray, outer: BoolArray, v: FloatArray, u: FloatArray, weight: FloatArray
) -> FloatArray:
    """x, y, z, |r|, and the weights of w and of dA on the outer wall.

    Args: `v`: shape (n, k). `u`: shape (n, k, l). `weight`: of each point.
    Returns: Shape (6, n, k, l).
    """
    ones = np.ones_like
    rows, slopes = np.stack([ones(v), v, v**2], axis=-1), np.stack([0 * v, ones(v), 2 * v], axis=-1)
    lines = np.einsum("nijx,nkj->nkxi", patches, rows)
    turned = np.einsum("nijx,nkj->nkxi", patches, slopes)
    c0, c1, c2 = (lines[..., i, None] for i in range(3))
    d0, d1, d2 = (turned[..., i, None] for i in range(3))
    t = u[:, :, None, :]
    point, by_u, by_v = c0 + t * (c1 + t * c2), c1 + 2 * t * c2, d0 + t * (d1 + t * d2)
    x, y, z = (point[:, :, i] for i in range(3))
    (ux, uy, uz), (vx, vy, vz) = ([p[:, :, i] for i in range(3)] for p in (by_u, by_v))
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = x**2 + y**2
    area = np.sqrt(nx**2 + ny**2 + nz**2) * outer[:, None, None]
    return np.stack([x, y, z, np.sqrt(square), weight * (x * nx + y * ny) / square, weight * area])


def _added(samples: FloatArray, slope: float, level: FloatArray | float) -> FloatArray:
    """Integrals of the eight columns over the points' last axis, where h is above zero."""
    x, y, z, r, w, area = samples
    h = r**2 - level
    if slope:
        h -= slope * z
    wet = h > 0
    h = np.where(wet, h, 0.0)
    w, area = np.where(wet, w, 0.0), np.where(wet, area, 0.0)
    a = np.sqrt(np.maximum(r**2 - h, 0.0))
    cubes, turned = h * (r**2 + r * a + a**2) / (3 * (r + a)) * w / r, a / (2 * r) * w
    columns = (h * w / 2, cubes * x, cubes * y, h * area, -w / 2, -turned * x, -turned * y, -area)
    return np.stack([column.sum(axis=-1) for column in columns])


def integrals(walls: Walls, levels: FloatArray) -> FloatArray:
    """V (m^3), its first moments about the shaft (m^4) and int h dA over the outer wall (m^4), for each L.

    Args: `levels`: L, m^2, shape (n,).
    Returns: Shape (8, n): the four, then their derivatives by L.
    """
    total = np.zeros((2 * COLUMNS, levels.size))
    order = np.argsort(walls.lowest)
    samples, lowest = walls.samples[:, order], walls.lowest[order]
    for n, level in enumerate(levels):
        inside = samples[:, int(np.searchsorted(lowest, level)) :].reshape(6, -1)
        total[:, n] = _added(inside, walls.slope, level)
    crossed = (walls.lowest[:, None] < levels) & (walls.highest[:, None] > levels)
    patch, level_number = np.nonzero(crossed)
    for start in range(0, patch.size, _BATCH):
        part = slice(start, start + _BATCH)
        total += _crossed(walls, levels, patch[part], level_number[part])
    for base in (0, COLUMNS):
        total[base + 1 : base + 3] += walls.centre[:, None] * total[base]
    return total


_BATCH: Final = 4000
"""Crossed patches at a time, which bounds the memory."""


def _crossed(walls: Walls, levels: FloatArray, patch: IntArray, number: IntArray) -> FloatArray:
    """Integrals over patches that a surface crosses, each with its level."""
    total = np.zeros((2 * COLUMNS, levels.size))
    patches, outer = walls.patches[patch], walls.outer[patch]
    excess = walls.level[patch]
    excess[:, 0, 0] -= levels[number]
    share = np.abs(walls.samples[4]).sum(axis=1)[patch]
    # Relative to the approximate volume of the chamber.
    negligible = _NEGLIGIBLE * float((np.abs(walls.samples[4]).sum(axis=1) * walls.highest).sum())
    for step in range(_HALVINGS + 1):
        if number.size == 0:
            break
        bounds = _bernstein(excess)
        steep_u, steep_v = _steepness(bounds), _steepness(bounds.transpose(0, 2, 1))
        turned = steep_v > steep_u
        patches[turned], excess[turned] = _turned(patches[turned]), _turned(excess[turned])
        dry = np.all(bounds <= 0, axis=(1, 2))
        small = np.ptp(bounds, axis=(1, 2)) * share < negligible
        inside = ~dry & (np.all(bounds >= 0, axis=(1, 2)) | small | (step == _HALVINGS))
        graph = ~dry & ~inside & (np.maximum(steep_u, steep_v) >= _STEEP)
        values = np.zeros((2 * COLUMNS, number.size))
        plain = _plain(patches[inside], outer[inside])
        values[:, inside] = _added(plain, walls.slope, levels[number[inside], None])
        values[:, graph] = _over_graphs(
            patches[graph], outer[graph], excess[graph], walls.slope, levels[number[graph]]
        )
        for column, value in zip(total, values, strict=True):
            column += np.bincount(number, value, levels.size)
        left = ~(graph | inside | dry)
        # Halving along the curve where a surface meets a wall gains nothing.
        flat = np.abs(np.diff(bounds[left], axis=1)).max(axis=(1, 2)) < np.abs(
            np.diff(bounds[left], axis=2)
        ).max(axis=(1, 2))
        patches, excess = _halved(patches[left], across=flat), _halved(excess[left], across=flat)
        outer, number, share = (np.tile(each[left], 2) for each in (outer, number, share / 2))
    return total


def _turned(values: FloatArray) -> FloatArray:
    """Polynomials in v and 1 - u, which keeps the direction of X_u x X_v."""
    size = values.shape[1]
    mirrored = np.tensordot(values, _mirror(size - 1), axes=(1, 1))
    return np.moveaxis(mirrored, -1, 1).swapaxes(1, 2)


def _steepness(bounds: FloatArray) -> FloatArray:
    """Least over largest slope along u; zero where the crossing is no graph over v or has unclear ends."""
    rise = np.diff(bounds, axis=1).reshape(len(bounds), -1)
    size = np.abs(rise)
    steep = size.min(axis=1) / np.maximum(size.max(axis=1), 1e-300)
    graph = np.all(rise > 0, axis=1) | np.all(rise < 0, axis=1)
    for edge in (bounds[:, 0], bounds[:, -1]):
        slopes = np.diff(edge, axis=1)
        once = np.all(slopes > 0, axis=1) | np.all(slopes < 0, axis=1)
        graph &= once | np.all(edge >= 0, axis=1) | np.all(edge <= 0, axis=1)
    return np.where(graph, steep, 0.0)


def _over_graphs(
    patches: FloatArray, outer: BoolArray, excess: FloatArray, slope: float, level: FloatArray
) -> FloatArray:
    """Integrals over patches on which h grows or falls along every line of u, shape (8, n)."""
    ends = np.sort(np.stack([_root(excess[:, 0]), _root(excess.sum(axis=1))], axis=1), axis=1)
    breaks = np.concatenate([np.zeros((len(ends), 1)), ends, np.ones((len(ends), 1))], axis=1)
    row, part = np.nonzero(np.diff(breaks, axis=1) > 0)
    low, length = breaks[row, part], breaks[row, part + 1] - breaks[row, part]
    places, weights = gauss(CUT_POINTS)
    v = low[:, None] + length[:, None] * places
    lines = np.einsum("nij,nkj->nki", excess[row], v[..., None] ** np.arange(5))
    first, last, root = lines[..., 0], lines.sum(axis=-1), _root(lines)
    start = np.where(first < 0, root, 0.0)
    stop = np.where(last < 0, root, 1.0)
    width = np.where((first < 0) & (last < 0), 0.0, stop - start)
    u = start[..., None] + width[..., None] * places
    weight = (length[:, None] * weights * width)[..., None] * weights
    samples = _samples(patches[row], outer[row], v, u, weight).reshape(6, row.size, CUT_POINTS**2)
    values = _added(samples, slope, level[row, None])
    return np.stack([np.bincount(row, value, len(patches)) for value in values])


def _root(powers: FloatArray) -> FloatArray:
    """Point of [0, 1] at which a polynomial changes its sign, once at most, shape (...); 0 without one."""
    first, last = powers[..., 0], powers.sum(axis=-1)
    changes = first * last < 0
    p = powers[changes] * np.where(last[changes] > 0, 1.0, -1.0)[:, None]
    low, high = np.zeros(len(p)), np.ones(len(p))
    t = p[:, 0] / (p[:, 0] - p.sum(axis=1))
    for _ in range(_NEWTON_STEPS):
        value = p[:, 0] + t * (p[:, 1] + t * (p[:, 2] + t * (p[:, 3] + t * p[:, 4])))
        rise = p[:, 1] + t * (2 * p[:, 2] + t * (3 * p[:, 3] + t * 4 * p[:, 4]))
        low, high = np.where(value < 0, t, low), np.where(value < 0, high, t)
        step = t - value / np.where(rise > 0, rise, 1e-300)
        better = np.where((step > low) & (step < high), step, (low + high) / 2)
        if np.all(np.abs(better - t) <= _ROOT_ERROR):
            break
        t = better
    root = np.zeros(first.shape)
    root[changes] = t
    return root


_ROOT_ERROR: Final = 1e-12
"""Error of a root, over the side of a patch; h vanishes there, so the error of a volume is its square."""
_NEWTON_STEPS: Final = 60
"""Newton steps, or halvings at worst."""
