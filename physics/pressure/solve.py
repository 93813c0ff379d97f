"""The pressure of the liquid in a chamber that turns: a Poisson problem with the gas on its free surface.

In the rotating frame liquid at rest obeys grad p = rho (omega^2 r e_r + g).  Its divergence is the equation,
its normal component the condition on walls:

    laplace(p) = f                  in the liquid,        f = 2 rho omega^2
    n . grad p = q                  on walls,             q = rho (omega^2 r e_r + g) . n
    p = p_gas                       on the free surface

and the weak form is int grad p . grad v = - int f v + int_walls q v.  Manufactured solutions put their own
f, q and p_gas into the same record, so they run through the same lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE, ChamberMesh
from ringbalance.physics.pressure.assembly import Stiffness, facet_points, gauss_line, volume_points
from ringbalance.physics.pressure.linear import Form, LinearSolution, solve_form
from ringbalance.physics.pressure.separable import mass_inverse, stiffness_inverse
from ringbalance.physics.results import Statistics, Status
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class PressureProblem:
    """Right-hand sides of the pressure problem, as functions of the place; all lengths in metres."""

    source: Callable[[FloatArray], FloatArray]
    """f(x), Pa/m^2, from places of shape (dimension, ...)."""
    wall_flux: Callable[[FloatArray, FloatArray], FloatArray]
    """q(x, n), Pa/m, from places and outward unit normals."""
    surface_pressure: Callable[[FloatArray], FloatArray]
    """p_gas(x), Pa, gauge."""

    def discretise(self, *, chamber: ChamberMesh) -> _DiscreteProblem:
        """Form and load of the weak problem; the free surface is left without a condition."""
        unit, volume = chamber.length_scale, volume_points(chamber)
        total = -(unit**2) * volume.load(self.source(unit * volume.points), unknowns=chamber.grid.size)
        for name in chamber.boundaries:
            if name != FREE_SURFACE:
                total += self.wall_load(chamber=chamber, boundary=name)
        return _DiscreteProblem(stiffness=Stiffness.of(chamber), load=total)

    def wall_load(self, *, chamber: ChamberMesh, boundary: str) -> FloatArray:
        """Part of the load that one boundary contributes, int q v, in the mesh's unit of length."""
        unit = chamber.length_scale
        facets = facet_points(chamber, boundary)
        flux = self.wall_flux(unit * facets.points, facets.normals)
        return unit * facets.load(flux, unknowns=chamber.grid.size)


@dataclass(frozen=True, kw_only=True)
class RotatingLiquid:
    """Liquid at rest in the rotating frame, with gravity frozen at one instant of the turn."""

    density: float
    """rho, kg/m^3."""
    angular_velocity: float
    """omega, rad/s."""
    gravity: tuple[float, ...] = ()
    """g in the chamber's axes at this instant, m/s^2, two or three components; empty: left out."""
    gas_pressure: float = 0.0
    """On the free surface, Pa, gauge."""

    def body_force(self, places: FloatArray) -> FloatArray:
        """Force per volume, rho (omega^2 r e_r + g).

        Args: `places`: m, shape (dimension, ...).
        Source: Eq. 9 of the liquid-ring paper, with gravity added.
        """
        force = np.array(places, dtype=np.float64) * self.angular_velocity**2
        force[2:] = 0.0
        for axis, component in enumerate(self.gravity[: len(force)]):
            force[axis] += component
        return self.density * force

    def problem(self) -> PressureProblem:
        """Its right-hand sides: f = 2 rho omega^2, q = rho (omega^2 r e_r + g) . n and the gas pressure."""
        source = 2 * self.density * self.angular_velocity**2
        return PressureProblem(
            source=lambda places: np.full(places.shape[1:], source),
            wall_flux=lambda places, normals: np.einsum("i...,i...->...", self.body_force(places), normals),
            surface_pressure=lambda places: np.full(places.shape[1:], self.gas_pressure),
        )


@dataclass(frozen=True, kw_only=True)
class PressureSolution:
    """Nodal pressure on a mesh, with the flux through its free surface."""

    chamber: ChamberMesh
    pressure: FloatArray
    """At the nodes of `chamber`, Pa, gauge, shape (nodes,)."""
    surface_gradient: FloatArray
    """n . grad p at the nodes of the free surface, Pa/m, n out of the liquid; the shape of
    chamber.grid[0]."""
    status: Status
    statistics: Statistics


@dataclass(frozen=True, kw_only=True)
class _DiscreteProblem:
    """Form and load of the weak problem, before any condition on the free surface; lengths in mesh units."""

    stiffness: Stiffness
    load: FloatArray
    """- int f v + int_walls q v."""

    def solve(self, *, start: FloatArray, pinned_surface: bool) -> LinearSolution:
        """Solve for what is to be added to a starting field.

        Args: `pinned_surface`: whether the nodes of the free surface keep their values; if not, the load must
            be in balance, and what is added has no constant part.
        """
        # The nodes of the free surface are the first.
        first = self.stiffness.chamber.grid[0].size if pinned_surface else 0

        def among_free(form: Form) -> Form:
            return lambda free: form(np.concatenate([np.zeros(first), free]))[first:]

        return solve_form(
            among_free(self.stiffness.apply),
            (self.load - self.stiffness.apply(start))[first:],
            inverse=stiffness_inverse(self.stiffness, pinned_surface=pinned_surface),
            magnitude=among_free(self.stiffness.magnitude),
        )


def solve_pressure(*, chamber: ChamberMesh, problem: PressureProblem) -> PressureSolution:
    """Solve the pressure problem on the mesh of a chamber's liquid.

    int grad p . grad v = - int f v + int_walls q v for all v that vanish on the free surface, p = p_gas
    there.
    Args: `chamber`: mesh, two- or three-dimensional, with its named boundaries. `problem`: right-hand sides;
        `RotatingLiquid.problem` gives the physical ones.
    Returns: The nodal pressure; its status is NOT_CONVERGED when the true residual of the linear system is
        too large.
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem; elements of the mesh's order p,
    of order p + 1 in the pressure and 2 p in integrals of it, as long as the geometry is curved.
    """
    discrete = problem.discretise(chamber=chamber)
    surface = chamber.grid[0].ravel()
    on_surface = problem.surface_pressure(chamber.places[:, surface])
    pressure = np.tile(on_surface, chamber.grid.shape[0])
    linear = discrete.solve(start=pressure, pinned_surface=True)
    pressure[surface.size :] += linear.values
    gradient = _surface_gradient(chamber, discrete, pressure)
    return PressureSolution(
        chamber=chamber,
        pressure=pressure,
        surface_gradient=gradient.values.reshape(chamber.grid[0].shape) / chamber.length_scale,
        status=gradient.status if linear.status.ok else linear.status,
        statistics=linear.statistics,
    )


def _surface_gradient(
    chamber: ChamberMesh, discrete: _DiscreteProblem, pressure: FloatArray
) -> LinearSolution:
    """Flux that balances the weak form on the surface, in mesh units: better than the field's gradient."""
    facets, count = facet_points(chamber, FREE_SURFACE), chamber.grid[0].size
    return solve_form(
        lambda flux: facets.load(facets.at_points(flux), unknowns=count),
        (discrete.stiffness.apply(pressure) - discrete.load)[:count],
        inverse=mass_inverse(facets, cells=chamber.cells[1:], line=gauss_line(chamber.order)),
        magnitude=np.abs,
    )
