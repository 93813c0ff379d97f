"""One fill ratio on one mesh: the mean of all ring quantities, by quadrature, over a turn of gravity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE, chamber_mesh
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid, solve_pressure
from ringbalance.physics.pressure.surface import refined_surface, solve_with_gravity
from ringbalance.physics.results import Status
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.loop_models import Shaft
from ringbalance.scene.models import Disc

QUANTITIES = ("liquid_volume", "wall_pressure", "moment", "moment_per_volume", "resultant_force")
"""In the order of `Sample.values`."""
WIDTH = len(QUANTITIES)


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Gravity as a chamber sees it over a turn."""

    gravity: float
    """m/s^2; zero: left out."""
    shaft: Shaft
    samples: int
    """Even number of angles over a turn, for a horizontal shaft."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Means over a turn on one mesh."""

    values: FloatArray
    """In the order of `QUANTITIES`, SI totals, shape (5,)."""
    ripple: FloatArray
    """First harmonic of wall pressure (Pa) and moment (kg m), zero-to-peak, shape (2,)."""
    surfaces: tuple[FloatArray, ...] = ()
    """Found surfaces, one per angle, m; empty without gravity."""
    status: Status
    unknowns: int = 0
    residual: float = 0.0
    """Largest relative residual of the linear systems."""
    flux_mismatch: float = 0.0
    """Largest mismatch of flux and force on a found surface, relative."""
    rounding: float = 0.0
    """Largest rounding of a found surface's place, in mean depths."""


def turn_mean(
    *,
    disc: Disc,
    liquid: RotatingLiquid,
    fill_ratio: float,
    cells: tuple[int, ...],
    turn: Turn,
    coarser: Sample | None = None,
) -> Sample:
    """Solve on one mesh at every angle of gravity over half a turn and take the mean over the whole turn.

    The other half of the turn is the mirror image of the first.
    Args: `liquid`: without gravity. `coarser`: sample on half the cells, whose surfaces are a good start.
    Source: trapezoidal rule over a period, exact up to harmonics of the order of the number of samples.
    """
    angles, weights = _angles(turn)
    solutions = []
    for k, angle in enumerate(angles):
        start = refined_surface(coarser.surfaces[k]) if coarser and coarser.surfaces else None
        frozen = replace(liquid, gravity=_gravity(turn, float(angle)))
        solution = _solve(disc, frozen, fill_ratio, cells, start)
        if not solution.status.ok:
            return _failed(solution.status)
        solutions.append(solution)
    totals = (
        liquid_integrals(solution=s, density=liquid.density, axial_width=disc.axial_width) for s in solutions
    )
    rows = np.array([_row(total) for total in totals])
    ripple = 2 * (weights * np.cos(angles)) @ rows[:, 1:3] if len(angles) > 1 else np.zeros(2)
    return Sample(
        values=weights @ rows,
        ripple=np.abs(ripple),
        surfaces=tuple(s.chamber.surface_radius for s in solutions) if turn.gravity else (),
        status=Status(),
        unknowns=solutions[0].statistics.unknowns,
        residual=max(s.statistics.relative_residual for s in solutions),
        flux_mismatch=max(s.statistics.extra.get("surface_flux_mismatch", 0.0) for s in solutions),
        rounding=max(s.statistics.extra.get("surface_rounding", 0.0) for s in solutions),
    )


def empty_sample(*, moment_per_volume: float) -> Sample:
    """Sample of a chamber without liquid: all zero but the moment that the first drop would bring, kg/m^2."""
    values = np.zeros(WIDTH)
    values[QUANTITIES.index("moment_per_volume")] = moment_per_volume
    return replace(_failed(Status()), values=values)


def _angles(turn: Turn) -> tuple[FloatArray, FloatArray]:
    if turn.gravity == 0 or turn.shaft == "vertical":
        return np.zeros(1), np.ones(1)
    half = turn.samples // 2
    weights = np.full(half + 1, 2.0 / turn.samples)
    weights[[0, -1]] /= 2
    return np.linspace(0, np.pi, half + 1), weights


def _gravity(turn: Turn, angle: float) -> tuple[float, ...]:
    if turn.gravity == 0:
        return ()
    if turn.shaft == "vertical":
        return (0.0, 0.0, -turn.gravity)
    return (turn.gravity * np.cos(angle), turn.gravity * np.sin(angle))


def _solve(
    disc: Disc,
    liquid: RotatingLiquid,
    fill_ratio: float,
    cells: tuple[int, ...],
    start: FloatArray | None,
) -> PressureSolution:
    if liquid.gravity:
        return solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=fill_ratio, cells=cells, start=start)
    radius = surface_radius(disc=disc, fill_ratio=fill_ratio)
    chamber = chamber_mesh(disc=disc, surface_radius=radius, cells=cells)
    return solve_pressure(chamber=chamber, problem=liquid.problem())


def _row(totals: _LiquidIntegrals) -> list[float]:
    """None of these changes in the mirror image, which gravity at the opposite angle makes."""
    return [
        totals.volume,
        totals.wall_pressure,
        float(totals.first_moment[0]),
        totals.moment_per_volume,
        sum(float(force[0]) for force in totals.force.values()),
    ]


def _failed(status: Status) -> Sample:
    return Sample(values=np.zeros(WIDTH), ripple=np.zeros(2), status=status)


@dataclass(frozen=True, kw_only=True)
class _LiquidIntegrals:
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


def liquid_integrals(*, solution: PressureSolution, density: float, axial_width: float) -> _LiquidIntegrals:
    """Integrals of a solution in three dimensions, or of one in a cross-section times the axial width.

    Every cross-section is the same without axial gravity, and the integral of its pressure is the force on
    each end.
    Source: definitions; the shape derivative is dU/dV' = rho int x/|n.grad p| / int 1/|n.grad p| over the
        free surface, because a raised pressure level moves the surface by dp/|n.grad p|.
    """
    chamber, basis, unit = solution.chamber, solution.basis, solution.chamber.length_scale
    depth = axial_width if chamber.dimension == 2 else unit
    forces, torques = _wall_loads(solution, depth)
    if chamber.dimension == 2:
        pressure = float(unit**2 * np.sum(basis.dx * basis.interpolate(solution.pressure)))
        push = np.array([0.0, 0.0, pressure])
        forces |= {"end_back": -push, "end_front": push}
        torques |= {"end_back": 0.0, "end_front": 0.0}
    places = np.asarray(basis.global_coordinates())
    moment = density * unit**3 * depth * np.sum(basis.dx * places, axis=(1, 2))
    wall = solution.side(OUTER_WALL)
    return _LiquidIntegrals(
        volume=float(unit**2 * depth * basis.dx.sum()),
        first_moment=np.pad(moment, (0, 3 - len(moment))),
        wall_pressure=float(np.sum(wall.weights * wall.at_points(solution.pressure)) / wall.weights.sum()),
        moment_per_volume=_moment_per_volume(solution, density),
        force=forces,
        torque=torques,
    )


def _moment_per_volume(solution: PressureSolution, density: float) -> float:
    surface = solution.side(FREE_SURFACE)
    speed = surface.weights / np.abs(solution.surface_flux(surface))
    return float(density * solution.chamber.length_scale * np.sum(speed * surface.points[0]) / speed.sum())


def _wall_loads(solution: PressureSolution, depth: float) -> tuple[dict[str, FloatArray], dict[str, float]]:
    unit = solution.chamber.length_scale
    forces, torques = {}, {}
    for name in solution.chamber.mesh.boundaries:
        if name == FREE_SURFACE:
            continue
        wall = solution.side(name)
        push = wall.at_points(solution.pressure) * wall.area
        turn = wall.points[0] * push[1] - wall.points[1] * push[0]
        total = unit * depth * push.sum(axis=(1, 2))
        forces[name] = np.pad(total, (0, 3 - len(total)))
        torques[name] = float(unit**2 * depth * turn.sum())
    return forces, torques
