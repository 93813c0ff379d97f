"""Balances on meshes with a free surface found under gravity."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE, default_cells
from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.ring_samples import liquid_integrals
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid
from ringbalance.physics.pressure.surface import solve_with_gravity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.reference.gravity import tilted_liquid
from ringbalance.verification.rings import mutated_force, ring_of

_FILL_SHARE: Final = 0.8


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
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
