"""Pressure of the liquid at rest in an imported chamber, and its loads on each named boundary.

laplace(p) = 2 rho omega^2 in the liquid, p = 0 on the free surface and n . grad p = rho omega^2 r e_r . n on
walls, by quadratic tetrahedra on a mesh that follows the free surface.  The exact pressure is known, rho
omega^2 (r^2 - a^2)/2; what the elements leave of it is the error of the discretisation.  What the facets of a
wall leave of a smooth wall is estimated apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.faceting import SAFETY, faceting
from ringbalance.mesh.liquid_body import liquid_body
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.solve import RotatingLiquid, Side, quadratic_basis, side, solve_on
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry


@dataclass(frozen=True, kw_only=True)
class _BoundaryLoad:
    """Force of the liquid on one boundary."""

    force: Estimate
    """N, shape (3,), in the chamber's axes."""
    area: float
    """m^2, of the part that the liquid touches."""


@dataclass(frozen=True, kw_only=True)
class ImportedRing:
    """Liquid at rest in an imported chamber: totals."""

    wall_pressure: Estimate
    """Mean over the part of the outer wall that the liquid touches, gauge, Pa, shape ()."""
    loads: Mapping[str, _BoundaryLoad]
    """By boundary, the free surface left out."""
    volume: float
    """m^3."""
    first_moment: FloatArray
    """rho times the integral of (x, y, z), kg m, shape (3,)."""
    status: Status
    statistics: Statistics


def solved_ring(
    *,
    geometry: ChamberGeometry,
    density: float,
    angular_velocity: float,
    surface_radius: float,
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
    # What the facets of the outer wall leave of r^2 there stands for the other walls, too.
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


def _mean(wall: Side, nodal: FloatArray) -> float:
    return float(np.sum(wall.weights * wall.at_points(nodal)) / wall.weights.sum())


def _load(wall: Side, nodal: FloatArray, exact: FloatArray, doubt: float) -> _BoundaryLoad:
    """With a doubt of the pressure by the walls' facets, Pa."""
    force, still = ((wall.area * wall.at_points(values)).sum(axis=(1, 2)) for values in (nodal, exact))
    area = float(wall.weights.sum())
    return _BoundaryLoad(
        force=Estimate(value=force, uncertainty=np.abs(force - still) + doubt * area), area=area
    )
