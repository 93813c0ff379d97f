"""Integrals of the pressure in one chamber: volume, moment, wall pressure, force and torque on walls.

In an imported chamber the pressure is solved here: laplace(p) = 2 rho omega^2 in the liquid, p = 0 on the
free surface and n . grad p = rho omega^2 r e_r . n on walls, by quadratic tetrahedra on a mesh that follows
the surface. The exact pressure is known, rho omega^2 (r^2 - a^2)/2; the deviation from it is the
discretisation error. The error of facets in place of a smooth wall is estimated separately.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.faceting import SAFETY, faceting
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.solve import (
    BoundarySide,
    PressureSolution,
    RotatingLiquid,
    quadratic_basis,
    side,
    solve_on,
)
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry


@dataclass(frozen=True, kw_only=True)
class _LiquidIntegrals:
    """Totals of the liquid in one chamber."""

    volume: float
    """Volume of the liquid, m^3."""
    first_moment: FloatArray
    """rho times the integral of (x, y, z), kg m, shape (3,)."""
    wall_pressure: float
    """Mean over the outer wall, gauge, Pa."""
    moment_per_volume: float
    """dU/dV' as liquid is added, kg/m^2."""
    force: Mapping[str, FloatArray]
    """Force of the liquid on each wall, N, shape (3,)."""
    torque: Mapping[str, float]
    """Torque of the liquid on each wall about the shaft, with the rotation, N m."""

    @property
    def mirrored_alike(self) -> list[float]:
        """Volume, wall pressure, U, dU/dV' and force along x: alike in the mirror image of the chamber."""
        force = sum(float(each[0]) for each in self.force.values())
        moment = float(self.first_moment[0])
        return [self.volume, self.wall_pressure, moment, self.moment_per_volume, force]


def liquid_integrals(*, solution: PressureSolution, density: float, axial_width: float) -> _LiquidIntegrals:
    """Integrals of a solution in three dimensions, or of one in a cross-section times the axial width.

    Every cross-section is the same without axial gravity, and the integral of its pressure is the force on
    each end.
    Source: definitions; the shape derivative is dU/dV' = rho int x/|n.grad p| / int 1/|n.grad p| over the
        free surface, because a raised pressure level moves the surface by dp/|n.grad p|.
    """
    chamber, basis, unit = solution.chamber, solution.basis, solution.chamber.length_scale
    depth = axial_width if chamber.dimension == 2 else unit
    forces, torques = {}, {}
    for name in chamber.mesh.boundaries:
        if name == FREE_SURFACE:
            continue
        wall = solution.side(name)
        push = wall.at_points(solution.pressure) * wall.area
        turn = wall.points[0] * push[1] - wall.points[1] * push[0]
        total = unit * depth * push.sum(axis=(1, 2))
        forces[name] = np.pad(total, (0, 3 - len(total)))
        torques[name] = float(unit**2 * depth * turn.sum())
    if chamber.dimension == 2:
        pressure = float(unit**2 * np.sum(basis.dx * basis.interpolate(solution.pressure)))
        push = np.array([0.0, 0.0, pressure])
        forces |= {"end_back": -push, "end_front": push}
        torques |= {"end_back": 0.0, "end_front": 0.0}
    points = np.asarray(basis.global_coordinates())
    moment = density * unit**3 * depth * np.sum(basis.dx * points, axis=(1, 2))
    surface = solution.side(FREE_SURFACE)
    speed = surface.weights / np.abs(solution.surface_flux(surface))
    return _LiquidIntegrals(
        volume=float(unit**2 * depth * basis.dx.sum()),
        first_moment=np.pad(moment, (0, 3 - len(moment))),
        wall_pressure=_mean(solution.side(OUTER_WALL), solution.pressure),
        moment_per_volume=float(density * unit * np.sum(speed * surface.points[0]) / speed.sum()),
        force=forces,
        torque=torques,
    )


@dataclass(frozen=True, kw_only=True)
class _BoundaryLoad:
    """Force of the liquid on one boundary."""

    force: Estimate
    """Force in the chamber's axes, N, shape (3,)."""
    area: float
    """Area of the wetted part, m^2."""


@dataclass(frozen=True, kw_only=True)
class ImportedRing:
    """Totals of the liquid at rest in an imported chamber."""

    wall_pressure: Estimate
    """Mean gauge pressure on the wetted part of the outer wall, Pa, shape ()."""
    loads: Mapping[str, _BoundaryLoad]
    """Load on each boundary except the free surface."""
    volume: float
    """Volume of the liquid, m^3."""
    first_moment: FloatArray
    """rho times the integral of (x, y, z), kg m, shape (3,)."""
    status: Status
    statistics: Statistics


def solved_ring(
    *, geometry: ChamberGeometry, density: float, angular_velocity: float, surface_radius: float
) -> ImportedRing:
    """Pressure and loads of the liquid outside a concentric free surface.

    Args: `surface_radius`: a, m.
    Returns: ImportedRing; its uncertainties hold the error of the elements and of the walls' facets.
    Raises: ValueError: values out of range, or a free surface that misses the chamber.
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    if not (density > 0 and angular_velocity != 0 and surface_radius > 0):
        raise ValueError("density and surface_radius must be above zero, and angular_velocity not zero")
    mesh = scikit_fem_mesh(liquid_body(tetrahedra(geometry), surface_radius))
    basis = quadratic_basis(mesh)
    liquid = RotatingLiquid(density=density, angular_velocity=angular_velocity)
    linear = solve_on(basis, liquid.problem())
    exact = (
        density * angular_velocity**2 / 2 * (mesh.doflocs[0] ** 2 + mesh.doflocs[1] ** 2 - surface_radius**2)
    )
    walls = {name: side(mesh, name) for name in mesh.boundaries if name != FREE_SURFACE}
    # The error of r^2 by the facets of the outer wall is taken for the other walls as well.
    doubt = density * angular_velocity**2 / 2 * SAFETY * faceting(geometry).wall
    mean, still = (_mean(walls[OUTER_WALL], values) for values in (linear.values, exact))
    return ImportedRing(
        wall_pressure=Estimate(value=np.array(mean), uncertainty=np.array(abs(mean - still) + doubt)),
        loads={name: _load(wall, linear.values, exact, doubt) for name, wall in walls.items()},
        volume=float(basis.dx.sum()),
        first_moment=density * np.sum(basis.dx * np.asarray(basis.global_coordinates()), axis=(1, 2)),
        status=linear.status,
        statistics=linear.statistics,
    )


def _mean(wall: BoundarySide, nodal: FloatArray) -> float:
    return float(np.sum(wall.weights * wall.at_points(nodal)) / wall.weights.sum())


def _load(wall: BoundarySide, nodal: FloatArray, exact: FloatArray, doubt: float) -> _BoundaryLoad:
    """Load on a wall; `doubt` is the error of the pressure by the walls' facets, Pa."""
    force, still = ((wall.area * wall.at_points(values)).sum(axis=(1, 2)) for values in (nodal, exact))
    area = float(wall.weights.sum())
    return _BoundaryLoad(
        force=Estimate(value=force, uncertainty=np.abs(force - still) + doubt * area), area=area
    )
