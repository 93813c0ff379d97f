"""Kind of scene of a liquid-ring balancer."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.scene.chamber_file.record import MeshKeys
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.keys.reading import SceneInput, SceneReading
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.kinds import SceneKind, failed_checks
from ringbalance.scene.liquids import with_liquid
from ringbalance.scene.registry import registered
from ringbalance.scene.rules import shape, working
from ringbalance.scene.rules.valve import with_valve


def _read(content: SceneInput) -> tuple[SceneReading, tuple[Fault, ...]]:
    reading, faults = content.read(LIQUID_RING)
    if content.derived:
        reading = reading.following(content.derived)
    elif any(reading.given(f"disc.{key}") for key in keys_of(MeshKeys)):
        reading, mesh_faults = registered("function", "with_chamber")(reading, folder=content.folder)
        faults = (*faults, *mesh_faults)
    reading = reading.completed()
    port_radius, hump_radius = reading.values.get("tube.port_radius"), reading.values.get("tube.hump_radius")
    if (
        port_radius is not None
        and reading.known("tube.drag_coefficient")
        and reading.lacks("tube.length")
        and (reading.lacks("tube.hump_radius") if hump_radius is None else hump_radius < port_radius)
    ):
        # With a prescribed k the length matters for the liquid's inertia only: the shortest tube serves.
        length = shortest_path(port_radius=port_radius, hump_radius=hump_radius, separation=math.pi)
        reading = reading.adding({"tube.length": length})
    reading, liquid_faults = with_liquid(reading)
    reading, valve_faults = with_valve(reading)
    failed = failed_checks(reading, (*shape.CHECKS, *working.CHECKS))
    missing = [*reading.missing_faults()]
    if reading.given("tube") and reading.lacks("tube.length") and reading.lacks("tube.drag_coefficient"):
        missing.append(reading.missing("tube.length", "k cannot be calculated without it"))
    if reading.values.get("tube.entrance") == "rounded" and reading.lacks("tube.entrance_radius"):
        missing.append(reading.missing("tube.entrance_radius", "a rounded entrance needs its radius"))
    if not reading.lacks("requirement.grade") and reading.lacks("rotor.mass"):
        missing.append(reading.missing("rotor.mass", "requirement.grade asks for nothing without it"))
    for present, absent in _TOGETHER:
        if not reading.lacks(present) and reading.lacks(absent):
            missing.append(reading.missing(absent, f"{present.split('.')[1]} has no meaning without it"))
    return reading, (
        *faults,
        *missing,
        *liquid_faults,
        *valve_faults,
        *failed,
        *working.uncertainty_faults(reading),
    )


_HOLE: Final = "disc.gas_hole_diameter"
_TOGETHER: Final = (
    ("gas.critical_ratio", "gas.conductance"),
    (_HOLE, "disc.gas_hole_radius"),
    *((path, _HOLE) for path in ("disc.gas_hole_radius", "disc.gas_hole_direction", "requirement.crater")),
)
"""Pairs of keys of which the first has no meaning without the second."""
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
