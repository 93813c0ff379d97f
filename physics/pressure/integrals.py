"""Volume, moment, wall pressure and wall forces from a pressure solution, by quadrature on its own mesh.

A two-dimensional solution gives quantities per unit depth (`SectionIntegrals`), a three-dimensional one
totals (`LiquidIntegrals`); only `over_width` turns the first into the second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.physics.pressure.assembly import (
    Facets,
    at_cells,
    at_facets,
    facet_points,
    volume_points,
)
from ringbalance.physics.pressure.solve import FREE_SURFACE, PressureSolution
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class SectionIntegrals:
    """Integrals over a cross-section; everything extensive is per metre of depth."""

    area: float
    """m^2."""
    first_moment_per_depth: FloatArray
    """rho times the integral of (x, y), kg, shape (2,)."""
    wall_pressure: float
    """Mean over the outer wall, gauge, Pa."""
    moment_per_volume: float
    """rho times the mean of x over the surface, weighted with its speed as liquid is added, kg/m^2."""
    force_per_depth: Mapping[str, FloatArray]
    """Force of the liquid on each wall, N/m, shape (2,)."""
    torque_per_depth: Mapping[str, float]
    """Its torque about the shaft, with the rotation, N."""
    pressure_integral: float
    """Integral of the pressure over the cross-section, N: the push on one end."""


@dataclass(frozen=True, kw_only=True)
class LiquidIntegrals:
    """Integrals over the liquid of one chamber: totals."""

    volume: float
    """m^3."""
    first_moment: FloatArray
    """rho times the integral of (x, y, z), kg m, shape (3,)."""
    wall_pressure: float
    """Mean over the outer wall, gauge, Pa."""
    moment_per_volume: float
    """dU/dV' as liquid is added, kg/m^2."""
    force: Mapping[str, FloatArray]
    """Force of the liquid on each wall, N, shape (3,)."""
    torque: Mapping[str, float]
    """Its torque about the shaft, with the rotation, N m."""


def section_integrals(*, solution: PressureSolution, density: float) -> SectionIntegrals:
    """Integrals of a two-dimensional solution, per unit depth.

    Args: `solution`: on a two-dimensional mesh.
    Raises: ValueError: a three-dimensional solution.
    Source: definitions; the shape derivative is dU/dV' = rho int x/|n.grad p| / int 1/|n.grad p| over the
        free surface, because a raised pressure level moves the surface by dp/|n.grad p|.
    """
    if solution.chamber.dimension != 2:
        raise ValueError("section_integrals takes a two-dimensional solution; use liquid_integrals")
    unit = solution.chamber.length_scale
    volume = volume_points(solution.chamber.mesh)
    forces, torques = _wall_loads(solution)
    return SectionIntegrals(
        area=float(unit**2 * volume.weights.sum()),
        first_moment_per_depth=density * unit**3 * np.sum(volume.weights * volume.points, axis=(1, 2)),
        wall_pressure=_wall_pressure(solution),
        moment_per_volume=_moment_per_volume(solution, density),
        force_per_depth=forces,
        torque_per_depth=torques,
        pressure_integral=float(unit**2 * np.sum(volume.weights * at_cells(volume, solution.pressure))),
    )


def liquid_integrals(*, solution: PressureSolution, density: float) -> LiquidIntegrals:
    """Integrals of a three-dimensional solution: totals of the chamber.

    Args: `solution`: on a three-dimensional mesh. `density`: rho, kg/m^3.
    Raises: ValueError: a two-dimensional solution.
    Source: definitions, as in `section_integrals`.
    """
    if solution.chamber.dimension != 3:
        raise ValueError("liquid_integrals takes a three-dimensional solution; use section_integrals")
    unit = solution.chamber.length_scale
    volume = volume_points(solution.chamber.mesh)
    forces, torques = _wall_loads(solution)
    return LiquidIntegrals(
        volume=float(unit**3 * volume.weights.sum()),
        first_moment=density * unit**4 * np.sum(volume.weights * volume.points, axis=(1, 2)),
        wall_pressure=_wall_pressure(solution),
        moment_per_volume=_moment_per_volume(solution, density),
        force=forces,
        torque=torques,
    )


def over_width(*, section: SectionIntegrals, axial_width: float) -> LiquidIntegrals:
    """Totals of a chamber whose every cross-section is the same.

    Args: `section`: integrals per metre of depth.
    Source: definition; exact without axial gravity.
    """
    forces = {name: np.append(axial_width * f, 0.0) for name, f in section.force_per_depth.items()}
    push = np.array([0.0, 0.0, section.pressure_integral])
    torques = {name: axial_width * torque for name, torque in section.torque_per_depth.items()}
    return LiquidIntegrals(
        volume=axial_width * section.area,
        first_moment=np.append(axial_width * section.first_moment_per_depth, 0.0),
        wall_pressure=section.wall_pressure,
        moment_per_volume=section.moment_per_volume,
        force={**forces, "end_back": -push, "end_front": push},
        torque={**torques, "end_back": 0.0, "end_front": 0.0},
    )


def _facets(solution: PressureSolution, boundary: str) -> Facets:
    return facet_points(solution.chamber.mesh, boundary)


def _wall_pressure(solution: PressureSolution) -> float:
    wall = _facets(solution, "outer_wall")
    return float(np.sum(wall.weights * at_facets(wall, solution.pressure)) / wall.weights.sum())


def _moment_per_volume(solution: PressureSolution, density: float) -> float:
    surface = _facets(solution, FREE_SURFACE)
    gradient = np.zeros(solution.pressure.size)
    gradient[solution.chamber.grid[0]] = solution.surface_gradient
    speed = surface.weights / np.abs(at_facets(surface, gradient))
    return float(density * solution.chamber.length_scale * np.sum(speed * surface.points[0]) / speed.sum())


def _wall_loads(solution: PressureSolution) -> tuple[dict[str, FloatArray], dict[str, float]]:
    unit, dimension = solution.chamber.length_scale, solution.chamber.dimension
    forces, torques = {}, {}
    for name in solution.chamber.mesh.boundaries:
        if name == FREE_SURFACE:
            continue
        wall = _facets(solution, name)
        push = wall.weights * at_facets(wall, solution.pressure) * wall.normals
        turn = wall.points[0] * push[1] - wall.points[1] * push[0]
        forces[name] = np.asarray(unit ** (dimension - 1) * push.sum(axis=(1, 2)))
        torques[name] = float(unit**dimension * turn.sum())
    return forces, torques
