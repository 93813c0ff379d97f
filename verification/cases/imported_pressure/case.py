"""Pressure in an imported chamber: a manufactured solution on meshes that become finer, and exact loads."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.liquid_body import Level as SurfaceLevel
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.physics.pressure.imported import ImportedRing, solved_ring
from ringbalance.physics.pressure.solve import quadratic_basis, side, solve_on
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.orders import OrderStudy, order_figure
from ringbalance.verification.reference.block_chambers import disc_chamber
from ringbalance.verification.reference.manufactured import Manufactured

_LEVELS: Final = {"light": (3, 6, 12), "heavy": (4, 8, 16, 24)}
"""Radial cells; half of them lie in the liquid."""
_FILL: Final = 0.4
_OWN: Final = ("surface_off_by_a_percent", "facets_taken_for_the_wall")
"""Mutations of the physical problem; the others are those of the manufactured one."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    disc, sizes = scene.disc, _LEVELS[level]
    studies = _studies(disc, sizes, None if defect in _OWN else defect)
    rings = [_ring(scene, sizes[1], kind, defect) for kind in ("hexahedron27", "hexahedron")]
    density, omega = scene.liquid.density, scene.rotor.speed
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    exact = hydrostatic_pressure(density=density, angular_velocity=omega, inner=a, outer=disc.outer_radius)
    off = [abs(float(ring.wall_pressure.value) - exact) for ring in rings]
    widths = [float(ring.wall_pressure.uncertainty) for ring in rings]
    if defect == "facets_taken_for_the_wall":
        widths[1] = widths[0]
    field, wall = studies["field"], studies["wall"]
    found = {
        "field_order": field.settled_order,
        "field_error": field.finest_error,
        "wall_error": wall.finest_error,
        "pressure": off[0] / exact,
        "held": max(error / width for error, width in zip(off, widths, strict=True)),
        "loads": _balance(rings[0], omega),
    }
    return Evidence(
        found=as_found(**found),
        numbers={"straight": off[1] / exact, "unknowns": float(rings[0].statistics.unknowns)},
        series=(order_figure({"pressure field": field, "force on the outer wall": wall}),),
        convergence=(
            field.table("pressure field, relative error", 3.0),
            wall.table("force on the outer wall, relative error", 4.0),
        ),
    )


@lru_cache(maxsize=8)
def _ring(scene: Scene, size: int, kind: CellKind, defect: str | None) -> ImportedRing:
    a = float(surface_radius(disc=scene.disc, fill_ratio=_FILL))
    return solved_ring(
        geometry=disc_chamber(scene.disc, (size, 2 * size, size), kind=kind),
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        surface_radius=1.01 * a if defect == "surface_off_by_a_percent" else a,
    )


def _balance(ring: ImportedRing, omega: float) -> float:
    """All forces on the walls together over the centrifugal force of the liquid, deviation from one."""
    total = np.sum([load.force.value for load in ring.loads.values()], axis=0)
    exact = omega**2 * ring.first_moment * np.array([1.0, 1.0, 0.0])
    return float(np.linalg.norm(total - exact) / np.linalg.norm(exact))


@lru_cache(maxsize=8)
def _studies(disc: Disc, sizes: tuple[int, ...], defect: str | None) -> dict[str, OrderStudy]:
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    problem, errors = exact.problem(defect), []
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    for size in sizes:
        chamber = tetrahedra(disc_chamber(disc, (size, 2 * size, size)))
        basis = quadratic_basis(scikit_fem_mesh(liquid_body(chamber, SurfaceLevel(constant=a**2 / 2))))
        errors.append(_errors(basis, exact, solve_on(basis, problem).values))
    field, wall = zip(*errors, strict=True)
    steps = [1 / size for size in sizes]
    return {"field": OrderStudy.of(size=steps, error=field), "wall": OrderStudy.of(size=steps, error=wall)}


def _errors(basis: Any, exact: Manufactured, values: FloatArray) -> tuple[float, float]:
    """Root mean square of the field's error, and the error of the force on the outer wall, relative."""
    true = exact.pressure(np.asarray(basis.global_coordinates()))
    difference = np.asarray(basis.interpolate(values)) - true
    wall = side(basis.mesh, "outer_wall")
    force = np.sum(wall.weights * exact.pressure(wall.points))
    field = np.sqrt(np.sum(basis.dx * difference**2) / np.sum(basis.dx * true**2))
    return float(field), abs(float(np.sum(wall.weights * wall.at_points(values)) / force) - 1)
