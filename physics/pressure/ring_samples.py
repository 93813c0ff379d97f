"""One fill ratio on one mesh: the mean of all ring quantities over a turn of gravity."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ringbalance.mesh.chamber import chamber_mesh
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.integrals import LiquidIntegrals, liquid_integrals
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid, solve_pressure
from ringbalance.physics.pressure.surface import refined_surface, solve_with_gravity
from ringbalance.physics.results import Status
from ringbalance.scene.arrays import FloatArray
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
    surfaces: tuple[FloatArray, ...]
    """Found surfaces, one per angle, m; empty without gravity."""
    status: Status
    unknowns: int
    residual: float
    """Largest relative residual of the linear systems."""
    flux_mismatch: float
    """Largest mismatch of flux and force on a found surface, relative."""
    rounding: float
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


def _row(totals: LiquidIntegrals) -> list[float]:
    """None of these changes in the mirror image, which gravity at the opposite angle makes."""
    return [
        totals.volume,
        totals.wall_pressure,
        float(totals.first_moment[0]),
        totals.moment_per_volume,
        sum(float(force[0]) for force in totals.force.values()),
    ]


def _failed(status: Status) -> Sample:
    return Sample(
        values=np.zeros(WIDTH),
        ripple=np.zeros(2),
        surfaces=(),
        status=status,
        unknowns=0,
        residual=0.0,
        flux_mismatch=0.0,
        rounding=0.0,
    )
