"""Balances of force, torque, flux and volume on solved meshes, and the same totals by three routes."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE, default_cells
from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.loads import liquid_integrals
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid
from ringbalance.physics.pressure.surface import solve_with_gravity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Reference, as_found
from ringbalance.verification.finite_elements import found_of, mesh_table, mutated_force, ring_of
from ringbalance.verification.papers import with_plate
from ringbalance.verification.reference.exact_chamber import exact_totals
from ringbalance.verification.reference.pressure import tilted_liquid

_FILL_SHARE: Final = 0.8


def conservation(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Balances on meshes with a free surface found under gravity."""
    fill = _FILL_SHARE * scene.disc.max_fill_ratio
    radial, angular = default_cells(disc=scene.disc)
    balances = [_section_balance(scene, fill, (radial // k, angular // k), defect) for k in (4, 2, 1)]
    drawn = float(ring_of(scene, (fill,)).liquid_volume.value[0])
    found = {
        **{name: max(balance[name] for balance in balances) for name in balances[0]},
        "weight_balance": _weight_balance(scene, fill, (radial // 2, angular // 2, 4)),
        "volume_drawn": abs(drawn / (fill * chamber_volume(disc=scene.disc)) - 1),
    }
    return Evidence(found=as_found(**found))


def _section_balance(
    scene: Scene, fill: float, cells: tuple[int, ...], defect: str | None
) -> dict[str, float]:
    """Relative residuals of one two-dimensional solution."""
    true = tilted_liquid(disc=scene.disc, density=scene.liquid.density, fill_ratio=fill, shaft="horizontal")
    with mutated_force(across=1.01 if defect == "force_across_off_by_a_percent" else 1.0):
        solution = _solved(scene, true, fill, cells)
    loads = liquid_integrals(solution=solution, density=true.density, axial_width=scene.disc.axial_width)
    forces = dict(loads.force)
    if defect == "plate_force_dropped":
        forces["plate_left"] = np.zeros(3)
    gravity, moment = np.array((*true.gravity, 0.0)), loads.first_moment
    body = true.angular_velocity**2 * moment + true.density * loads.volume * gravity
    turning = moment[0] * gravity[1] - moment[1] * gravity[0]
    size = float(np.linalg.norm(body))
    torque = sum(loads.torque.values()) - turning
    return {
        "force_balance": float(np.linalg.norm(sum(forces.values()) - body)) / size,
        "torque_balance": abs(float(torque)) / (size * scene.disc.outer_radius),
        "flux_balance": _flux_residual(solution, true),
        "volume_found": abs(solution.statistics.extra["volume_error"]),
    }


def _solved(scene: Scene, liquid: RotatingLiquid, fill: float, cells: tuple[int, ...]) -> PressureSolution:
    solution = solve_with_gravity(disc=scene.disc, liquid=liquid, fill_ratio=fill, cells=cells)
    if not solution.status.ok:
        raise ValueError(solution.status.text)
    return solution


def _flux_residual(solution: PressureSolution, liquid: RotatingLiquid) -> float:
    """Flux out through the surface plus flux through the walls, less the source, relative to the source."""
    unit = solution.chamber.length_scale
    source = unit * float(solution.basis.dx.sum()) * 2 * liquid.density * liquid.angular_velocity**2
    surface = solution.side(FREE_SURFACE)
    total = float(np.sum(surface.weights * solution.surface_flux(surface)))
    for name in solution.chamber.mesh.boundaries:
        if name != FREE_SURFACE:
            wall = solution.side(name)
            total += float(np.sum(liquid.body_force(unit * wall.points) * wall.area))
    return abs(total / source - 1)


def _weight_balance(scene: Scene, fill: float, cells: tuple[int, ...]) -> float:
    liquid = tilted_liquid(disc=scene.disc, density=scene.liquid.density, fill_ratio=fill, shaft="vertical")
    solution = _solved(scene, liquid, fill, cells)
    loads = liquid_integrals(solution=solution, density=liquid.density, axial_width=scene.disc.axial_width)
    weight = liquid.density * loads.volume * liquid.gravity[2]
    axial: FloatArray = np.array([force[2] for force in loads.force.values()])
    return abs(float(axial.sum()) / weight - 1)


_SCALARS = {"wall_pressure": "Pa", "moment": "kg m", "liquid_volume": "m^3"}


def independent_routes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Wall pressure, moment, volume and lambda by three routes: two meshes and closed forms."""
    exact = exact_totals(scene)
    exact["volume"] *= scene.disc.max_fill_ratio
    reference = {"lambda_2d": Reference(value=exact.pop("lambda"))}
    reference |= {f"{name}_{d}d": Reference(value=value) for name, value in exact.items() for d in (2, 3)}
    rings = {dimension: _ring(scene, dimension, defect) for dimension in (2, 3)}
    found = {
        f"{name.removeprefix('liquid_')}_{d}d": found_of(ring, name, 0)
        for d, ring in rings.items()
        for name in _SCALARS
    }
    centre = _ring(scene, 2, defect, share=0.5)
    found["lambda_2d"] = found_of(centre, "moment_per_volume", 0).scaled(2 / scene.liquid.density)
    moment = found["moment_2d"]
    return Evidence(
        found=found,
        reference=reference,
        numbers={"moment_share": abs(moment.value - exact["moment"]) / (2 * moment.numerical)},
        convergence=tuple(mesh_table(rings[2], name, unit, 0) for name, unit in _SCALARS.items()),
        status=rings[2].status,
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
