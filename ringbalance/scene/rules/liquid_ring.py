"""The kind of scene whose balancer is a liquid ring."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from ringbalance.scene.chamber_file.record import MeshKeys
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.keys.reading import SceneReading, TableRead, read_document
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.kinds import SceneKind, failed_checks
from ringbalance.scene.liquids import with_liquid
from ringbalance.scene.registry import registered
from ringbalance.scene.rules import shape, working


def _read(
    document: Mapping[str, Any],
    *,
    file: str,
    folder: Path,
    derived: Mapping[str, Any],
    before: Mapping[str, TableRead],
) -> tuple[SceneReading, tuple[Fault, ...]]:
    reading, faults = read_document(document, file=file, schema=LIQUID_RING, before=before)
    if derived:
        reading = reading.following(derived)
    elif any(reading.given(f"disc.{key}") for key in keys_of(MeshKeys)):
        reading, mesh_faults = registered("function", "with_chamber")(reading, folder=folder)
        faults = (*faults, *mesh_faults)
    reading = reading.completed()
    reading, liquid_faults = with_liquid(reading.adding(_shortest_length(reading)))
    failed = failed_checks(reading, (*shape.CHECKS, *working.CHECKS))
    missing = (*reading.missing_faults(), *_needed_by_others(reading))
    return reading, (*faults, *missing, *liquid_faults, *failed, *working.uncertainty_faults(reading))


def _shortest_length(reading: SceneReading) -> Mapping[str, float]:
    """Length of the shortest tube: with a given k it matters for the liquid's inertia only."""
    hump_settled = reading.known("tube.hump_radius") or reading.lacks("tube.hump_radius")
    settled = reading.known("tube.drag_coefficient", "tube.port_radius") and hump_settled
    if not settled or not reading.lacks("tube.length"):
        return {}
    port_radius, hump_radius = reading.values["tube.port_radius"], reading.values.get("tube.hump_radius")
    if hump_radius is not None and hump_radius >= port_radius:
        return {}
    length = shortest_path(port_radius=port_radius, hump_radius=hump_radius, separation=math.pi)
    return {"tube.length": length}


def _needed_by_others(reading: SceneReading) -> Iterator[Fault]:
    if reading.given("tube") and reading.lacks("tube.length") and reading.lacks("tube.drag_coefficient"):
        yield reading.missing("tube.length", "k cannot be calculated without it")
    if reading.values.get("tube.entrance") == "rounded" and reading.lacks("tube.entrance_radius"):
        yield reading.missing("tube.entrance_radius", "a rounded entrance needs its radius")
    if not reading.lacks("requirement.grade") and reading.lacks("rotor.mass"):
        yield reading.missing("rotor.mass", "requirement.grade asks for nothing without it")
    pair = ("gas.conductance", "gas.critical_ratio")
    for present, absent in (pair, pair[::-1]):
        if not reading.lacks(present) and reading.lacks(absent):
            yield reading.missing(absent, f"{present.split('.')[1]} has no meaning without it")


KIND: Final = SceneKind(
    schema=LIQUID_RING,
    read=_read,
    main=(
        ("disc.chambers", "disc.inner_radius", "disc.outer_radius", "disc.axial_width"),
        ("liquid.name", "liquid.density", "tube.bore", "tube.length"),
        ("gas.pressure", "rotor.speed", "rotor.influence_coefficient"),
        ("controller.kind", "controller.limit", "run.seed"),
    ),
    arrays=True,
)
