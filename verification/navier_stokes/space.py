"""Taylor-Hood space by scikit-fem on a straight or curved mesh: quadratic velocity, linear pressure.

Unknowns are the velocity components one after the other, then the pressure.
Source: Taylor and Hood, Comput. Fluids 1 (1973) 73.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from skfem import (
    Basis,
    BilinearForm,
    ElementHex1,
    ElementHex2,
    ElementQuad1,
    ElementQuad2,
    ElementTetP1,
    ElementTetP2,
    ElementTriP1,
    ElementTriP2,
    LinearForm,
)

from ringbalance.scene.arrays import FloatArray, IntArray

_PAIRS = {
    "RefTri": (ElementTriP2, ElementTriP1),
    "RefQuad": (ElementQuad2, ElementQuad1),
    "RefTet": (ElementTetP2, ElementTetP1),
    "RefHex": (ElementHex2, ElementHex1),
}
_ORDER = 6
"""Of the quadrature: exact for two quadratic functions and a quadratic coefficient on straight cells."""


def _mass(u: Any, v: Any, w: Any) -> Any:
    return w.measure * u * v


def _load(v: Any, w: Any) -> Any:
    return w.measure * v


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSpace:
    """A Taylor-Hood space on a straight or curved mesh; made by `FlowSpace.taylor_hood`."""

    mesh: Any
    velocity: Any
    """Scalar quadratic basis of one velocity component."""
    pressure: Any
    """Scalar linear basis."""
    components: int
    """Velocity components; those beyond the mesh's dimension are normal to it."""
    axisymmetric: bool
    """Coordinates are (x, r), components (u_x, u_r), integrals carry the weight r (no 2 pi)."""
    points: FloatArray
    """Coordinates of the quadrature points, shape (dimension, elements, points)."""
    measure: FloatArray
    """r for axisymmetric coordinates, else 1, shape (elements, points)."""

    @classmethod
    def taylor_hood(
        cls, *, mesh: Any, components: int | None = None, axisymmetric: bool = False
    ) -> FlowSpace:
        """Taylor-Hood space of a mesh of triangles, quadrilaterals, tetrahedra or hexahedra.

        Args: `components`: velocity components, at least the mesh's dimension; default equal to it.
        Raises: ValueError: fewer components than dimensions, or an axisymmetric mesh that is not plane.
        """
        count = mesh.dim() if components is None else components
        if count < mesh.dim() or (axisymmetric and (mesh.dim() != 2 or count != 2)):
            raise ValueError(
                "components must reach the mesh's dimension, and be 2 on a plane mesh if axisymmetric"
            )
        quadratic, linear = _PAIRS[mesh.refdom.__name__]
        velocity = Basis(mesh, quadratic(), intorder=_ORDER)
        points = np.array(velocity.global_coordinates(), dtype=np.float64)
        return cls(
            mesh=mesh,
            velocity=velocity,
            pressure=Basis(mesh, linear(), intorder=_ORDER),
            components=count,
            axisymmetric=axisymmetric,
            points=points,
            measure=points[1] if axisymmetric else np.ones(points.shape[1:]),
        )

    @cached_property
    def weights(self) -> FloatArray:
        """Quadrature weight times Jacobian (times r), shape (elements, points)."""
        return np.asarray(self.velocity.dx * self.measure, dtype=np.float64)

    @cached_property
    def shape(self) -> FloatArray:
        """Velocity shape functions at the quadrature points, shape (local, points)."""
        return _shape_functions(self.velocity)

    @cached_property
    def pressure_shape(self) -> FloatArray:
        """Pressure shape functions at the quadrature points, shape (local, points)."""
        return _shape_functions(self.pressure)

    @property
    def dimension(self) -> int:
        """Of the mesh."""
        return int(self.mesh.dim())

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

    def mass(self, coefficient: FloatArray | float = 1.0) -> Any:
        """Matrix of integral(coefficient N_i N_j), the coefficient of shape (elements, points)."""
        products = np.einsum("iq,jq->qij", self.shape, self.shape)
        local = (self.weights * coefficient) @ products.reshape(products.shape[0], -1)
        return _assembled(self.velocity, local.reshape(-1, *products.shape[1:]))

    def pressure_mass(self, coefficient: FloatArray | float = 1.0) -> Any:
        """Matrix of integral(coefficient psi_i N_j), pressure against velocity shape functions."""
        measure = self.measure * coefficient
        return BilinearForm(_mass).assemble(self.velocity, self.pressure, measure=measure)

    def convection(self, carrier: FloatArray) -> Any:
        """Matrix of integral(N_i carrier . grad N_j), the carrier of shape (dimension, elements, points)."""
        along = np.stack([(carrier * fields[0].grad).sum(axis=0) for fields in self.velocity.basis], axis=-1)
        return _assembled(self.velocity, self.shape @ (self.weights[:, :, None] * along))

    def load(self, values: FloatArray | float = 1.0) -> FloatArray:
        """Integral of a function, shape (elements, points), against every velocity shape function."""
        return np.asarray(
            LinearForm(_load).assemble(self.velocity, measure=self.measure * values), dtype=np.float64
        )

    def pressure_load(self) -> FloatArray:
        """Integral of every pressure shape function. Returns: Shape (pressure nodes,)."""
        return np.asarray(LinearForm(_load).assemble(self.pressure, measure=self.measure), dtype=np.float64)

    def at_points(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity and its gradient at the quadrature points, from nodal values (components, velocity nodes).

        Returns: u of shape (components, elements, points), and du_c/dx_d of shape (c, d, elements, points).
        """
        fields = [self.velocity.interpolate(component) for component in velocity]
        return np.stack([np.asarray(field) for field in fields]), np.stack([field.grad for field in fields])

    def nodal(self, function: Callable[[FloatArray], FloatArray] | float) -> FloatArray:
        """Values at the velocity nodes of a constant, or of a function of coordinates (dimension, n)."""
        at = self.node_coordinates()
        values = function(at) if callable(function) else function
        return np.broadcast_to(np.asarray(values, dtype=np.float64), at.shape[1]).copy()

    def split(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity (components, velocity nodes) and pressure (pressure nodes,) of a full vector."""
        velocity = vector[: self.components * self.velocity_nodes]
        return velocity.reshape(self.components, -1), vector[velocity.size :]


def _shape_functions(basis: Any) -> FloatArray:
    pairs = [basis.elem.lbasis(basis.X, i)[0] for i in range(basis.Nbfun)]
    return np.stack([np.broadcast_to(values, basis.X.shape[1]) for values in pairs]).astype(np.float64)


def _assembled(basis: Any, local: FloatArray) -> Any:
    """CSR matrix of element matrices, shape (elements, local, local)."""
    dofs = basis.element_dofs.T
    rows = np.broadcast_to(dofs[:, :, None], local.shape).ravel()
    columns = np.broadcast_to(dofs[:, None, :], local.shape).ravel()
    return sparse.coo_matrix((local.ravel(), (rows, columns)), shape=(basis.N, basis.N)).tocsr()
