"""Whether a mesh fits the other keys of its scene: chambers, unit, port and the radii that it must cover."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray, clipped
from ringbalance.scene.chamber_file.assembly import Body
from ringbalance.scene.chamber_file.keys import MeshUnit
from ringbalance.scene.chamber_file.names import PORT
from ringbalance.scene.chamber_file.placing import DRAWING_ROUNDING, Placed, port_radius
from ringbalance.scene.keys.derivations import even_number_of_chambers
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.rules.check import Finding, failed_checks, written
from ringbalance.scene.rules.shape import SIZE_CHECKS
from ringbalance.scene.units import DIMENSIONS

PORT_RADIUS: Final = "tube.port_radius"
_LARGEST, _SMALLEST = 5.0, 1e-3
"""Outer radii, m, beyond which no balancing disc is built."""
_LENGTHS: Final = ("outer_radius", "inner_radius", "axial_width")
_FRAME: Final = [0, 1, 2, -1]
"""Corners of a cell that span it; for its share of the volume."""


def unfitting(
    reading: Reading, body: Body, found: Placed, boundaries: dict[str, IntArray], unit: str
) -> Iterator[Finding]:
    """What does not fit between the mesh and other keys of the scene."""
    extent = found.dimensions["central_angle"]
    if reading.lacks("disc.chambers") and even_number_of_chambers(extent) is None:
        problem = f"chambers is needed: the mesh takes {written(extent, 'deg')}, no even part of 360 deg"
        yield Finding(problem=problem, allowed="chambers in [disc]")
    chambers = reading.values.get("disc.chambers") or even_number_of_chambers(extent)
    if chambers is not None:
        yield from _opening_findings(body, found.points, chambers=chambers)
    port, own = reading.values.get(PORT_RADIUS), port_radius(found.points, boundaries)
    wrong = tuple(_scale_findings(reading, found.dimensions, unit=unit, port=own))
    if wrong:
        yield from wrong
        return
    if port is not None:
        yield from _port_findings(found.points, boundaries, found.dimensions, port=port)
    radii = {
        "port_radius": port or own,
        "inlet_radius": reading.values.get("gas.inlet_radius"),
    }
    yield from _covered_findings(
        body,
        found.points,
        radii={name: value for name, value in radii.items() if value is not None},
        fill=reading.values.get("disc.max_fill_ratio", 0.5),
    )


def _scale_findings(
    reading: Reading, dimensions: Mapping[str, float], *, unit: str, port: float | None
) -> Iterator[Finding]:
    """Lengths of the scene that no chamber of this size has, and the units in which they would fit.

    A length that fits no unit is an error of its own, not one of scale.
    Args: `dimensions`: of the mesh in `unit`, SI. `port`: radius of its boundary of that name, m.
    """

    def misfit(other: str) -> str | None:
        units = DIMENSIONS["length"].units
        return _misfit(reading, dimensions, factor=float(units[other].factor / units[unit].factor), port=port)

    reason = misfit(unit)
    fitting = [name for name in get_args(MeshUnit) if misfit(name) is None]
    inner, outer = dimensions["inner_radius"], dimensions["outer_radius"]
    if reason is None or (not fitting and _SMALLEST <= outer <= _LARGEST):
        return
    problem = f'in "{unit}" the chamber reaches from {written(inner, "mm")} to {written(outer, "mm")}: '
    allowed = " or ".join(f'mesh_unit = "{name}"' for name in fitting)
    if not reading.given("disc.mesh_unit"):
        allowed = " or ".join(f'a STEP file in "{name}"' for name in fitting)
    yield Finding(
        problem=f"{problem}wrong scale; {reason}",
        allowed=allowed or f"an outer radius of {_SMALLEST:g} m to {_LARGEST:g} m",
    )


def _misfit(
    reading: Reading, dimensions: Mapping[str, float], *, factor: float, port: float | None
) -> str | None:
    """Why a chamber so many times as large cannot be; None where it can."""
    sized = {key: value * (factor if key in _LENGTHS else 1.0) for key, value in dimensions.items()}
    if not _SMALLEST <= sized["outer_radius"] <= _LARGEST:
        return "no disc is of that size"
    values = {f"disc.{key}": value for key, value in sized.items()}
    if reading.lacks("tube.port_radius"):
        values["tube.port_radius"] = sized["outer_radius"] if port is None else factor * port
    fault = next(failed_checks(reading.adding(values), SIZE_CHECKS), None)
    return None if fault is None else f"[{fault.table}] {fault.key} = {fault.value}: {fault.problem}"


def _opening_findings(body: Body, points: FloatArray, *, chambers: int) -> Iterator[Finding]:
    """Nodes outside the sector that a chamber has at most. Args: `points`: as placed."""
    half = math.pi / chambers
    angle = np.abs(np.arctan2(points[:, 1], points[:, 0]))
    wrong = np.flatnonzero(angle > half * (1 + DRAWING_ROUNDING))
    if len(wrong):
        worst = wrong[np.argsort(-angle[wrong])]
        problem = f"nodes lie outside the opening angle, 360 deg / {chambers} chambers about the middle "
        problem += f"({len(wrong)}); farthest: {body.node_labels(worst)}"
        limit = written(half, "deg")
        yield Finding(problem=problem, allowed=f"within {limit} on both sides of the middle (mesh_middle)")


def _port_findings(
    points: FloatArray, boundaries: Mapping[str, IntArray], dimensions: Mapping[str, float], *, port: float
) -> Iterator[Finding]:
    """A port's radius beside the named port."""
    if PORT not in boundaries:
        return
    radius = np.hypot(points[:, 0], points[:, 1])[boundaries[PORT]]
    low, high = float(radius.min()), float(radius.max())
    rounding = 1e-6 * dimensions["outer_radius"]
    if not low - rounding <= port <= high + rounding:
        where = f"from {written(low, 'mm')} to {written(high, 'mm')}"
        problem = f'port_radius is {written(port, "mm")}, but the boundary "{PORT}" lies {where}'
        yield Finding(problem=problem, allowed="a radius on the port, or no port_radius")


def _covered_findings(
    body: Body, points: FloatArray, *, radii: Mapping[str, float], fill: float
) -> Iterator[Finding]:
    """Ports that the liquid leaves free at the start, and a gas inlet that it covers when it is most.

    Args: `radii`: of "port_radius" and "inlet_radius", as far as known. `fill`: greatest fill ratio of a
        chamber, of which one holds half at the start.
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
            yield Finding(problem=problem, allowed="a port nearer to the outer wall, or more liquid")
        if name == "inlet_radius" and outside < fill:
            problem = f"at max_fill_ratio ({fill:.3g}) the liquid covers {name}, {written(radius, 'mm')}: "
            problem += f"{100 * outside:.3g} % of the chamber lies outside it"
            yield Finding(problem=problem, allowed="an inlet nearer to the inner wall, or less liquid")
