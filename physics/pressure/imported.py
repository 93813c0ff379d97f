"""Pressure of the liquid at rest in an imported chamber, and its loads on each named boundary.

laplace(p) = 2 rho omega^2 in the liquid, p = p_gas on the free surface and n . grad p = rho (omega^2 r e_r +
g) . n on walls, by quadratic tetrahedra on a mesh that follows the free surface.  The force field has the
potential of `Level`, so the exact pressure at every place is known; what the elements leave of it is the
error of the discretisation.  What the facets of a wall leave of a smooth wall is estimated apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from skfem.quadrature import get_quadrature

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.faceting import SAFETY, faceting
from ringbalance.mesh.liquid_body import Level, liquid_body
from ringbalance.mesh.quadratic_tetrahedra import Tetrahedra, scikit_fem_mesh, tetrahedra
from ringbalance.physics.pressure.solve import RotatingLiquid, Side, quadratic_basis, side, solve_on
from ringbalance.physics.results import Estimate, Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry

_VOLUME_TOLERANCE: Final = 1e-10
_MOST_STEPS: Final = 20


@dataclass(frozen=True, kw_only=True)
class _BoundaryLoad:
    """Force and moment of the liquid on one boundary."""

    force: Estimate
    """N, shape (3,), in the chamber's axes."""
    moment: Estimate
    """About the middle of the shaft, N m, shape (3,)."""
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
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gas_pressure: float = 0.0,
) -> ImportedRing:
    """Pressure and loads of the liquid outside a free surface.

    Args:
        surface_radius: a, m; with gravity, of the concentric surface that holds the same liquid.
        gravity: in the chamber's axes, m/s^2, frozen at one instant.
        gas_pressure: gauge, Pa.
    Returns: ImportedRing; its uncertainties hold the error of the elements and of the walls' facets.  Status
        NO_RING when gravity across the shaft exceeds omega^2 a, NOT_CONVERGED when a solve failed.
    Raises: ValueError: values out of range, or a free surface that misses the chamber.
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem.
    """
    if not (density > 0 and angular_velocity != 0 and surface_radius > 0):
        raise ValueError("density and surface_radius must be above zero, and angular_velocity not zero")
    tilt = np.asarray(gravity) / angular_velocity**2
    level = Level(constant=surface_radius**2 / 2, tilt=(float(tilt[0]), float(tilt[1]), float(tilt[2])))
    no_ring = float(np.hypot(*tilt[:2])) >= surface_radius
    start = Level(constant=level.constant) if no_ring else level
    body, status = _held_volume(tetrahedra(geometry), start, surface_radius)
    mesh = scikit_fem_mesh(body.liquid)
    basis = quadratic_basis(mesh)
    liquid = RotatingLiquid(
        density=density, angular_velocity=angular_velocity, gravity=gravity, gas_pressure=gas_pressure
    )
    linear = solve_on(basis, liquid.problem())
    exact = density * angular_velocity**2 * body.level.value(mesh.doflocs.T) + gas_pressure
    status = _NO_RING if no_ring else (status if linear.status.ok else linear.status)
    walls = {name: side(mesh, name) for name in mesh.boundaries if name != FREE_SURFACE}
    # What the facets of the outer wall leave of r^2 there stands for the other walls, too.
    doubt = density * angular_velocity**2 / 2 * SAFETY * faceting(geometry).wall
    mean, still = (_mean(walls[OUTER_WALL], values) for values in (linear.values, exact))
    return ImportedRing(
        wall_pressure=Estimate(value=np.array(mean), uncertainty=np.array(abs(mean - still) + doubt)),
        loads={name: _load(wall, linear.values, exact, doubt) for name, wall in walls.items()},
        volume=float(basis.dx.sum()),
        first_moment=density * np.sum(basis.dx * np.asarray(basis.global_coordinates()), axis=(1, 2)),
        status=status,
        statistics=linear.statistics,
    )


_NO_RING: Final = Status(
    code=StatusCode.NO_RING,
    text="gravity across the shaft exceeds the centrifugal force at the free surface: turn faster",
)


@dataclass(frozen=True, kw_only=True)
class _Held:
    liquid: Tetrahedra
    level: Level


def _body_volume(body: Tetrahedra) -> float:
    """m^3."""
    mesh = scikit_fem_mesh(body)
    points, weights = get_quadrature(mesh.refdom, 2)
    return float(np.sum(np.abs(mesh.mapping().detDF(points)) @ weights))


def _held_volume(chamber: Tetrahedra, level: Level, radius: float) -> tuple[_Held, Status]:
    """The level of this tilt that holds as much liquid as a concentric surface."""
    liquid = liquid_body(chamber, level)
    if not any(level.tilt):
        return _Held(liquid=liquid, level=level), Status()
    target = _body_volume(liquid_body(chamber, Level(constant=radius**2 / 2)))
    for _ in range(_MOST_STEPS):
        surface = side(scikit_fem_mesh(liquid), FREE_SURFACE)
        shortage = target - _body_volume(liquid)
        if abs(shortage) <= _VOLUME_TOLERANCE * target:
            return _Held(liquid=liquid, level=level), Status()
        # A level lower by d moves the surface out of the liquid by d / |gradient|.
        growth = np.sum(
            surface.weights / np.linalg.norm(level.gradient(np.moveaxis(surface.points, 0, -1)), axis=-1)
        )
        level = Level(constant=level.constant - shortage / float(growth), tilt=level.tilt)
        liquid = liquid_body(chamber, level)
    text = "no free surface under gravity holds this volume: use a finer mesh"
    return _Held(liquid=liquid, level=level), Status(code=StatusCode.NOT_CONVERGED, text=text)


def _mean(wall: Side, nodal: FloatArray) -> float:
    return float(np.sum(wall.weights * wall.at_points(nodal)) / wall.weights.sum())


def _load(wall: Side, nodal: FloatArray, exact: FloatArray, doubt: float) -> _BoundaryLoad:
    """With a doubt of the pressure by the walls' facets, Pa."""
    found, still = (_resultants(wall, values) for values in (nodal, exact))
    area = float(wall.weights.sum())
    reach = float(np.linalg.norm(wall.points, axis=0).max())
    facet = doubt * area * np.array([[1.0], [reach]])
    estimates = [
        Estimate(value=value, uncertainty=np.abs(value - other) + extra)
        for value, other, extra in zip(found, still, facet, strict=True)
    ]
    return _BoundaryLoad(force=estimates[0], moment=estimates[1], area=area)


def _resultants(wall: Side, nodal: FloatArray) -> tuple[FloatArray, FloatArray]:
    push = wall.area * wall.at_points(nodal)
    return push.sum(axis=(1, 2)), np.cross(wall.points, push, axis=0).sum(axis=(1, 2))
