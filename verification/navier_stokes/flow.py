"""A steady laminar flow with fixed boundary conditions, by scikit-fem's forms.

    inertia (u . grad) u + rotation u = -grad p + viscosity lap u + f + G e,    div u = 0

on a Taylor-Hood space (Comput. Fluids 1 (1973) 73): quadratic velocity, linear pressure, curved cells.
Unknowns are the velocity components one after the other, then the pressure.  Coefficients are chosen at solve
time, so one system serves a whole sweep: density and dynamic viscosity in SI, or 1 and 1/Re, or Re and 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from scipy import sparse
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, ElementQuad1, ElementQuad2, LinearForm
from skfem.helpers import dot, grad

from ringbalance.scene.arrays import FloatArray, IntArray

_QUADRATURE_ORDER = 6
"""Order that integrates two quadratic functions and a quadratic coefficient exactly on straight cells."""

_mass = BilinearForm(lambda u, v, w: w.factor * u * v)
_load = LinearForm(lambda v, w: w.factor * v)
_carried = BilinearForm(lambda u, v, w: v * dot(w.carrier, grad(u)))
_stiffness = BilinearForm(lambda u, v, _: dot(grad(u), grad(v)))
_transposed = BilinearForm(lambda u, v, w: grad(v)[w.column] * grad(u)[w.row])
_slope = BilinearForm(lambda u, q, w: grad(u)[w.direction] * q)


@dataclass(frozen=True, kw_only=True)
class Dirichlet:
    """A velocity component given on a named boundary; later conditions overrule earlier ones."""

    boundary: str
    component: int
    value: float | Callable[[FloatArray], FloatArray] = 0.0
    """Constant, or function of coordinates, shape (dimension, n)."""


@dataclass(frozen=True, kw_only=True)
class Coefficients:
    """Coefficients of the momentum equation."""

    inertia: float = 1.0
    viscosity: float = 1.0
    rotation: npt.ArrayLike | None = None
    """Matrix of shape (components, components), twice the cross product with the angular velocity."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSystem:
    """Operators, numbering and boundary data of one flow problem; made by `FlowSystem.of`."""

    velocity: Any
    """Scalar quadratic basis of one velocity component; its `dx` carries the weight r in (x, r)."""
    pressure: Any
    """Scalar linear basis of the pressure, with the same weight."""
    components: int
    """Velocity components; those beyond the mesh's dimension are normal to it."""
    enclosed: bool
    """True if no boundary fixes the pressure level: it is pinned at a node, and its mean set to zero."""
    free: IntArray
    """Indices of the unknowns that are solved for."""
    fixed_values: FloatArray
    """Full vector with the boundary values, zero elsewhere."""
    source: FloatArray
    """Body force, full vector."""
    flow_load: FloatArray | None
    """Integral of every shape function of the component whose flow rate is prescribed, full vector."""
    mean_load: FloatArray
    """Integral of every pressure shape function, shape (pressure nodes,)."""
    viscous: Any
    """Viscous term between all velocity unknowns."""
    mass: Any
    """Mass matrix of one component."""
    gradient: Any
    """Pressure gradient in the velocity rows; its transpose is continuity."""

    @classmethod
    def of(
        cls,
        *,
        mesh: Any,
        conditions: Sequence[Dirichlet],
        components: int | None = None,
        axisymmetric: bool = False,
        enclosed: bool = False,
        flow_component: int | None = None,
        body_force: Callable[[FloatArray], FloatArray] | None = None,
        stress_form: bool = False,
    ) -> Self:
        """Operators and numbering of a flow problem, to be solved for any coefficients.

        Args:
            mesh: quadrilaterals or hexahedra with named boundaries, straight or curved.
            conditions: velocity boundary values; a boundary without them is free: zero traction in the stress
                form, viscosity du/dn = p n otherwise.
            components: velocity components, at least the mesh's dimension; default equal to it.
            axisymmetric: coordinates are (x, r), components (u_x, u_r), integrals carry the weight r.
            enclosed: true when no boundary is free in its normal direction: pressure up to a constant.
            flow_component: component whose integral over the domain is prescribed when solved, through a
                uniform driving gradient in it; None for none.
            body_force: of coordinates (dimension, elements, points), giving (components, elements, points).
            stress_form: viscous term with the transposed gradient, needed for the torque on a moving wall.
        """
        count, order = components or mesh.dim(), {"intorder": _QUADRATURE_ORDER}
        quadratic, linear = (ElementQuad2, ElementQuad1) if mesh.dim() == 2 else (ElementHex2, ElementHex1)
        velocity, pressure = Basis(mesh, quadratic(), **order), Basis(mesh, linear(), **order)
        if axisymmetric:
            for basis in (velocity, pressure):
                basis.dx = basis.dx * np.asarray(basis.global_coordinates())[1]
        size = count * velocity.N + pressure.N
        values, fixed = np.zeros(size), np.zeros(size, dtype=bool)
        for condition in conditions:
            nodes = velocity.get_dofs(condition.boundary).flatten()
            value, unknowns = condition.value, condition.component * velocity.N + nodes
            values[unknowns] = value(velocity.doflocs[:, nodes]) if callable(value) else value
            fixed[unknowns] = True
        if enclosed:
            fixed[count * velocity.N] = True
        force = None if body_force is None else body_force(np.array(velocity.global_coordinates()))
        flow = None if flow_component is None else np.eye(count)[flow_component]
        return cls(
            velocity=velocity,
            pressure=pressure,
            components=count,
            enclosed=enclosed,
            free=np.flatnonzero(~fixed),
            fixed_values=values,
            source=np.zeros(size) if force is None else _loads(velocity, pressure, force),
            flow_load=None if flow is None else _loads(velocity, pressure, flow),
            mean_load=_load.assemble(pressure, factor=1.0),
            viscous=_viscous(velocity, count, axisymmetric, stress_form),
            mass=_mass.assemble(velocity, factor=1.0),
            gradient=_gradient(velocity, pressure, count, axisymmetric),
        )

    @property
    def unknowns(self) -> int:
        """Velocity and pressure unknowns, boundary values included."""
        return int(self.fixed_values.size)

    @property
    def points(self) -> FloatArray:
        """Coordinates of the quadrature points, shape (dimension, elements, points)."""
        return np.array(self.velocity.global_coordinates(), dtype=np.float64)

    @property
    def nodes(self) -> FloatArray:
        """Coordinates of the velocity nodes, shape (dimension, nodes)."""
        return np.asarray(self.velocity.doflocs, dtype=np.float64)

    @property
    def weights(self) -> FloatArray:
        """Quadrature weight times Jacobian (times r), shape (elements, points)."""
        return np.asarray(self.velocity.dx, dtype=np.float64)

    def boundary_nodes(self, name: str) -> IntArray:
        """Velocity nodes on a named boundary."""
        return np.asarray(self.velocity.get_dofs(name).flatten(), dtype=np.int64)

    def split(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity (components, velocity nodes) and pressure (pressure nodes,) of a full vector."""
        velocity = vector[: self.components * self.velocity.N]
        return velocity.reshape(self.components, -1), vector[velocity.size :]

    def at_points(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity and its gradient at the quadrature points, from nodal values (components, velocity nodes).

        Returns: u of shape (components, elements, points), and du_c/dx_d of shape (c, d, elements, points).
        """
        fields = [self.velocity.interpolate(component) for component in velocity]
        return np.stack([np.asarray(field) for field in fields]), np.stack([field.grad for field in fields])

    def load(self, values: FloatArray | float = 1.0) -> FloatArray:
        """Integral of a function, shape (elements, points), against every velocity shape function."""
        return np.asarray(_load.assemble(self.velocity, factor=values), dtype=np.float64)

    def weighted_mass(self, factor: FloatArray) -> Any:
        """Matrix of integral(factor N_i N_j), the factor of shape (elements, points)."""
        return _mass.assemble(self.velocity, factor=factor)

    def pressure_mass(self) -> Any:
        """Matrix of integral(psi_i N_j), pressure against velocity shape functions."""
        return _mass.assemble(self.velocity, self.pressure, factor=1.0)

    def of_all(self, velocity_block: Any) -> Any:
        """A matrix of the velocity unknowns, with empty rows and columns for the pressure."""
        nothing = sparse.csr_matrix((self.pressure.N,) * 2)
        return sparse.block_diag([velocity_block, nothing], format="csr")

    def linear_matrix(self, coefficients: Coefficients) -> Any:
        """CSR matrix of the linear part of the equations, all rows and columns."""
        velocity = coefficients.viscosity * self.viscous
        if coefficients.rotation is not None:
            velocity = velocity + sparse.kron(np.asarray(coefficients.rotation), self.mass)
        return sparse.bmat([[velocity, self.gradient], [self.gradient.T, None]], format="csr")

    def convection_vector(self, vector: FloatArray) -> FloatArray:
        """Integral of (u . grad) u against every velocity shape function."""
        u, slopes = self.at_points(self.split(vector)[0])
        carried = np.einsum("deq,cdeq->ceq", u[: slopes.shape[1]], slopes)
        return _loads(self.velocity, self.pressure, carried)

    def convection_matrix(self, vector: FloatArray) -> Any:
        """Exact derivative of `convection_vector`: u . grad(du) + du . grad(u)."""
        u, slopes = self.at_points(self.split(vector)[0])
        dimension, nothing = slopes.shape[1], sparse.csr_matrix(self.mass.shape)
        carried = _carried.assemble(self.velocity, carrier=u[:dimension])
        blocks = [
            [
                (self.weighted_mass(slopes[c, d]) if d < dimension else nothing)
                + (carried if c == d else nothing)
                for d in range(self.components)
            ]
            for c in range(self.components)
        ]
        return self.of_all(sparse.bmat(blocks))

    def free_part(self, matrix: Any) -> Any:
        """CSC matrix of the free rows and columns."""
        return matrix[self.free][:, self.free].tocsc()


def _loads(velocity: Any, pressure: Any, values: FloatArray) -> FloatArray:
    """Full vector of the integrals of each component's values against the velocity shape functions."""
    return np.concatenate([*(_load.assemble(velocity, factor=each) for each in values), np.zeros(pressure.N)])


def _viscous(velocity: Any, components: int, axisymmetric: bool, stress_form: bool) -> Any:
    stiffness = _stiffness.assemble(velocity)
    viscous = sparse.kron(sparse.identity(components), stiffness, format="csr")
    if axisymmetric:
        radius = np.asarray(velocity.global_coordinates())[1]
        curved = _mass.assemble(velocity, factor=1 / radius**2)
        viscous = viscous + sparse.kron(np.diag([0.0, 1.0]), curved, format="csr")
    if stress_form:
        rows = [
            [_transposed.assemble(velocity, row=c, column=d) for d in range(components)]
            for c in range(components)
        ]
        viscous = viscous + sparse.bmat(rows, format="csr")
    return viscous


def _gradient(velocity: Any, pressure: Any, components: int, axisymmetric: bool) -> Any:
    """Integral of -psi_j div(N_i e_c), rows of velocity, columns of pressure."""
    dimension = velocity.mesh.dim()
    nothing = sparse.csr_matrix((pressure.N, velocity.N))
    parts = [
        _slope.assemble(velocity, pressure, direction=c) if c < dimension else nothing
        for c in range(components)
    ]
    if axisymmetric:
        radius = np.asarray(velocity.global_coordinates())[1]
        parts[1] = parts[1] + _mass.assemble(velocity, pressure, factor=1 / radius)
    return -sparse.hstack(parts, format="csr").T.tocsr()
