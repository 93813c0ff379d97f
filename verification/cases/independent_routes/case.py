"""Wall pressure, moment, volume and lambda by three routes."""

from __future__ import annotations

from collections.abc import Mapping

from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Reference
from ringbalance.verification.paper_numbers import with_plate
from ringbalance.verification.reference.exact_chamber import exact_totals
from ringbalance.verification.rings import found_of, mesh_table, mutated_force

_SCALARS = {"wall_pressure": "Pa", "moment": "kg m", "liquid_volume": "m^3"}


def reference(scene: Scene) -> Mapping[str, Reference]:
    values = exact_totals(scene)
    values["volume"] *= scene.disc.max_fill_ratio
    middle = Reference(value=values.pop("lambda"))
    both = {f"{name}_{d}d": Reference(value=value) for name, value in values.items() for d in (2, 3)}
    return both | {"lambda_2d": middle}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    flat, solid = (_ring(scene, dimension, defect) for dimension in (2, 3))
    found = {
        f"{name.removeprefix('liquid_')}_{d}d": found_of(ring, name, 0)
        for d, ring in ((2, flat), (3, solid))
        for name in _SCALARS
    }
    centre = _ring(scene, 2, defect, share=0.5)
    found["lambda_2d"] = found_of(centre, "moment_per_volume", 0).scaled(2 / scene.liquid.density)
    moment = found["moment_2d"]
    exact = reference(scene)["moment_2d"].value
    return Evidence(
        found=found,
        numbers={"moment_share": abs(moment.value - exact) / (2 * moment.numerical)},
        convergence=tuple(mesh_table(flat, name, unit, 0) for name, unit in _SCALARS.items()),
        status=flat.status,
    )


def _ring(scene: Scene, dimension: int, defect: str | None, share: float = 1.0) -> RingQuantities:
    disc = with_plate(scene.disc, 0.0) if defect == "plates_left_out" else scene.disc
    factor = 1.00001 if defect == "force_off" else 1.0
    with mutated_force(along=factor, across=factor):
        return ring_quantities(
            disc=disc,
            density=scene.liquid.density,
            angular_velocity=scene.rotor.speed,
            fill_ratio=share * scene.disc.max_fill_ratio,
            dimension=dimension,
        )
