"""Error of facets in place of curved walls, estimated from the mesh alone.

Where two facets meet at a small angle delta, the wall counts as a smooth one through their nodes. An arc of
angle delta over a facet of width h then deviates from it by h delta/12 on average where the facet is flat,
and by h delta/60 where it is quadratic and delta is the remaining bend.

Checks of the outer wall: the axis about which it is round, and parts that face inward.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.chamber_table import SLOPE_TOLERANCE, TOLERANCE, chamber_table
from ringbalance.mesh.geometry import head_square
from ringbalance.mesh.wall_integrals import gauss, wall_patches
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.elements import boundary_facets, corners_of, edges_of
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry
from ringbalance.scene.models import Disc

SMOOTH: Final = np.pi / 6
"""Angle between two facets above which their edge counts as an edge of the chamber."""
COARSE: Final = np.radians(65)
"""Angle in place of `SMOOTH` in a mesh without curved edges, where a hexagon may be a round pillar."""
SAFETY: Final = 1.5
"""Factor on the estimate: an arc of few facets has one edge less than facets."""
_FLAT: Final = 1 / 12
_QUADRATIC: Final = 1 / 60
_STRAIGHT: Final = 1e-6
"""Distance of a middle node from the middle of its edge, over the edge, up to which the edge is straight."""
_MIDDLES: Final = {3: ((0.5, 0), (1, 0.5), (0, 0.5)), 4: ((0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5))}
"""Middles of the edges, (u, v), by number of corners."""
_ROUND: Final = 1e-4
"""Departure of r^2, over its mean, up to which a wall counts as round about the shaft."""
_BETTER: Final = 0.01
"""Departure about a better axis, over that about the shaft, up to which the wall counts as round."""
_INWARD: Final = -0.05
"""Radial part of a normal below which a wall faces the shaft, and not by rounding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Faceting:
    """Volume errors by facets along each smooth edge, all taken with one sign."""

    radius: FloatArray
    """Radius of the edge, m."""
    volume: FloatArray
    """Volume error, m^3."""
    x: FloatArray
    """x of the edge, m."""
    wall: float
    """Error of the mean of r^2 over the outer wall, m^2."""
    steepest: float
    """Largest angle between two facets that are taken for one smooth wall, rad."""


@dataclass(frozen=True, kw_only=True)
class DrawingShares:
    """Relative expanded uncertainties (95 %) by facets and by the table, along the fills."""

    volume: float
    """Uncertainty of the whole chamber's volume."""
    wall_pressure: FloatArray
    hydrostatic_pressure: FloatArray
    first_moment: FloatArray
    centroid: FloatArray
    """Mean of x over the free surface: lambda."""

    @property
    def moment(self) -> FloatArray:
        """Larger of the uncertainties of moment and lambda."""
        return np.maximum(self.first_moment, self.centroid)


@lru_cache(maxsize=8)
def faceting(geometry: ChamberGeometry) -> _Faceting:
    """Estimate the volume errors by the facets of a mesh's walls."""
    facets, corners = boundary_facets(geometry), corners_of(geometry.kind)
    patches, outer = wall_patches(geometry)
    # Each edge of two facets: its number among the edges of both, facet by facet, and its ends.
    edges = np.sort(edges_of(facets[:, :corners]).reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    pair = np.flatnonzero(np.all(edges[order][1:] == edges[order][:-1], axis=1))
    first, second, ends = order[pair], order[pair + 1], edges[order[pair]]
    points, weights = gauss(3)
    area_vectors = _normals_at(patches, np.repeat(points, 3), np.tile(points, 3))
    areas = np.asarray(np.linalg.norm(area_vectors, axis=-1) @ np.outer(weights, weights).ravel())
    normals = _normals_at(patches, *np.array(_MIDDLES[corners]).T).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    bend = np.arccos(np.clip((normals[first] * normals[second]).sum(axis=1), -1, 1))
    # Deviation of a wall from a facet over h delta; quadratic facets of straight edges are flat.
    shares = np.full(len(facets), _FLAT)
    if facets.shape[1] > corners:
        at = geometry.points[facets[:, : 2 * corners]]
        start, stop = at[:, :corners], np.roll(at[:, :corners], -1, axis=1)
        sag = np.linalg.norm(at[:, corners:] - (start + stop) / 2, axis=-1)
        straight = np.all(sag < _STRAIGHT * np.linalg.norm(stop - start, axis=-1), axis=1)
        shares = np.where(straight, _FLAT, _QUADRATIC)
    bend = np.where(bend < (COARSE if np.all(shares == _FLAT) else SMOOTH), bend, 0.0)
    sides = np.stack([first, second]) // corners
    # A triangle's height is twice its area over the edge; a quadrilateral has two edges across the bend.
    share = shares * (2 if corners == 3 else 0.5) * areas**2
    places = geometry.points[ends]
    missed = bend * share[sides].sum(axis=0) / np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
    middle = places.mean(axis=1)
    radius = np.hypot(middle[:, 0], middle[:, 1])
    on_wall = np.all(outer[sides], axis=0)
    return _Faceting(
        radius=radius,
        volume=missed,
        x=middle[:, 0],
        wall=float(2 * (radius * missed)[on_wall].sum() / areas[outer].sum()),
        steepest=float(bend.max(initial=0.0)),
    )


def _normals_at(patches: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    """X_u x X_v at points, shape (patches, points, 3)."""
    ones, zeros = np.ones_like(u), np.zeros_like(u)
    at = [np.stack([ones, t, t**2]) for t in (u, v)]
    slopes = [np.stack([zeros, ones, 2 * t]) for t in (u, v)]
    by_u = np.einsum("nijx,ip,jp->npx", patches, slopes[0], at[1])
    return np.cross(by_u, np.einsum("nijx,ip,jp->npx", patches, at[0], slopes[1]))


def drawing_shares(disc: Disc, fills: FloatArray) -> DrawingShares:
    """Uncertainties by facets in place of curved walls, and by the table between its nodes.

    At a fixed fill ratio the surface moves by the volume errors of the whole chamber and of the wet walls;
    each edge counts with the sign of the largest effect, to first order.
    Args: `fills`: fill ratios above zero, shape (n,).
    Returns: Zeros for the built-in sector.
    """
    if disc.geometry is None:
        return DrawingShares(
            volume=0.0,
            wall_pressure=(none := np.zeros(fills.shape)),
            hydrostatic_pressure=none,
            first_moment=none,
            centroid=none,
        )
    table, walls, x = chamber_table(disc.geometry), faceting(disc.geometry), fills[:, None]
    level = table.level_of(fills * table.volume)
    radius, wetness = np.sqrt(level), -table.at(level)[1][3]
    area, centroid, _ = table.surface(radius)
    wet = walls.radius > radius[:, None]
    missed = SAFETY * walls.volume
    # dV = -(area/2) dL on a concentric surface of area a times `area`.
    moved = 2 * (np.abs(wet - x) @ missed + TOLERANCE * table.volume) / area
    turned = np.abs(wet * (walls.x - centroid[:, None]) + x * centroid[:, None]) @ missed
    shifted = np.abs(
        [table.surface(np.sqrt(np.maximum(level + s * moved, 0.0)))[1] - centroid for s in (-1, 1)]
    )
    offset = shifted.max(axis=0) + (missed.sum() / table.volume + SLOPE_TOLERANCE) * centroid
    return DrawingShares(
        volume=(float(missed.sum()) + TOLERANCE * table.volume) / table.volume,
        wall_pressure=wetness * (moved + SAFETY * walls.wall) / table.at_radius(radius, 3),
        hydrostatic_pressure=moved / head_square(disc=disc, surface_radius=radius),
        first_moment=(turned + TOLERANCE * table.columns[1, 0]) / table.at_radius(radius, 1),
        centroid=offset / centroid,
    )


def axis_beside_shaft(geometry: ChamberGeometry) -> FloatArray | None:
    """Axis (x, y) about which the outer wall is round, m, shape (2,), where that is not the shaft.

    Walls of revolution about (c_x, c_y) have x^2 + y^2 = 2 c_x x + 2 c_y y + k_0 + k_1 z + k_2 z^2: cylinders
    and cones of any draft.
    Returns: c, by least squares over the wall's nodes; None for a wall that is round about the shaft, or not
        round, or round about an axis without enclosing the shaft, such as a bore.
    """
    points = geometry.points[np.unique(geometry.boundaries[OUTER_WALL])]
    square = points[:, 0] ** 2 + points[:, 1] ** 2
    size = float(np.sqrt(square.max()))
    z = points[:, 2:] / size
    about_shaft = np.concatenate([np.ones_like(z), z, z**2], axis=1)
    about_better = np.concatenate([2 * points[:, :2] / size, about_shaft], axis=1)
    coefficients, departure = _fitted(about_better, square)
    _, departure_shaft = _fitted(about_shaft, square)
    centre = coefficients[:2] / size
    encloses = coefficients[2] > 0  # k_0 = R^2 - c^2
    off_shaft = departure_shaft > _ROUND and departure < _BETTER * departure_shaft
    return np.asarray(centre) if off_shaft and encloses else None


def _fitted(terms: FloatArray, square: FloatArray) -> tuple[FloatArray, float]:
    """Least-squares coefficients, and the largest residual over the mean of `square`."""
    coefficients = np.linalg.lstsq(terms, square, rcond=None)[0]
    departure = float(np.abs(terms @ coefficients - square).max() / square.mean())
    return np.asarray(coefficients, dtype=np.float64), departure


def inward_share(geometry: ChamberGeometry) -> float:
    """Share of the outer wall's area whose normal, out of the chamber, points towards the shaft."""
    patches, outer = wall_patches(geometry)
    points, weights = gauss(3)
    u, v = np.repeat(points, 3), np.tile(points, 3)
    powers = np.einsum("ip,jp->ijp", *(np.stack([np.ones_like(t), t, t**2]) for t in (u, v)))
    at = np.einsum("nijx,ijp->npx", patches[outer], powers)
    normals = _normals_at(patches[outer], u, v)
    area = np.linalg.norm(normals, axis=-1)
    radial = (normals[..., :2] * at[..., :2]).sum(axis=-1)
    inward = radial < _INWARD * area * np.linalg.norm(at[..., :2], axis=-1)
    share = area * np.outer(weights, weights).ravel()
    return float(share[inward].sum() / share.sum())
