"""The pressure of the liquid in a chamber that turns: a Poisson problem with the gas on its free surface.

In the rotating frame liquid at rest obeys grad p = f, f = rho (omega^2 r e_r + g).  With p = p_gas on the
free surface the weak form is

    int grad p . grad v = int f . grad v      for all v that vanish on the free surface,

which holds laplace(p) = div f in the liquid and n . grad p = n . f on all walls at once.  Manufactured
solutions put their own f and p_gas into the same record, so they run through the same lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from skfem import DiscreteField, LinearForm
from skfem.helpers import dot, grad

from ringbalance.mesh.chamber import FREE_SURFACE, ChamberMesh
from ringbalance.physics.pressure.elements import (
    MULTIGRID_FROM,
    LinearSolution,
    Side,
    quadratic_basis,
    side,
    solve_linear,
    stiffness,
)
from ringbalance.physics.results import Statistics, Status
from ringbalance.scene.arrays import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class PressureProblem:
    """Right-hand sides of the pressure problem, as functions of the place; all lengths in metres."""

    force: Callable[[FloatArray], FloatArray]
    """f(x), Pa/m, from places of shape (dimension, ...), in their shape."""
    surface_pressure: Callable[[FloatArray], FloatArray]
    """p_gas(x), Pa, gauge."""


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
        """Its right-hand sides: the body force and the gas pressure."""
        return PressureProblem(
            force=self.body_force,
            surface_pressure=lambda places: np.full(places.shape[1:], self.gas_pressure),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureSolution:
    """Nodal pressure on a chamber's mesh, with the flux through its free surface."""

    chamber: ChamberMesh
    basis: Any
    """`skfem.Basis` of the quadratic elements on it, lengths in the mesh's unit."""
    pressure: FloatArray
    """At the nodes of `chamber`, Pa, gauge, shape (nodes,)."""
    surface_gradient: FloatArray
    """n . grad p at the nodes of the free surface, Pa/m, n out of the liquid; the shape of
    chamber.grid[0]."""
    status: Status
    statistics: Statistics

    def side(self, boundary: str) -> Side:
        """Quadrature points of one boundary, in the mesh's unit."""
        return side(self.chamber.mesh, boundary)

    def surface_flux(self, surface: Side) -> FloatArray:
        """n . grad p at the points of the free surface, Pa/m."""
        nodal = np.zeros(self.pressure.size)
        nodal[self.chamber.grid[0]] = self.surface_gradient
        return surface.at_points(nodal)


@dataclass(frozen=True, kw_only=True, eq=False)
class WeakProblem:
    """Matrix and load of the weak form on one mesh, before any condition on the free surface."""

    basis: Any
    stiffness: csr_matrix
    load: FloatArray

    @classmethod
    def of(cls, basis: Any, force: Callable[[FloatArray], FloatArray], *, unit: float = 1.0) -> WeakProblem:
        """Args: `force`: f, Pa/m, at places in m. `unit`: of the mesh's lengths, m."""
        field = DiscreteField(unit * force(unit * np.asarray(basis.global_coordinates())))
        return cls(basis=basis, stiffness=stiffness(basis), load=_work.assemble(basis, force=field))

    def solve(self, *, start: FloatArray, fixed: IntArray) -> LinearSolution:
        """Solve with the values of `start` kept at some nodes; the solution at all nodes."""
        free = np.setdiff1d(np.arange(start.size), fixed)
        matrix = csr_matrix(self.stiffness[free][:, free])
        right = (self.load - self.stiffness @ start)[free]
        large = self.basis.mesh.dim() == 3 and free.size > MULTIGRID_FROM
        linear = solve_linear(matrix, right, multigrid=large)
        values = start.copy()
        values[free] += linear.values
        return LinearSolution(values=values, status=linear.status, statistics=linear.statistics)


@LinearForm  # type: ignore[untyped-decorator]  # scikit-fem has no types
def _work(v: Any, w: Any) -> Any:
    return dot(w.force, grad(v))


def solve_on(basis: Any, problem: PressureProblem, *, unit: float = 1.0) -> LinearSolution:
    """Nodal pressure, Pa, on any mesh of the liquid that names its free surface.

    Args: `basis`: of `quadratic_basis`. `unit`: of the mesh's lengths, m.
    Source: quadratic elements, order three in the pressure and four in its integrals.
    """
    return _solved(WeakProblem.of(basis, problem.force, unit=unit), problem, unit)


def _solved(weak: WeakProblem, problem: PressureProblem, unit: float) -> LinearSolution:
    surface = weak.basis.get_dofs(FREE_SURFACE).all()
    places = unit * weak.basis.mesh.doflocs[:, surface]
    # From one value everywhere, or a film's small differences would cancel.
    start = np.full(weak.basis.N, problem.surface_pressure(places).mean())
    start[surface] = problem.surface_pressure(places)
    return weak.solve(start=start, fixed=surface)


def solve_pressure(
    *, chamber: ChamberMesh, problem: PressureProblem, basis: Any | None = None
) -> PressureSolution:
    """Solve the pressure problem on the mesh of a chamber's liquid.

    Args:
        chamber: mesh, two- or three-dimensional, with its named boundaries.
        problem: right-hand sides; `RotatingLiquid.problem` gives the physical ones.
        basis: of `quadratic_basis` on this mesh, if there is one already.
    Returns: The nodal pressure; its status is NOT_CONVERGED when the true residual of the linear system is
        too large.
    Source: Eqs. 9 to 11 of the liquid-ring paper as a boundary-value problem; quadratic elements, order three
    in the pressure and four in integrals of it.
    """
    unit = chamber.length_scale
    weak = WeakProblem.of(basis or quadratic_basis(chamber.mesh), problem.force, unit=unit)
    linear = _solved(weak, problem, unit)
    gradient = _surface_gradient(chamber, weak, problem, linear.values)
    return PressureSolution(
        chamber=chamber,
        basis=weak.basis,
        pressure=linear.values,
        surface_gradient=gradient.values.reshape(chamber.grid[0].shape),
        status=gradient.status if linear.status.ok else linear.status,
        statistics=linear.statistics,
    )


def _surface_gradient(
    chamber: ChamberMesh, weak: WeakProblem, problem: PressureProblem, pressure: FloatArray
) -> LinearSolution:
    """Flux that balances the weak form on the surface: better than the field's gradient.

    int_surface (n . grad p - n . f) v = int (grad p - f) . grad v.
    """
    unit, surface, nodes = chamber.length_scale, side(chamber.mesh, FREE_SURFACE), chamber.grid[0].ravel()
    force = np.sum(problem.force(unit * surface.points) * surface.normals, axis=0)
    rest = (weak.stiffness @ pressure - weak.load) / unit + surface.load(force, unknowns=pressure.size)
    mass = surface.mass(unknowns=pressure.size)
    return solve_linear(csr_matrix(mass[nodes][:, nodes]), rest[nodes])
