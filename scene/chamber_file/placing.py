"""Where a body lies about the shaft, and the dimensions of the chamber that follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray, clipped
from ringbalance.scene.chamber_file.assembly import Body
from ringbalance.scene.chamber_file.elements import corners_of, edges_of
from ringbalance.scene.chamber_file.keys import Axis
from ringbalance.scene.chamber_file.names import PORT
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.rules.check import Finding, written

DRAWING_ROUNDING: Final = 1e-5
_DIGITS: Final = 7
"""Of dimensions read off a mesh: rounding in a file shall not put a port just outside its wall."""
_SHARES: Final = tuple(step / 32 for step in range(33))
"""Of an edge of second order, between which it is as good as straight: a share 1e-3 of its bulge."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A body in the axes of `ChamberGeometry`, and its dimensions, SI."""

    points: FloatArray
    dimensions: Mapping[str, float]
    """By key of [disc]."""


def placed(
    body: Body,
    boundaries: Mapping[str, IntArray],
    surface: IntArray,
    *,
    axis: Axis,
    middle: float | None,
) -> tuple[Placed, tuple[Finding, ...]]:
    """A body turned so that z is the shaft and x the middle of the chamber, and why it cannot lie there.

    Args: `surface`: the outer facets. `middle`: angle of the chamber's middle, rad, in the plane
        across the shaft, from the next of the file's axes: from x for a shaft along z, from y for x, from z
        for y; None for the middle of what the nodes take up.
    """
    turned = _turned(body.points, axis)
    angle = np.arctan2(turned[:, 1], turned[:, 0])
    start, extent = _taken(angle[np.unique(body.cells)])
    centre = start + extent / 2 if middle is None else middle
    points = _rotated(turned, -centre)
    inner, where = _nearest(points, surface, corners_of(body.kind))
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    points[:, 2] -= (low + high) / 2
    outer = float(np.hypot(points[:, 0], points[:, 1]).max())
    dimensions = {
        "outer_radius": outer,
        "inner_radius": inner,
        "axial_width": high - low,
        "central_angle": extent,
        "plate_thickness": 0.0,
    }
    found = [*_about_axis(body, inner, outer, extent, where), *_walls(points, boundaries)]
    return Placed(points=points, dimensions=_rounded(dimensions)), tuple(found)


def _rounded(dimensions: Mapping[str, float]) -> dict[str, float]:
    """Dimensions to as many digits as a file's rounding leaves."""
    return {key: float(f"{value:.{_DIGITS}g}") for key, value in dimensions.items()}


def _turned(points: FloatArray, axis: Axis) -> FloatArray:
    """Points with the shaft along z; directions keep their handedness."""
    third = "xyz".index(axis[-1])
    order = [(third + 1) % 3, (third + 2) % 3, third]
    signs = np.array([1.0, -1.0, -1.0]) if axis.startswith("-") else np.ones(3)
    return np.asarray(points[:, order] * signs, dtype=np.float64)


def _rotated(points: FloatArray, angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = points.T
    return np.column_stack([c * x - s * y, s * x + c * y, z])


def _taken(angles: FloatArray) -> tuple[float, float]:
    """First angle of what nodes take up of the circle, and its extent: all but the widest gap."""
    ordered = np.sort(angles)
    gaps = np.diff(np.append(ordered, ordered[0] + 2 * math.pi))
    widest = int(gaps.argmax())
    start = float(ordered[(widest + 1) % len(ordered)])
    return start, 2 * math.pi - float(gaps[widest])


def _nearest(points: FloatArray, surface: IntArray, corners: int) -> tuple[float, int]:
    """Smallest distance from the axis, m, of the edges of the surface, and a node of that edge."""
    ends = edges_of(surface[:, :corners]).reshape(-1, 2)
    first, last = points[ends[:, 0], :2], points[ends[:, 1], :2]
    if surface.shape[1] == corners:
        distance = _from_origin(first, last)
    else:
        middle = points[surface[:, corners : 2 * corners].ravel(), :2]
        bulge = middle - (first + last) / 2
        along = [first + share * (last - first) + 4 * share * (1 - share) * bulge for share in _SHARES]
        distance = np.minimum.reduce([_from_origin(*pair) for pair in pairwise(along)])
    return float(distance.min()), int(ends[distance.argmin(), 0])


def _from_origin(first: FloatArray, last: FloatArray) -> FloatArray:
    """Distances of straight lines from the origin."""
    along = last - first
    share = -(first * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
    nearest = first + clipped(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.hypot(nearest[:, 0], nearest[:, 1]), dtype=np.float64)


def _about_axis(body: Body, inner: float, outer: float, extent: float, node: int) -> Iterator[Finding]:
    if extent > math.pi * (1 + DRAWING_ROUNDING) or inner <= 1e-6 * outer:
        label = body.node_labels(np.array([node]))
        what = "touches the shaft's axis" if inner <= 1e-6 * outer else "reaches round the shaft's axis"
        problem = f"the chamber {what}: it takes {written(extent, 'deg')}, nearest to the axis is {label}"
        yield Finding(problem=problem, allowed="one chamber beside the axis; see mesh_axis and the origin")


def _walls(points: FloatArray, boundaries: Mapping[str, IntArray]) -> Iterator[Finding]:
    """The outer wall reaches farther out than the inner wall, and has the outermost nodes."""
    if OUTER_WALL not in boundaries:
        return
    radius = np.hypot(points[:, 0], points[:, 1])
    wall = radius[boundaries[OUTER_WALL]]
    highest = max(float(radius[each].max()) for each in boundaries.values())
    if wall.max() < highest * (1 - 1e-6):
        name = next(name for name, each in boundaries.items() if radius[each].max() == highest)
        problem = f'"{OUTER_WALL}" reaches to a radius of {written(float(wall.max()), "mm")}, but "{name}" '
        problem += f"to {written(highest, 'mm')}: names exchanged, or the shaft is not mesh_axis"
        yield Finding(problem=problem, allowed=f'"{OUTER_WALL}" at the outside of the chamber')


def port_radius(points: FloatArray, boundaries: Mapping[str, IntArray]) -> float | None:
    """Mean radius of the boundary of the port, m; None where the mesh has none."""
    if PORT not in boundaries:
        return None
    middles = points[boundaries[PORT]].mean(axis=1)
    return float(np.hypot(middles[:, 0], middles[:, 1]).mean())
