"""Position of a body about the shaft, its dimensions, and contradictions with other keys of the scene.

These keys are chambers, unit, port and the radii that the body must cover.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray, clipped
from ringbalance.scene.chamber_file.body import Body
from ringbalance.scene.chamber_file.elements import corners_of, edges_of
from ringbalance.scene.chamber_file.record import OUTER_WALL, PORT, Axis, MeshUnit
from ringbalance.scene.keys.derivations import even_number_of_chambers
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Contradiction, failed_checks, written
from ringbalance.scene.rules.shape import DRAWING_ROUNDING, SIZE_CHECKS
from ringbalance.scene.units import DIMENSIONS

_DIMENSION_DIGITS: Final = 7
"""Digits of dimensions read off a mesh: rounding in a file must not put a port just outside its wall."""
_LEAST_FACING: Final = 0.01
"""Mean radial part of the normals below which a boundary is no outer wall."""
_EDGE_FRACTIONS: Final = tuple(step / 32 for step in range(33))
"""Fractions of a second-order edge, between which it is straight within 1e-3 of its bulge."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A body in the axes of `ChamberGeometry`, and its dimensions, SI."""

    points: FloatArray
    dimensions: Mapping[str, float]
    """Dimensions by key of [disc], SI."""


def placed(
    body: Body, boundaries: Mapping[str, IntArray], surface: IntArray, *, axis: Axis, middle: float | None
) -> tuple[Placed, tuple[Contradiction, ...]]:
    """A body rotated so that z is the shaft and x the middle of the chamber, and errors of its position.

    Args: `surface`: the outer facets. `middle`: angle of the chamber's middle, rad, in the plane
        across the shaft, from the next of the file's axes: from x for a shaft along z, from y for x, from z
        for y; None for the middle of the sector of the nodes.
    """
    # The shaft along z; directions keep their handedness.
    third = "xyz".index(axis[-1])
    order = [(third + 1) % 3, (third + 2) % 3, third]
    signs = np.array([1.0, -1.0, -1.0]) if axis.startswith("-") else np.ones(3)
    x, y, z = (body.points[:, order] * signs).T
    # The nodes cover the circle except for the widest gap.
    ordered = np.sort(np.arctan2(y, x)[np.unique(body.cells)])
    gaps = np.diff(np.append(ordered, ordered[0] + 2 * math.pi))
    widest = int(gaps.argmax())
    start = float(ordered[(widest + 1) % len(ordered)])
    extent = 2 * math.pi - float(gaps[widest])
    centre = start + extent / 2 if middle is None else middle
    c, s = math.cos(-centre), math.sin(-centre)
    points = np.column_stack([c * x - s * y, s * x + c * y, z])
    inner, node = _nearest(points, surface, corners_of(body.kind))
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    points[:, 2] -= (low + high) / 2
    outer = float(np.hypot(points[:, 0], points[:, 1]).max())
    wrong = []
    if extent > math.pi * (1 + DRAWING_ROUNDING) or inner <= 1e-6 * outer:
        what = "touches the shaft's axis" if inner <= 1e-6 * outer else "reaches round the shaft's axis"
        problem = f"the chamber {what}: it takes {written(extent, 'deg')}, and its node nearest to the axis "
        problem += f"lies {body.at(np.array([node]))}"
        allowed = "one chamber beside the axis; see mesh_axis and the origin"
        wrong.append(Contradiction(problem=problem, allowed=allowed))
    wrong += _walls(points, boundaries)
    dimensions = {
        "outer_radius": outer,
        "inner_radius": inner,
        "axial_width": high - low,
        "central_angle": extent,
        "plate_thickness": 0.0,
    }
    # Only the digits that are unaffected by rounding in the file.
    rounded = {key: float(f"{value:.{_DIMENSION_DIGITS}g}") for key, value in dimensions.items()}
    return Placed(points=points, dimensions=rounded), tuple(wrong)


def _nearest(points: FloatArray, surface: IntArray, corners: int) -> tuple[float, int]:
    """Smallest distance from the axis, m, of the edges of the surface, and a node of that edge."""
    ends = edges_of(surface[:, :corners]).reshape(-1, 2)
    first, last = points[ends[:, 0], :2], points[ends[:, 1], :2]
    if surface.shape[1] == corners:
        distance = _from_origin(first, last)
    else:
        middle = points[surface[:, corners : 2 * corners].ravel(), :2]
        bulge = middle - (first + last) / 2
        edge_points = [
            first + share * (last - first) + 4 * share * (1 - share) * bulge for share in _EDGE_FRACTIONS
        ]
        distance = np.minimum.reduce([_from_origin(*pair) for pair in pairwise(edge_points)])
    return float(distance.min()), int(ends[distance.argmin(), 0])


def _from_origin(first: FloatArray, last: FloatArray) -> FloatArray:
    """Distances of straight lines from the origin."""
    direction = last - first
    share = -(first * direction).sum(axis=1) / np.maximum((direction**2).sum(axis=1), 1e-300)
    nearest = first + clipped(share, 0.0, 1.0)[:, None] * direction
    return np.asarray(np.hypot(nearest[:, 0], nearest[:, 1]), dtype=np.float64)


def _walls(points: FloatArray, boundaries: Mapping[str, IntArray]) -> Iterator[Contradiction]:
    """Error of an outer wall that is not outermost, or whose normals have hardly any radial part."""
    if OUTER_WALL not in boundaries:
        return
    radius = np.hypot(points[:, 0], points[:, 1])
    wall = radius[boundaries[OUTER_WALL]]
    highest = max(float(radius[each].max()) for each in boundaries.values())
    allowed = f'"{OUTER_WALL}" at the outside of the chamber'
    if wall.max() < highest * (1 - 1e-6):
        name = next(name for name, each in boundaries.items() if radius[each].max() == highest)
        problem = f'"{OUTER_WALL}" reaches to a radius of {written(float(wall.max()), "mm")}, but "{name}" '
        problem += f"to {written(highest, 'mm')}: names exchanged, or the shaft is not mesh_axis"
        yield Contradiction(problem=problem, allowed=allowed)
        return
    # Mean size of the radial part of the wall's normals, by its corners.
    corner = points[boundaries[OUTER_WALL][:, :3]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    middle = corner.mean(axis=1)[:, :2]
    radial = np.abs((normal[:, :2] * middle).sum(axis=1)) / np.linalg.norm(middle, axis=1)
    if float(radial.sum() / np.linalg.norm(normal, axis=1).sum()) < _LEAST_FACING:
        problem = (
            f'"{OUTER_WALL}" lies along the radius, no part of it holds liquid outward: a plate or an end'
        )
        yield Contradiction(problem=problem, allowed=allowed)


def port_radius(points: FloatArray, boundaries: Mapping[str, IntArray]) -> float | None:
    """Mean radius of the boundary of the port, m; None where the mesh has none."""
    if PORT not in boundaries:
        return None
    middles = points[boundaries[PORT]].mean(axis=1)
    return float(np.hypot(middles[:, 0], middles[:, 1]).mean())


PORT_RADIUS: Final = "tube.port_radius"
_LARGEST_RADIUS_M, _SMALLEST_RADIUS_M = 5.0, 1e-3
"""Outer radii, m, beyond which no balancing disc is built."""
_LENGTHS: Final = ("outer_radius", "inner_radius", "axial_width")
_FRAME: Final = [0, 1, 2, -1]
"""Corners of a cell whose edges span it, for its fraction of the volume."""


def unfitting(
    reading: SceneReading, body: Body, placement: Placed, boundaries: dict[str, IntArray], unit: str
) -> Iterator[Contradiction]:
    """Contradictions between the mesh and other keys of the scene."""
    points, extent = placement.points, placement.dimensions["central_angle"]
    if reading.lacks("disc.chambers") and even_number_of_chambers(extent) is None:
        problem = f"chambers is needed: the mesh takes {written(extent, 'deg')}, no even part of 360 deg"
        yield Contradiction(problem=problem, allowed="chambers in [disc]")
    chambers = reading.values.get("disc.chambers") or even_number_of_chambers(extent)
    if chambers is not None:
        # No node may lie outside the largest sector of a chamber.
        half = math.pi / chambers
        angle = np.abs(np.arctan2(points[:, 1], points[:, 0]))
        outside = np.flatnonzero(angle > half * (1 + DRAWING_ROUNDING))
        if len(outside):
            problem = f"nodes lie outside the opening angle, 360 deg / {chambers} chambers about the middle "
            problem += f"({len(outside)}); farthest: {body.at(outside[np.argsort(-angle[outside])])}"
            allowed = f"within {written(half, 'deg')} on both sides of the middle (mesh_middle)"
            yield Contradiction(problem=problem, allowed=allowed)
    port, mesh_port = reading.values.get(PORT_RADIUS), port_radius(points, boundaries)
    wrong_scale = tuple(_scale_findings(reading, placement.dimensions, unit=unit, port=mesh_port))
    if wrong_scale:
        yield from wrong_scale
        return
    if port is not None and PORT in boundaries:
        radius = np.hypot(points[:, 0], points[:, 1])[boundaries[PORT]]
        low, high = float(radius.min()), float(radius.max())
        rounding = 1e-6 * placement.dimensions["outer_radius"]
        if not low - rounding <= port <= high + rounding:
            span = f"from {written(low, 'mm')} to {written(high, 'mm')}"
            problem = f'port_radius is {written(port, "mm")}, but the boundary "{PORT}" lies {span}'
            yield Contradiction(problem=problem, allowed="a radius on the port, or no port_radius")
    radii = {
        "port_radius": port or mesh_port,
        "inlet_radius": reading.values.get("gas.inlet_radius"),
        "gas_hole_radius": reading.values.get("disc.gas_hole_radius"),
    }
    yield from _covered_findings(
        body,
        points,
        radii={name: value for name, value in radii.items() if value is not None},
        fill=reading.values.get("disc.max_fill_ratio", 0.5),
    )


def _scale_findings(
    reading: SceneReading, dimensions: Mapping[str, float], *, unit: str, port: float | None
) -> Iterator[Contradiction]:
    """Lengths of the scene that fit no chamber of this size, and units of the mesh with which they would fit.

    A length that fits with no unit is a separate error, not one of scale.
    Args: `dimensions`: of the mesh in `unit`, SI. `port`: radius of its boundary of that name, m.
    """

    units = DIMENSIONS["length"].units

    def misfit(other: str) -> str | None:
        """Reason why a chamber drawn in another unit is impossible; None if it is possible."""
        factor = float(units[other].factor / units[unit].factor)
        sized = {key: value * (factor if key in _LENGTHS else 1.0) for key, value in dimensions.items()}
        if not _SMALLEST_RADIUS_M <= sized["outer_radius"] <= _LARGEST_RADIUS_M:
            return "no disc is of that size"
        values = {f"disc.{key}": value for key, value in sized.items()}
        if reading.lacks("tube.port_radius"):
            values["tube.port_radius"] = sized["outer_radius"] if port is None else factor * port
        fault = next(failed_checks(reading.adding(values), SIZE_CHECKS), None)
        return None if fault is None else f"[{fault.table}] {fault.key} = {fault.value}: {fault.problem}"

    reason = misfit(unit)
    fitting = [name for name in get_args(MeshUnit) if misfit(name) is None]
    inner, outer = dimensions["inner_radius"], dimensions["outer_radius"]
    if reason is None or (not fitting and _SMALLEST_RADIUS_M <= outer <= _LARGEST_RADIUS_M):
        return
    problem = f'in "{unit}" the chamber reaches from {written(inner, "mm")} to {written(outer, "mm")}: '
    allowed = " or ".join(f'mesh_unit = "{name}"' for name in fitting)
    if not reading.given("disc.mesh_unit"):
        allowed = " or ".join(f'a STEP file in "{name}"' for name in fitting)
    yield Contradiction(
        problem=f"{problem}wrong scale; {reason}",
        allowed=allowed or f"an outer radius of {_SMALLEST_RADIUS_M:g} m to {_LARGEST_RADIUS_M:g} m",
    )


def _covered_findings(
    body: Body, points: FloatArray, *, radii: Mapping[str, float], fill: float
) -> Iterator[Contradiction]:
    """Errors of a port that the liquid leaves free at the start, and of a gas inlet that it covers when most.

    Args: `radii`: of "port_radius", "inlet_radius" and "gas_hole_radius", as far as known. `fill`: greatest
        fill ratio of a chamber, of which one holds half at the start.
    """
    at = np.hypot(points[:, 0], points[:, 1])[body.cells]
    low, high = at.min(axis=1), at.max(axis=1)
    volumes = np.abs(np.linalg.det(np.diff(points[body.corners[:, _FRAME]], axis=1)))
    for name, radius in radii.items():
        shares = clipped((high - radius) / np.maximum(high - low, 1e-300), 0.0, 1.0)
        outside = float((shares * volumes).sum() / volumes.sum())
        if name == "port_radius" and outside > fill / 2:
            problem = f"at the start (fill {fill / 2:.3g}) the liquid does not cover {name}, "
            problem += f"{written(radius, 'mm')}: {100 * outside:.3g} % of the chamber lies outside it"
            yield Contradiction(problem=problem, allowed="a port nearer to the outer wall, or more liquid")
        if name != "port_radius" and outside < fill:
            problem = f"at max_fill_ratio ({fill:.3g}) the liquid covers {name}, {written(radius, 'mm')}: "
            problem += f"{100 * outside:.3g} % of the chamber lies outside it"
            yield Contradiction(problem=problem, allowed="an inlet nearer to the inner wall, or less liquid")
