"""Pressure of the liquid in a rotating chamber: a Poisson problem with the gas on the free surface.

In the rotating frame liquid at rest obeys grad p = f, f = rho (omega^2 r e_r + g). With p = p_gas on the
free surface the weak form is

    int grad p . grad v = int f . grad v      for all v that vanish on the free surface,

which holds laplace(p) = div f in the liquid and n . grad p = n . f on all walls at once. Manufactured
solutions put their own f and p_gas into the same record, so that they test the same code. The elements
are quadratic ones of scikit-fem on the liquid's meshes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import cg, splu
from skfem import Basis, DiscreteField, ElementTetP2, LinearForm
from skfem.helpers import dot, grad

from ringbalance.mesh.chamber import FREE_SURFACE, ChamberMesh
from ringbalance.physics.cell_mapping import CellMapping, quadrature
from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.registry import registered

MULTIGRID_FROM: Final = 10_000
"""Unknowns in three dimensions above which multigrid costs less than a factorisation."""
_MAX_RESIDUAL: Final = 1e-10
_ROUNDING: Final = 8 * float(np.finfo(np.float64).eps)
"""Residual that a backward-stable solve may leave, over |A| |u| + |b|."""
_MOST_ROUNDING: Final = 1e-6
"""Relative residual above which rounding has cost too many digits to call a system solved."""
_MULTIGRID_STEPS: Final = 500


def quadratic_basis(mesh: Any) -> Any:
    """`skfem.Basis` of the mesh's own quadratic elements.

    Quadrature of order 4 on quadrilaterals and hexahedra: by default scikit-fem takes 343 points in a
    hexahedron, with the same errors.  Of order 2 on tetrahedra: exact for straight ones, of the same order
    for curved ones; that of order 3 has a negative weight.
    """
    rule = quadrature(mesh.refdom, 2 if mesh.elem is ElementTetP2 else 4)
    return Basis(mesh, mesh.elem(), mapping=CellMapping(mesh), quadrature=rule)


def stiffness(basis: Any) -> csr_matrix:
    """Matrix of the integrals of grad u . grad v.

    One matrix product per cell, because a form of scikit-fem calls Python for each pair of functions.
    """
    slopes = np.stack([each[0].grad * np.sqrt(basis.dx) for each in basis.basis])
    rows = np.moveaxis(slopes, 2, 0).reshape(basis.nelems, len(slopes), -1)
    local, numbers = rows @ rows.transpose(0, 2, 1), basis.element_dofs.T
    first, second = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
    entries = (local.ravel(), (first.ravel(), second.ravel()))
    return coo_matrix(entries, shape=(basis.N, basis.N)).tocsr()


@dataclass(frozen=True, kw_only=True, eq=False)
class BoundarySide:
    """Quadrature points of one named boundary of a mesh, in the mesh's unit of length.

    A side is integrated on its own facets: a facet basis of scikit-fem locates each point in its cell by
    Newton's method, at sixty times the cost, and fails in films.
    """

    nodes: IntArray
    """Shape (functions, facets)."""
    values: FloatArray
    """Values of the functions at the points, shape (functions, points)."""
    points: FloatArray
    """Shape (dimension, facets, points)."""
    area: FloatArray
    """Outward normal times weight, the shape of `points`."""

    @cached_property
    def weights(self) -> FloatArray:
        """Shape (facets, points)."""
        return np.asarray(np.linalg.norm(self.area, axis=0))

    @property
    def normals(self) -> FloatArray:
        """Outward unit normals, the shape of `points`."""
        return np.asarray(self.area / self.weights)

    def at_points(self, nodal: FloatArray) -> FloatArray:
        """Values at the points, of a field given at all nodes."""
        return np.asarray(nodal[self.nodes].T @ self.values)

    def load(self, density: FloatArray, *, unknowns: int) -> FloatArray:
        """Vector of the integrals of f v, f given at the points."""
        local = self.values @ (density * self.weights).T
        return np.bincount(self.nodes.ravel(), local.ravel(), unknowns).astype(np.float64)

    def mass(self, *, unknowns: int) -> csr_matrix:
        """Matrix of the integrals of u v."""
        local = np.einsum("iq,jq,fq->ijf", self.values, self.values, self.weights)
        first, second = np.broadcast_arrays(self.nodes[:, None], self.nodes[None])
        entries = (local.ravel(), (first.ravel(), second.ravel()))
        return coo_matrix(entries, shape=(unknowns, unknowns)).tocsr()


def side(mesh: Any, boundary: str) -> BoundarySide:
    """Quadrature points of a named boundary of a mesh of quadratic cells."""
    facets = mesh.boundaries[boundary]
    corners, edges = mesh.facets, mesh.dofs.edge_dofs
    parts = [corners, *([edges[0, mesh.f2e]] if len(edges) else []), mesh.dofs.facet_dofs]
    nodes = np.vstack([part for part in parts if len(part)])[:, facets]
    element = mesh.mapping().bndelem
    points, weights = quadrature(element.refdom, 4)
    functions = [element.lbasis(points, k) for k in range(len(nodes))]
    values = np.stack([value for value, _ in functions])
    # Differences first: a film's depth would cancel in the sums.
    local = mesh.doflocs[:, nodes] - mesh.doflocs[:, nodes[:1]]
    tangents = np.einsum("xnf,ntq->txfq", local, np.stack([slope for _, slope in functions]))
    if len(tangents) == 1:
        area = np.stack([tangents[0, 1], -tangents[0, 0]]) * weights
    else:
        area = np.cross(tangents[0], tangents[1], axis=0) * weights
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1)
    outward = mesh.p[:, corners[:, facets]].mean(axis=1) - inside
    area *= np.sign(np.einsum("xfq,xf->fq", area, outward))
    return BoundarySide(
        nodes=nodes, values=values, points=np.einsum("xnf,nq->xfq", mesh.doflocs[:, nodes], values), area=area
    )


@dataclass(frozen=True, kw_only=True)
class _LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def _solve_linear(matrix: csr_matrix, right: FloatArray, *, multigrid: bool = False) -> _LinearSolution:
    """Solve A u = b for a symmetric positive definite A.

    Args: `multigrid`: conjugate gradients with algebraic multigrid instead of a factorisation; where they
        fail, the factorisation follows.
    Returns: u with the true relative residual |b - A u| / |b|; the status is NOT_CONVERGED when that is above
        1e-10, unless it is rounding, at most 8 eps | |A| |u| + |b| | / |b|, and at most 1e-6: elongated cells
        make terms cancel that are larger than b by the square of their elongation.
    Source: smoothed aggregation of Vanek, Mandel and Brezina (1996), doi:10.1007/BF02238511, through pyamg.
    """
    if multigrid and (solution := _judged(matrix, right, *_by_multigrid(matrix, right))).status.ok:
        return solution
    return _judged(matrix, right, _factorised(matrix, right), 0)


def _factorised(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    # Symmetric mode halves the fill of the default ordering; a positive definite matrix needs no pivoting.
    try:
        factor = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # singular: the residual of zeros says so
        return np.zeros_like(right)
    return np.asarray(factor.solve(right))


def _by_multigrid(matrix: csr_matrix, right: FloatArray) -> tuple[FloatArray, int]:
    steps: list[None] = []
    # No part needs a spectral radius, which pyamg would estimate from random vectors.
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    hierarchy = registered("function", "multigrid")(
        matrix.sorted_indices(),  # in any other order its aggregates differ from run to run
        symmetry="symmetric",
        strength=("symmetric", {"theta": 0.1}),
        smooth=("energy", {"krylov": "cg", "maxiter": 2}),
        presmoother=sweeps,
        postsmoother=sweeps,
        max_coarse=500,
    )
    values, _ = cg(
        matrix,
        right,
        rtol=1e-12,
        maxiter=_MULTIGRID_STEPS,
        M=hierarchy.aspreconditioner(),
        callback=lambda _: steps.append(None),
    )
    return np.asarray(values), len(steps)


def _judged(matrix: csr_matrix, right: FloatArray, values: FloatArray, iterations: int) -> _LinearSolution:
    size = float(np.linalg.norm(right)) or 1.0
    residual = float(np.linalg.norm(right - matrix @ values)) / size
    limit = _MAX_RESIDUAL
    if residual > limit:
        terms = float(np.linalg.norm(abs(matrix) @ np.abs(values) + np.abs(right))) / size
        limit = max(limit, min(_ROUNDING * terms, _MOST_ROUNDING))
    status = Status()
    if not residual <= limit:
        text = (
            f"the linear solve left a relative residual of {residual:.1e}, above {limit:.0e}; "
            "use fewer or less elongated cells"
        )
        status = Status(code=StatusCode.NOT_CONVERGED, text=text)
    statistics = Statistics(unknowns=right.size, iterations=iterations, relative_residual=residual)
    return _LinearSolution(values=values, status=status, statistics=statistics)


@dataclass(frozen=True, kw_only=True)
class PressureProblem:
    """Right-hand sides of the pressure problem, as functions of position; all lengths in metres."""

    force: Callable[[FloatArray], FloatArray]
    """Body force f(x), Pa/m, at points of shape (dimension, ...), in the same shape."""
    surface_pressure: Callable[[FloatArray], FloatArray]
    """Gauge pressure p_gas(x) on the free surface, Pa."""


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
    """Gauge pressure of the gas on the free surface, Pa."""

    def body_force(self, places: FloatArray) -> FloatArray:
        """Force per volume, rho (omega^2 r e_r + g).

        Args: `places`: coordinates, m, shape (dimension, ...).
        Source: Eq. 9 of the liquid-ring paper, with gravity added.
        """
        force = np.array(places, dtype=np.float64) * self.angular_velocity**2
        force[2:] = 0.0
        for axis, component in enumerate(self.gravity[: len(force)]):
            force[axis] += component
        return self.density * force

    def problem(self) -> PressureProblem:
        """Right-hand sides of the pressure problem: the body force and the gas pressure."""
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
    """Gauge pressure at the nodes of `chamber`, Pa, shape (nodes,)."""
    surface_gradient: FloatArray
    """n . grad p at the nodes of the free surface, Pa/m, n out of the liquid; the shape of
    chamber.grid[0]."""
    status: Status
    statistics: Statistics

    def side(self, boundary: str) -> BoundarySide:
        """Quadrature points of one boundary, in the mesh's unit."""
        return side(self.chamber.mesh, boundary)

    def surface_flux(self, surface: BoundarySide) -> FloatArray:
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
        """Assemble the weak form.

        Args: `force`: f, Pa/m, at points in m. `unit`: unit of the mesh's lengths, m.
        """
        field = DiscreteField(unit * force(unit * np.asarray(basis.global_coordinates())))
        return cls(basis=basis, stiffness=stiffness(basis), load=_work.assemble(basis, force=field))

    def solve(self, *, start: FloatArray, fixed: IntArray) -> _LinearSolution:
        """Solve for the values at all nodes, with those of `start` kept at the nodes `fixed`."""
        free = np.setdiff1d(np.arange(start.size), fixed)
        matrix = csr_matrix(self.stiffness[free][:, free])
        right = (self.load - self.stiffness @ start)[free]
        large = self.basis.mesh.dim() == 3 and free.size > MULTIGRID_FROM
        linear = _solve_linear(matrix, right, multigrid=large)
        values = start.copy()
        values[free] += linear.values
        return _LinearSolution(values=values, status=linear.status, statistics=linear.statistics)


@LinearForm  # type: ignore[untyped-decorator]  # scikit-fem has no types
def _work(v: Any, w: Any) -> Any:
    return dot(w.force, grad(v))


def solve_on(basis: Any, problem: PressureProblem) -> _LinearSolution:
    """Nodal pressure, Pa, on any mesh of the liquid that names its free surface, lengths in m.

    Args: `basis`: of `quadratic_basis`.
    Source: quadratic elements, order three in the pressure and four in its integrals.
    """
    return _solved(WeakProblem.of(basis, problem.force), problem, 1.0)


def _solved(weak: WeakProblem, problem: PressureProblem, unit: float) -> _LinearSolution:
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
) -> _LinearSolution:
    """Flux that balances the weak form on the surface: better than the field's gradient.

    int_surface (n . grad p - n . f) v = int (grad p - f) . grad v.
    """
    unit, surface, nodes = chamber.length_scale, side(chamber.mesh, FREE_SURFACE), chamber.grid[0].ravel()
    force = np.sum(problem.force(unit * surface.points) * surface.normals, axis=0)
    rest = (weak.stiffness @ pressure - weak.load) / unit + surface.load(force, unknowns=pressure.size)
    mass = surface.mass(unknowns=pressure.size)
    return _solve_linear(csr_matrix(mass[nodes][:, nodes]), rest[nodes])
