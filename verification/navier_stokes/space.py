"""Taylor-Hood space on a straight or curved mesh, with its quadrature tables contracted once.

Velocity is quadratic, pressure linear, both continuous.  Every element matrix of a flow problem is a sum over
quadrature points of a coefficient times a product of reference shape functions that is the same in all
elements: tabulated once, the assembly of all elements is one matrix product per block.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from skfem import (
    Basis,
    ElementHex1,
    ElementHex2,
    ElementQuad1,
    ElementQuad2,
    ElementTetP1,
    ElementTetP2,
    ElementTriP1,
    ElementTriP2,
)

from ringbalance.scene.arrays import FloatArray, IntArray

_PAIRS = {
    "RefTri": (ElementTriP2, ElementTriP1, 6),
    "RefQuad": (ElementQuad2, ElementQuad1, 6),
    "RefTet": (ElementTetP2, ElementTetP1, 6),
    "RefHex": (ElementHex2, ElementHex1, 6),
}


def _scattered(where: IntArray, values: FloatArray, size: int) -> FloatArray:
    """Sums of values that share a place."""
    return np.asarray(np.bincount(where, weights=values.ravel(), minlength=size), dtype=np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class _ScalarPattern:
    """Where the entries of a scalar element matrix go in its assembled matrix."""

    rows: IntArray
    cols: IntArray
    slot: IntArray
    """Number of the assembled entry for every element entry, shape (elements * rows * cols,)."""

    def assemble(self, element_matrices: FloatArray) -> FloatArray:
        """Sum element matrices, shape (elements, rows * cols), into the entries of the assembled matrix."""
        return _scattered(self.slot, element_matrices, self.rows.size)


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSpace:
    """A Taylor-Hood space: unknowns are the velocity components one after the other, then the pressure."""

    mesh: Any
    velocity: Any
    """Scalar quadratic `skfem` basis of one velocity component."""
    pressure: Any
    """Scalar linear `skfem` basis."""
    components: int
    """Velocity components; those beyond the mesh's dimension are normal to it."""
    axisymmetric: bool
    """Coordinates are (x, r), components (u_x, u_r), integrals carry the weight r (no 2 pi)."""
    weights: FloatArray
    """Quadrature weight times Jacobian (times r), shape (elements, points)."""
    inverse: FloatArray
    """d(reference k)/d(x_d), shape (k, d, elements, points)."""
    points: FloatArray
    """Coordinates of the quadrature points, shape (dimension, elements, points)."""
    shape: FloatArray
    """Velocity shape functions, shape (local, points)."""
    slope: FloatArray
    """Their reference derivatives, shape (k, local, points)."""
    pressure_shape: FloatArray
    """Pressure shape functions, shape (local, points)."""
    velocity_pattern: _ScalarPattern
    coupling_pattern: _ScalarPattern
    """Rows pressure, columns velocity."""

    @classmethod
    def taylor_hood(
        cls, *, mesh: Any, components: int | None = None, axisymmetric: bool = False
    ) -> FlowSpace:
        """Taylor-Hood space of a mesh: quadratic velocity, linear pressure.

        Args: `mesh`: scikit-fem mesh of triangles, quadrilaterals, tetrahedra or hexahedra, straight or
            quadratic. `components`: velocity components, at least the mesh's dimension; default equal to it.
            `axisymmetric`: read the coordinates as (x, r) and the components as (u_x, u_r).
        Raises: ValueError: fewer components than dimensions, or an axisymmetric mesh that is not plane.
        Source: Taylor and Hood, Comput. Fluids 1 (1973) 73.
        """
        count = mesh.dim() if components is None else components
        if count < mesh.dim() or (axisymmetric and (mesh.dim() != 2 or count != 2)):
            raise ValueError(
                "components must reach the mesh's dimension, and be 2 on a plane mesh if axisymmetric"
            )
        high, low, order = _PAIRS[mesh.refdom.__name__]
        velocity = Basis(mesh, high(), intorder=order)
        pressure = Basis(mesh, low(), intorder=order)
        local = np.asarray(velocity.X, dtype=np.float64)
        shape, slope = _tables(velocity.elem, local, velocity.Nbfun)
        points = np.asarray(velocity.mapping.F(local), dtype=np.float64)
        weights = np.abs(velocity.mapping.detDF(local)) * velocity.W
        return cls(
            mesh=mesh,
            velocity=velocity,
            pressure=pressure,
            components=count,
            axisymmetric=axisymmetric,
            weights=weights * points[1] if axisymmetric else weights,
            inverse=np.asarray(velocity.mapping.invDF(local), dtype=np.float64),
            points=points,
            shape=shape,
            slope=slope,
            pressure_shape=_tables(pressure.elem, local, pressure.Nbfun)[0],
            velocity_pattern=_pattern(velocity.element_dofs, velocity.element_dofs, velocity.N),
            coupling_pattern=_pattern(pressure.element_dofs, velocity.element_dofs, velocity.N),
        )

    @property
    def dimension(self) -> int:
        """Of the mesh."""
        return int(self.inverse.shape[0])

    @property
    def velocity_nodes(self) -> int:
        """Unknowns of one velocity component."""
        return int(self.velocity.N)

    @property
    def pressure_nodes(self) -> int:
        """Unknowns of the pressure."""
        return int(self.pressure.N)

    @property
    def unknowns(self) -> int:
        """Velocity and pressure unknowns, boundary values included."""
        return self.components * self.velocity_nodes + self.pressure_nodes

    def boundary_nodes(self, name: str) -> IntArray:
        """Velocity nodes on a named boundary. Raises: ValueError: the mesh has no such boundary."""
        if name not in (self.mesh.boundaries or {}):
            known = ", ".join(sorted(self.mesh.boundaries or {}))
            raise ValueError(f"the mesh has no boundary {name!r}; it has: {known}")
        return np.asarray(self.velocity.get_dofs(name).flatten(), dtype=np.int64)

    def node_coordinates(self) -> FloatArray:
        """Coordinates of the velocity nodes. Returns: Shape (dimension, nodes)."""
        return np.asarray(self.velocity.doflocs, dtype=np.float64)

    def mass_table(self) -> FloatArray:
        """Table of N_i N_j. Returns: Shape (points, local * local)."""
        return _outer(self.shape[None], self.shape[None])

    def convection_table(self) -> FloatArray:
        """Table of N_i dN_j/dX_k. Returns: Shape (points * k, local * local)."""
        return _outer(self.shape[None], self.slope)

    def mass_entries(self, coefficient: FloatArray) -> FloatArray:
        """Assembled entries of integral(coefficient N_i N_j), the coefficient of shape (elements, points)."""
        return self.velocity_pattern.assemble(_contract(self.weights * coefficient, self.mass_table()))

    def stiffness_entries(self) -> FloatArray:
        """Assembled entries of integral(grad N_i . grad N_j)."""
        metric = np.einsum("eq,kdeq,ldeq->kleq", self.weights, self.inverse, self.inverse)
        return self.velocity_pattern.assemble(_contract(metric, _outer(self.slope, self.slope)))

    def cross_entries(self, row: int, col: int) -> FloatArray:
        """Assembled entries of integral(dN_i/dx_col dN_j/dx_row), the stress form's transposed gradient."""
        product = np.einsum("eq,keq,leq->kleq", self.weights, self.inverse[:, col], self.inverse[:, row])
        return self.velocity_pattern.assemble(_contract(product, _outer(self.slope, self.slope)))

    def divergence_entries(self, component: int) -> FloatArray:
        """Assembled entries of integral(psi_i dN_j/dx_component), plus psi_i N_j / r for u_r in (x, r)."""
        coefficient = self.weights * self.inverse[:, component]
        entries = _contract(coefficient, _outer(self.pressure_shape[None], self.slope))
        if self.axisymmetric and component == 1:
            table = _outer(self.pressure_shape[None], self.shape[None])
            entries = entries + _contract(self.weights / self.points[1], table)
        return self.coupling_pattern.assemble(entries)

    def pressure_mass_entries(self) -> FloatArray:
        """Assembled entries of integral(psi_i N_j), pressure against velocity shape functions."""
        table = _outer(self.pressure_shape[None], self.shape[None])
        return self.coupling_pattern.assemble(_contract(self.weights, table))

    def load_vector(self, values: FloatArray) -> FloatArray:
        """Integral of a function against every velocity shape function."""
        local = (self.weights * values) @ self.shape.T
        return _scattered(self.velocity.element_dofs.T.ravel(), local, self.velocity_nodes)

    def pressure_load(self) -> FloatArray:
        """Integral of every pressure shape function. Returns: Shape (pressure nodes,)."""
        local = self.weights @ self.pressure_shape.T
        return _scattered(self.pressure.element_dofs.T.ravel(), local, self.pressure_nodes)

    def at_points(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity and its gradient at the quadrature points, from nodal values (components, velocity nodes).

        Returns: u of shape (components, elements, points), and du_c/dx_d of shape (c, d, elements, points).
        """
        local = velocity[:, self.velocity.element_dofs.T]
        reference = np.einsum("cei,kiq->ckeq", local, self.slope, optimize=True)
        return local @ self.shape, np.einsum("ckeq,kdeq->cdeq", reference, self.inverse, optimize=True)

    def nodal(self, function: Callable[[FloatArray], FloatArray] | float) -> FloatArray:
        """Values at the velocity nodes of a constant, or of a function of coordinates (dimension, n)."""
        at = self.node_coordinates()
        values = function(at) if callable(function) else function
        return np.broadcast_to(np.asarray(values, dtype=np.float64), at.shape[1]).copy()

    def split(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity (components, velocity nodes) and pressure (pressure nodes,) of a full vector."""
        velocity = vector[: self.components * self.velocity_nodes]
        return velocity.reshape(self.components, -1), vector[velocity.size :]


def _pattern(row_dofs: IntArray, col_dofs: IntArray, columns: int) -> _ScalarPattern:
    rows = np.repeat(row_dofs.T[:, :, None], col_dofs.shape[0], axis=2)
    cols = np.repeat(col_dofs.T[:, None, :], row_dofs.shape[0], axis=1)
    key = rows.astype(np.int64).ravel() * columns + cols.ravel()
    unique, slot = np.unique(key, return_inverse=True)
    return _ScalarPattern(rows=unique // columns, cols=unique % columns, slot=slot.ravel().astype(np.int64))


def _tables(element: Any, points: FloatArray, local: int) -> tuple[FloatArray, FloatArray]:
    pairs = [element.lbasis(points, i) for i in range(local)]
    shape = np.stack([np.broadcast_to(phi, points.shape[1]) for phi, _ in pairs])
    slope = np.stack([np.broadcast_to(dphi, points.shape) for _, dphi in pairs], axis=1)
    return shape.astype(np.float64), slope.astype(np.float64)


def _outer(left: FloatArray, right: FloatArray) -> FloatArray:
    """Products of shape tables, (..., i, q) with (..., j, q), as a table (q * leading, i * j)."""
    product = np.einsum("aiq,bjq->qabij", left, right)
    q, a, b, i, j = product.shape
    return np.ascontiguousarray(product.reshape(q * a * b, i * j))


def _contract(coefficient: FloatArray, table: FloatArray) -> FloatArray:
    """Coefficients of shape (..., elements, points) against a table whose rows run over (points, ...)."""
    moved = np.moveaxis(np.moveaxis(coefficient, -1, 0), -1, 0)
    return moved.reshape(moved.shape[0], -1) @ table
