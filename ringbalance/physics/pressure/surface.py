"""Free surface under gravity, computed and not assumed: the isobar that encloses the liquid's volume.

The force field has a potential, so its pressure follows, up to a constant, from the normal force on all
boundaries, whichever of them is free. Where that pressure varies along the surface, the surface is misplaced;
its nodes move along their radii until the pressure is constant, at constant volume.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from ringbalance.mesh.chamber import FREE_SURFACE, ChamberMesh, chamber_mesh
from ringbalance.mesh.geometry import liquid_area, surface_radius
from ringbalance.physics.pressure.solve import (
    PressureSolution,
    RotatingLiquid,
    WeakProblem,
    quadratic_basis,
    side,
    solve_pressure,
)
from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

_MAX_STEPS = 40
_STEP_TOLERANCE = 1e-9
"""Largest last move of a node, in mean depths."""
_ROUNDING = 1e-5
"""Move, in mean depths, below which one that no longer shrinks is rounding: in a film depths are
differences."""
_SAFE_SHARE = 0.9
"""Fraction of the distance to a wall that a node may move in one step."""
_VOLUME_ROUNDING = 1e-15
_NEAREST = 1e-3
"""Gap to a wall, in mean depths, at which the search ends: the surface would cross the wall."""


_DRY = Status(
    code=StatusCode.NO_RING,
    text="the free surface would run dry on the outer wall: raise the speed or the fill ratio",
)
_SPILLS = Status(
    code=StatusCode.NO_RING,
    text="the free surface would pass the inner radius: raise the speed or lower the fill ratio",
)


@dataclass(frozen=True, kw_only=True)
class _FoundSurface:
    """A mesh whose free surface has constant pressure and holds the given volume."""

    chamber: ChamberMesh
    basis: Any
    status: Status
    statistics: Statistics
    """Number of steps as iterations; the largest move of a node in the last step ("surface_last_move") and
    the rounding in it ("surface_rounding"), both in mean depths; "volume_error", relative."""


def solve_with_gravity(
    *,
    disc: Disc,
    liquid: RotatingLiquid,
    fill_ratio: float,
    cells: tuple[int, ...],
    start: FloatArray | None = None,
) -> PressureSolution:
    """Find the free surface under gravity, then solve the pressure problem below it.

    Args:
        liquid: with gravity in the chamber's axes; two components on a two-dimensional mesh.
        fill_ratio: x, above 0 and at most 1.
        cells: along the radius, the angle and, for a three-dimensional mesh, the axis.
        start: radii to start from, m, at the surface nodes; default concentric.
    Returns: The solution; NO_RING when no closed ring fits, NOT_CONVERGED when the search or the solve
        failed; a failed search leaves a concentric mesh with no pressure on it.
        statistics.extra["surface_flux_mismatch"] is the root mean square of n.grad p - rho (omega^2 r + g).n
        over the surface relative to that of the force: zero only if surface, pressure and force belong
        together.
    Raises: ValueError: a fill ratio outside (0, 1].
    Source: quasi-static balance, Eq. 9 of the liquid-ring paper with gravity.
    """
    surface = _find_surface(disc=disc, liquid=liquid, fill_ratio=fill_ratio, cells=cells, start=start)
    if not surface.status.ok:
        return PressureSolution(
            chamber=surface.chamber,
            basis=surface.basis,
            pressure=np.zeros(surface.chamber.grid.size),
            surface_gradient=np.zeros(surface.chamber.grid[0].shape),
            status=surface.status,
            statistics=surface.statistics,
        )
    solution = solve_pressure(chamber=surface.chamber, problem=liquid.problem(), basis=surface.basis)
    mismatch = {"surface_flux_mismatch": surface_flux_mismatch(solution=solution, liquid=liquid)}
    extra = {**solution.statistics.extra, **surface.statistics.extra, **mismatch}
    steps = surface.statistics.iterations
    return replace(solution, statistics=replace(solution.statistics, iterations=steps, extra=extra))


def _find_surface(
    *,
    disc: Disc,
    liquid: RotatingLiquid,
    fill_ratio: float,
    cells: tuple[int, ...],
    start: FloatArray | None = None,
) -> _FoundSurface:
    """Move the nodes of the free surface until the pressure is constant along it, at the given volume.

    Each step solves laplace(p) = f with n.grad p given on the whole boundary, then moves every surface node
    by (c - p) / (dp/dr), with the level c that keeps the volume.
    Args: as `solve_with_gravity`.
    Raises: ValueError: a fill ratio outside (0, 1].
    Source: Newton's method on the position of an isobar; the slope is that of the hydrostatic force.
    """
    if not 0 < fill_ratio <= 1:
        raise ValueError("fill_ratio must lie within (0, 1] to search a surface")
    concentric = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    status, across = Status(), float(np.linalg.norm(liquid.gravity[:2]))
    lowest = float(np.sqrt(across / concentric))
    if abs(liquid.angular_velocity) <= lowest:
        status = Status(
            code=StatusCode.NO_RING,
            text=f"gravity across the shaft exceeds the centrifugal force at {1e3 * concentric:.4g} mm: "
            f"no ring forms; turn faster than {lowest:.4g} rad/s ({lowest * 30 / np.pi:.4g} rpm)",
        )
    radius = start if status.ok and start is not None else concentric
    first = chamber = chamber_mesh(disc=disc, surface_radius=radius, cells=cells)
    unmoved = basis = quadratic_basis(chamber.mesh)
    depth = disc.outer_radius - float(np.mean(first.surface_radius))
    # Area or volume in units of the mesh.
    full = float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
    target = fill_ratio * full / disc.outer_radius**2
    target = target if len(cells) == 2 else target * disc.axial_width / disc.outer_radius
    move, before, steps = np.inf, np.inf, 0
    while steps < _MAX_STEPS and status.ok and not _settled(move, before):
        step, radius = _newton_step(chamber, basis, liquid, target), chamber.surface_radius
        # Every node stays off the outer wall and off the plates' inner edge.
        room = np.where(step > 0, disc.outer_radius - radius, radius - max(disc.plate_thickness, 0.0))
        with np.errstate(divide="ignore"):
            damping = float(min(1.0, _SAFE_SHARE * np.min(room / np.abs(step))))
        chamber = chamber_mesh(disc=disc, surface_radius=radius + step * damping, cells=cells)
        basis = quadratic_basis(chamber.mesh)
        move, before, steps = float(np.abs(step).max()) / depth, move, steps + 1
        if disc.outer_radius - float(chamber.surface_radius.max()) < _NEAREST * depth:
            status = _DRY
        # A surface that ends outside the inner radius may pass it on the way, so there is some room below.
        elif float(chamber.surface_radius.min()) < max(disc.inner_radius / 2, 1.001 * disc.plate_thickness):
            status = _SPILLS
    if status.ok and not _settled(move, before):
        status = Status(
            code=StatusCode.NOT_CONVERGED,
            text=f"the free surface still moves by {move:.1e} of its depth; "
            "raise the speed or refine the mesh",
        )
    elif status.ok and float(chamber.surface_radius.min()) < disc.inner_radius * (1 - 1e-9):
        status = _SPILLS
    chamber, basis = _hold_volume(disc, chamber, basis, target) if status.ok else (first, unmoved)
    extra = {
        "surface_last_move": move,
        "surface_rounding": move if move > _STEP_TOLERANCE else 0.0,
        "volume_error": float(basis.dx.sum()) / target - 1,
    }
    statistics = Statistics(iterations=steps, extra=extra if status.ok else {})
    return _FoundSurface(chamber=chamber, basis=basis, status=status, statistics=statistics)


def _settled(move: float, before: float) -> bool:
    return move <= _STEP_TOLERANCE or before / 4 <= move <= _ROUNDING


def refined_surface(radius: FloatArray) -> FloatArray:
    """Surface radii on a mesh with twice the cells by cubic interpolation, m, as a starting value."""
    for axis, count in enumerate(radius.shape):
        finer = np.linspace(0, count - 1, 2 * count - 1)
        radius = np.asarray(CubicSpline(np.arange(count), radius, axis=axis)(finer))
    return radius


def surface_flux_mismatch(*, solution: PressureSolution, liquid: RotatingLiquid) -> float:
    """Difference of the flux through the free surface from the force on it, root mean square, relative.

    |n.grad p - rho (omega^2 r + g).n| / |rho (omega^2 r + g).n| over the surface.
    """
    surface, unit = solution.side(FREE_SURFACE), solution.chamber.length_scale
    force = np.sum(liquid.body_force(unit * surface.points) * surface.normals, axis=0)
    difference = solution.surface_flux(surface) - force
    return float(np.sqrt(np.sum(surface.weights * difference**2) / np.sum(surface.weights * force**2)))


def _newton_step(chamber: ChamberMesh, basis: Any, liquid: RotatingLiquid, target: float) -> FloatArray:
    """Radial move of every surface node, m."""
    unit = chamber.length_scale
    # With the force given on the whole boundary the pressure has a free constant: one node fixes it.
    weak = WeakProblem.of(basis, liquid.body_force, unit=unit)
    pressure = weak.solve(start=np.zeros(basis.N), fixed=np.zeros(1, dtype=np.int64)).values
    surface = side(chamber.mesh, FREE_SURFACE)
    force = np.linalg.norm(liquid.body_force(unit * surface.points), axis=0)
    compliance = surface.weights / force
    surplus = unit * (float(basis.dx.sum()) - target)
    level = (surplus + np.sum(compliance * surface.at_points(pressure))) / np.sum(compliance)
    nodes = chamber.places[:, chamber.grid[0]]
    radial = np.sum(liquid.body_force(nodes)[:2] * nodes[:2], axis=0) / np.hypot(nodes[0], nodes[1])
    return np.asarray((level - pressure[chamber.grid[0]]) / radial)


def _hold_volume(disc: Disc, chamber: ChamberMesh, basis: Any, target: float) -> tuple[ChamberMesh, Any]:
    """Remove the last rounding of the volume by equal moves of all nodes."""
    for _ in range(3):
        surplus = float(basis.dx.sum()) - target
        if abs(surplus) <= _VOLUME_ROUNDING * target:
            break
        move = chamber.length_scale * surplus / side(chamber.mesh, FREE_SURFACE).weights.sum()
        chamber = chamber_mesh(disc=disc, surface_radius=chamber.surface_radius + move, cells=chamber.cells)
        basis = quadratic_basis(chamber.mesh)
    return chamber, basis
