"""The kind of scene whose balancer is a liquid ring."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ringbalance.scene.chamber_file.keys import MeshKeys
from ringbalance.scene.chamber_file.loading import with_chamber
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.reading import Reading, read_document
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.kinds import SceneKind
from ringbalance.scene.liquids import with_liquid
from ringbalance.scene.rules import shape, validity, working
from ringbalance.scene.rules.check import failed_checks


def _read(
    document: Mapping[str, Any], *, file: str, folder: Path, derived: Mapping[str, Any]
) -> tuple[Reading, tuple[Fault, ...]]:
    reading, faults = read_document(document, file=file, schema=LIQUID_RING)
    if derived:
        reading = reading.following(derived)
    elif any(reading.given(f"disc.{key}") for key in keys_of(MeshKeys)):
        reading, mesh_faults = with_chamber(reading, folder=folder)
        faults = (*faults, *mesh_faults)
    reading, liquid_faults = with_liquid(reading.completed())
    failed = failed_checks(reading, (*shape.CHECKS, *working.CHECKS, *validity.CHECKS))
    uncertain = working.uncertainty_faults(reading)
    return reading, (*faults, *reading.missing_faults(), *liquid_faults, *failed, *uncertain)


KIND: Final = SceneKind(
    schema=LIQUID_RING,
    read=_read,
    main=(
        ("disc.chambers", "disc.inner_radius", "disc.outer_radius", "disc.axial_width"),
        ("liquid.name", "liquid.density", "tube.bore", "tube.length"),
        ("gas.pressure", "rotor.speed", "rotor.influence_coefficient"),
        ("controller.kind", "controller.limit", "run.seed"),
    ),
)
