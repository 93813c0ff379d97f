"""Quadratic elements of scikit-fem on the liquid's meshes: stiffness, named sides, and the linear solve."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import pyamg
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import cg, splu
from skfem import Basis, ElementTetP2
from skfem.quadrature import get_quadrature

from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray, IntArray

MULTIGRID_FROM: Final = 10_000
"""Unknowns in three dimensions above which multigrid costs less than a factorisation."""
_ACCEPTED: Final = 1e-10
_ROUNDING: Final = 8 * float(np.finfo(np.float64).eps)
"""Of |A| |u| + |b|, that a backward-stable solve may leave of the residual."""
_MOST_ROUNDING: Final = 1e-6
"""Relative residual above which rounding has cost too many digits to call a system solved."""
_MOST_STEPS: Final = 500


def quadratic_basis(mesh: Any) -> Any:
    """`skfem.Basis` of the mesh's own quadratic elements.

    Quadrature of order 4 on quadrilaterals and hexahedra: by default scikit-fem takes 343 points in a
    hexahedron, with the same errors.  Of order 2 on tetrahedra: exact for straight ones, of the same order
    for curved ones; that of order 3 has a negative weight.
    """
    return Basis(mesh, mesh.elem(), intorder=2 if mesh.elem is ElementTetP2 else 4)


def stiffness(basis: Any) -> csr_matrix:
    """Matrix of the integrals of grad u . grad v.

    By one product a cell: a form of scikit-fem calls Python for each pair of functions.
    """
    slopes = np.stack([each[0].grad * np.sqrt(basis.dx) for each in basis.basis])
    rows = np.moveaxis(slopes, 2, 0).reshape(basis.nelems, len(slopes), -1)
    local, numbers = rows @ rows.transpose(0, 2, 1), basis.element_dofs.T
    first, second = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
    entries = (local.ravel(), (first.ravel(), second.ravel()))
    return coo_matrix(entries, shape=(basis.N, basis.N)).tocsr()


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """Quadrature points of one named boundary of a mesh, in the mesh's unit of length.

    A side is integrated on its own facets: a facet basis of scikit-fem looks for each point in its cell by
    Newton's method, at sixty times the cost, and not in films.
    """

    nodes: IntArray
    """Shape (functions, facets)."""
    values: FloatArray
    """Of the functions at the points, shape (functions, points)."""
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
        """Values at the points of a field given at all nodes."""
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


def side(mesh: Any, boundary: str) -> Side:
    """A boundary of a mesh of quadratic cells, by its name."""
    facets = mesh.boundaries[boundary]
    corners, edges = mesh.facets, mesh.dofs.edge_dofs
    parts = [corners, *([edges[0, mesh.f2e]] if len(edges) else []), mesh.dofs.facet_dofs]
    nodes = np.vstack([part for part in parts if len(part)])[:, facets]
    element = mesh.mapping().bndelem
    points, weights = get_quadrature(element.refdom, 4)
    functions = [element.lbasis(points, k) for k in range(len(nodes))]
    values = np.stack([value for value, _ in functions])
    # Differences first: a film's depth would cancel in the sums.
    local = mesh.doflocs[:, nodes] - mesh.doflocs[:, nodes[:1]]
    tangents = np.einsum("xnf,ntq->txfq", local, np.stack([slope for _, slope in functions]))
    area = _normal(tangents) * weights
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1)
    outward = mesh.p[:, corners[:, facets]].mean(axis=1) - inside
    area *= np.sign(np.einsum("xfq,xf->fq", area, outward))
    return Side(
        nodes=nodes, values=values, points=np.einsum("xnf,nq->xfq", mesh.doflocs[:, nodes], values), area=area
    )


def _normal(tangents: FloatArray) -> FloatArray:
    if len(tangents) == 1:
        return np.stack([tangents[0, 1], -tangents[0, 0]])
    return np.cross(tangents[0], tangents[1], axis=0)


@dataclass(frozen=True, kw_only=True)
class LinearSolution:
    """Solution of one linear system."""

    values: FloatArray
    """Shape (unknowns,)."""
    status: Status
    statistics: Statistics


def solve_linear(matrix: csr_matrix, right: FloatArray, *, multigrid: bool = False) -> LinearSolution:
    """Solve A u = b for a symmetric positive definite A.

    Args: `multigrid`: conjugate gradients with algebraic multigrid instead of a factorisation; where they
        fail, the factorisation follows.
    Returns: u with the true relative residual |b - A u| / |b|; the status is NOT_CONVERGED when that is above
        1e-10, unless it is rounding, at most 8 eps | |A| |u| + |b| | / |b|, and at most 1e-6: elongated cells
        make terms cancel that are larger than b by the square of their elongation.
    Source: smoothed aggregation of Vanek, Mandel and Brezina (1996), doi:10.1007/BF02238511, through pyamg.
    """
    if multigrid and (found := _judged(matrix, right, *_by_multigrid(matrix, right))).status.ok:
        return found
    return _judged(matrix, right, _factorised(matrix, right), 0)


def _factorised(matrix: csr_matrix, right: FloatArray) -> FloatArray:
    # Symmetric mode halves the fill of the default ordering; a positive definite matrix needs no pivoting.
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # singular: the residual of zeros says so
        return np.zeros_like(right)
    return np.asarray(factor.solve(right))


def _by_multigrid(matrix: csr_matrix, right: FloatArray) -> tuple[FloatArray, int]:
    steps: list[None] = []
    # No part needs a spectral radius, which pyamg would estimate from random vectors.
    sweeps = ("gauss_seidel", {"sweep": "symmetric"})
    hierarchy = pyamg.smoothed_aggregation_solver(
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
        maxiter=_MOST_STEPS,
        M=hierarchy.aspreconditioner(),
        callback=lambda _: steps.append(None),
    )
    return np.asarray(values), len(steps)


def _judged(matrix: csr_matrix, right: FloatArray, values: FloatArray, iterations: int) -> LinearSolution:
    size = float(np.linalg.norm(right)) or 1.0
    residual = float(np.linalg.norm(right - matrix @ values)) / size
    limit = _ACCEPTED
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
    return LinearSolution(values=values, status=status, statistics=statistics)
