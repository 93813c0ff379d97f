"""The mesh that a scene names: read, checked and turned into the record and the dimensions of its disc."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.scene.arrays import IntArray
from ringbalance.scene.chamber_file.assembly import Body, assembled, drawing_nodes
from ringbalance.scene.chamber_file.contents import MeshFileError
from ringbalance.scene.chamber_file.keys import MeshKeys
from ringbalance.scene.chamber_file.names import boundaries_of
from ringbalance.scene.chamber_file.placing import (
    Placed,
    covered_findings,
    opening_findings,
    placed,
    port_findings,
    port_radius,
)
from ringbalance.scene.chamber_file.reading import content_of, contents_of, is_step
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.chamber_file.scale import scale_findings
from ringbalance.scene.chamber_file.shape import oriented
from ringbalance.scene.chamber_file.step_file import STEP_UNIT
from ringbalance.scene.chamber_file.topology import facets_of, topology_findings
from ringbalance.scene.dimensions import DIMENSIONS
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.derivations import even_number_of_chambers
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.rules.check import Finding, written
from ringbalance.scene.uncertain import SHAPE

_PORT: Final = "tube.port_radius"


def with_chamber(reading: Reading) -> tuple[Reading, tuple[Fault, ...]]:
    """The reading with the geometry and the dimensions of the mesh that it names, and all errors of it."""
    keys = [f"disc.{key}" for key in keys_of(MeshKeys)]
    if not reading.given("disc.mesh"):
        return reading, tuple(_pointless(reading, key) for key in keys if reading.given(key))
    superfluous, unit = tuple(_superfluous(reading)), tuple(_unit_faults(reading))
    unknown = replace(reading, broken=reading.broken | {f"disc.{key}" for key in (*SHAPE, "geometry")})
    if unit or reading.broken & set(keys) or not reading.known("accuracy.tolerance"):
        return unknown, (*superfluous, *unit)
    try:
        known = _following(reading, *_chamber(reading))
    except (MeshFileError, MemoryError) as error:
        return unknown, (*superfluous, *_mesh_faults(reading, error))
    return (unknown, superfluous) if superfluous else (known, ())


def _mesh_faults(reading: Reading, error: MeshFileError | MemoryError) -> Iterator[Fault]:
    """One error for each finding; what a file calls its parts is printable in it."""
    scarce = Finding(problem="memory does not suffice to check a mesh of this size", allowed="a coarser mesh")
    for each in error.findings if isinstance(error, MeshFileError) else (scarce,):
        problem = "".join(letter if letter.isprintable() else "?" for letter in each.problem)
        yield reading.fault("disc.mesh", problem=problem, allowed=each.allowed)


def _pointless(reading: Reading, path: str) -> Fault:
    problem = "it has no meaning without mesh"
    return reading.fault(path, problem=problem, allowed="mesh as well, or leave the key out")


def _superfluous(reading: Reading) -> Iterator[Fault]:
    for key in SHAPE:
        if reading.given(f"disc.{key}"):
            allowed = "either mesh or this key; the mesh decides"
            yield reading.fault(f"disc.{key}", problem="it follows from the mesh", allowed=allowed)


def _unit_faults(reading: Reading) -> Iterator[Fault]:
    path = "disc.mesh_unit"
    if not reading.known("disc.mesh"):
        return
    step = is_step(Path(reading.values["disc.mesh"]))
    if step and reading.given(path):
        yield reading.fault(path, problem="a STEP file has its own unit", allowed="leave the key out")
    elif not step and reading.lacks(path):
        problem = "the file's coordinates have no unit"
        yield reading.fault(path, problem=problem, allowed=reading.allowed(path))


def _following(reading: Reading, geometry: ChamberGeometry, found: Placed) -> Reading:
    values: dict[str, Any] = {f"disc.{key}": value for key, value in found.dimensions.items()}
    port = port_radius(found.points, geometry.boundaries)
    if port is not None and reading.lacks(_PORT):
        values[_PORT] = port
    return reading.following({**values, "disc.geometry": geometry})


def _chamber(reading: Reading) -> tuple[ChamberGeometry, Placed]:
    """The mesh of a scene. Raises: MeshFileError: with all that is wrong with it."""
    name = reading.values["disc.mesh"]
    path = Path(reading.file).parent / name
    content = content_of(path)
    unit = STEP_UNIT if is_step(path) else reading.values["disc.mesh_unit"]
    contents = contents_of(path, content, tolerance=reading.values["accuracy.tolerance"])
    body = assembled(contents, scale=float(DIMENSIONS["length"].units[unit].factor))
    body, misshapen = oriented(body)
    facets = facets_of(body)
    boundaries, misnamed = boundaries_of(body, facets)
    axis, middle = reading.values["disc.mesh_axis"], reading.values.get("disc.mesh_middle")
    found, misplaced = placed(body, boundaries, facets.nodes[facets.outer], axis=axis, middle=middle)
    everything = [
        *topology_findings(body, facets, drawing_nodes=drawing_nodes(contents)),
        *misshapen,
        *misnamed,
        *misplaced,
        *_unfitting(reading, body, found, boundaries, unit),
    ]
    if everything:
        raise MeshFileError(everything)
    size = reading.values["accuracy.tolerance"] if is_step(path) else 0.0
    return _record(name, content, body, boundaries, found, (unit, axis, middle, size)), found


def _unfitting(
    reading: Reading, body: Body, found: Placed, boundaries: dict[str, IntArray], unit: str
) -> Iterator[Finding]:
    """What does not fit between the mesh and other keys of the scene."""
    extent = found.dimensions["central_angle"]
    if reading.lacks("disc.chambers") and even_number_of_chambers(extent) is None:
        problem = f"chambers is needed: the mesh takes {written(extent, 'deg')}, no even part of 360 deg"
        yield Finding(problem=problem, allowed="chambers in [disc]")
    chambers = reading.values.get("disc.chambers") or even_number_of_chambers(extent)
    if chambers is not None:
        yield from opening_findings(body, found.points, chambers=chambers)
    port, own = reading.values.get(_PORT), port_radius(found.points, boundaries)
    wrong = tuple(scale_findings(reading, found.dimensions, unit=unit, port=own))
    if wrong:
        yield from wrong
        return
    if port is not None:
        yield from port_findings(found.points, boundaries, found.dimensions, port=port)
    radii = {
        "port_radius": port or own,
        "inlet_radius": reading.values.get("gas.inlet_radius"),
    }
    yield from covered_findings(
        body,
        found.points,
        radii={name: value for name, value in radii.items() if value is not None},
        fill=reading.values.get("disc.max_fill_ratio", 0.5),
    )


def _record(
    name: str,
    content: bytes,
    body: Body,
    boundaries: dict[str, IntArray],
    found: Placed,
    way: tuple[Any, ...],
) -> ChamberGeometry:
    """The geometry without nodes that no cell has."""
    used = np.unique(body.cells)
    new = np.zeros(len(body.points), dtype=np.int64)
    new[used] = np.arange(len(used))
    arrays = {each: new[facets] for each, facets in boundaries.items()}
    points, cells = found.points[used], new[body.cells]
    for array in (points, cells, *arrays.values()):
        array.flags.writeable = False
    return ChamberGeometry(
        file=name,
        digest=hashlib.sha256(content + repr(way).encode()).hexdigest(),
        kind=body.kind,
        points=points,
        cells=cells,
        boundaries=arrays,
    )
