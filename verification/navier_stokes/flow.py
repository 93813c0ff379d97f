"""The discrete equations of a steady laminar flow with fixed boundary conditions, by scikit-fem's forms.

    inertia (u . grad) u + rotation C u = -grad p + viscosity lap u + f + G e,    div u = 0

on a Taylor-Hood space (Comput. Fluids 1 (1973) 73): quadratic velocity, linear pressure, curved cells.
Unknowns are the velocity components one after the other, then the pressure.  Coefficients are chosen at solve
time, so one system serves a whole sweep: density and dynamic viscosity in SI, or 1 and 1/Re, or Re and 1.  C
is a constant matrix (twice the cross product with the rotation, in a rotating frame).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, ElementQuad1, ElementQuad2, LinearForm
from skfem.helpers import dot, grad

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray

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
        """Taylor-Hood space of a mesh of quadrilaterals or hexahedra.

        Args: `components`: velocity components, at least the mesh's dimension; default equal to it.
        Raises: ValueError: fewer components than dimensions, or an axisymmetric mesh that is not plane.
        """
        count = mesh.dim() if components is None else components
        if count < mesh.dim() or (axisymmetric and (mesh.dim() != 2 or count != 2)):
            raise ValueError(
                "components must reach the mesh's dimension, and be 2 on a plane mesh if axisymmetric"
            )
        quadratic, linear = (ElementQuad2, ElementQuad1) if mesh.dim() == 2 else (ElementHex2, ElementHex1)
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


def _stiffness(u: Any, v: Any, w: Any) -> Any:
    return w.measure * dot(grad(u), grad(v))


def _transposed(u: Any, v: Any, w: Any) -> Any:
    return w.measure * grad(v)[w.column] * grad(u)[w.row]


def _slope(u: Any, q: Any, w: Any) -> Any:
    return w.measure * grad(u)[w.direction] * q


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
    rotation: float | tuple[tuple[float, ...], ...] = 0.0
    """Factor on the system's Coriolis matrix, one for all or one for each of its elements."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSystem:
    """Operators, numbering and boundary data of one flow problem; made by `FlowSystem.of`."""

    space: FlowSpace
    enclosed: bool
    """No boundary fixes the pressure level: it is pinned, and its mean set to zero."""
    flow_component: int | None
    """Component whose integral is prescribed, through a uniform driving gradient in that component."""
    free: IntArray
    """Unknowns that are solved for."""
    fixed_values: FloatArray
    """Full vector with the boundary values, zero elsewhere."""
    source: FloatArray
    """Body force, full vector."""
    flow_load: FloatArray
    """Integral of every shape function of the flow component, full vector."""
    mean_load: FloatArray
    """Integral of every pressure shape function, shape (pressure nodes,)."""
    viscous: Sequence[Sequence[Any]]
    """Velocity blocks of the viscous term; None where it has none."""
    mass: Any
    gradient: Any
    """Velocity rows of the pressure's term; its transpose is continuity."""
    coriolis: FloatArray

    @classmethod
    def of(
        cls,
        *,
        space: FlowSpace,
        conditions: Sequence[Dirichlet],
        enclosed: bool = False,
        flow_component: int | None = None,
        coriolis: npt.ArrayLike | None = None,
        body_force: Callable[[FloatArray], FloatArray] | None = None,
        stress_form: bool = False,
    ) -> FlowSystem:
        """Operators and numbering of a flow problem, to be solved for any coefficients.

        Args:
            conditions: velocity boundary values; a boundary without them is free: zero traction in the stress
                form, viscosity du/dn = p n otherwise.
            enclosed: true when no boundary is free in its normal direction: pressure up to a constant.
            flow_component: component whose integral over the domain is prescribed when solved; None for none.
            coriolis: C, shape (components, components); default none.
            body_force: of coordinates (dimension, elements, points), giving (components, elements, points).
            stress_form: viscous term with the transposed gradient, needed for the torque on a moving wall.
        Raises: ValueError: an unknown boundary, a Coriolis matrix of another shape, stress form in (x, r).
        """
        count = space.components
        matrix = np.zeros((count, count)) if coriolis is None else np.asarray(coriolis, dtype=np.float64)
        if matrix.shape != (count, count):
            raise ValueError(f"coriolis must have shape {(count, count)}, not {matrix.shape}")
        if stress_form and space.axisymmetric:
            raise ValueError("the stress form is not available in axisymmetric coordinates")
        values, fixed = _boundary_data(space, conditions)
        if enclosed:
            fixed[count * space.velocity_nodes] = True
        force = np.zeros((count, 1, 1)) if body_force is None else np.asarray(body_force(space.points))
        flow = [1.0 if component == flow_component else 0.0 for component in range(count)]
        return cls(
            space=space,
            enclosed=enclosed,
            flow_component=flow_component,
            free=np.flatnonzero(~fixed),
            fixed_values=values,
            source=_loads(space, force),
            flow_load=_loads(space, flow),
            mean_load=space.pressure_load(),
            viscous=_viscous_blocks(space, stress_form),
            mass=space.mass(),
            gradient=_gradient(space),
            coriolis=matrix,
        )

    def linear_matrix(self, coefficients: Coefficients) -> Any:
        """CSR matrix of the linear part of the equations, all rows and columns."""
        count = self.space.components
        factors = np.broadcast_to(np.asarray(coefficients.rotation, dtype=np.float64), (count, count))
        turning = factors * self.coriolis
        blocks = [
            [_sum(coefficients.viscosity, self.viscous[c][d], turning[c, d], self.mass) for d in range(count)]
            for c in range(count)
        ]
        velocity = sparse.bmat(blocks, format="csr")
        return sparse.bmat([[velocity, self.gradient], [self.gradient.T, None]], format="csr")

    def convection_vector(self, vector: FloatArray) -> FloatArray:
        """Integral of (u . grad) u against every velocity shape function."""
        u, slopes = self.space.at_points(self.space.split(vector)[0])
        return _loads(self.space, np.einsum("deq,cdeq->ceq", u[: self.space.dimension], slopes))

    def convection_matrix(self, vector: FloatArray) -> Any:
        """Exact derivative of `convection_vector`: u . grad(du) + du . grad(u)."""
        space, count = self.space, self.space.components
        u, slopes = space.at_points(space.split(vector)[0])
        along = space.convection(u[: space.dimension])
        blocks = [[along if c == d else None for d in range(count)] for c in range(count)]
        for c in range(count):
            for d in range(space.dimension):
                turned = space.mass(slopes[c, d])
                blocks[c][d] = turned if blocks[c][d] is None else blocks[c][d] + turned
        nothing = sparse.csr_matrix((space.pressure_nodes,) * 2)
        return sparse.block_diag([sparse.bmat(blocks), nothing], format="csr")

    def free_part(self, matrix: Any) -> Any:
        """CSC matrix of the free rows and columns."""
        return matrix[self.free][:, self.free].tocsc()


def _sum(viscosity: float, viscous: Any, turning: float, mass: Any) -> Any:
    """Sum of two blocks; None for nothing."""
    block = None if viscous is None else viscosity * viscous
    if turning == 0.0:
        return block
    return turning * mass if block is None else block + turning * mass


def _viscous_blocks(space: FlowSpace, stress_form: bool) -> list[list[Any]]:
    count, basis = space.components, space.velocity
    stiffness = BilinearForm(_stiffness).assemble(basis, measure=space.measure)
    blocks: list[list[Any]] = [[stiffness if c == d else None for d in range(count)] for c in range(count)]
    if space.axisymmetric:
        blocks[1][1] = stiffness + space.mass(1 / space.points[1] ** 2)
    if stress_form:
        for c in range(space.dimension):
            for d in range(space.dimension):
                turned = BilinearForm(_transposed).assemble(basis, measure=space.measure, row=c, column=d)
                blocks[c][d] = turned if blocks[c][d] is None else blocks[c][d] + turned
    return blocks


def _gradient(space: FlowSpace) -> Any:
    """Integral of -psi_j div(N_i e_c), rows of velocity, columns of pressure."""
    parts = []
    for direction in range(space.components):
        if direction >= space.dimension:
            parts.append(sparse.csr_matrix((space.pressure_nodes, space.velocity_nodes)))
            continue
        part = BilinearForm(_slope).assemble(
            space.velocity, space.pressure, measure=space.measure, direction=direction
        )
        if space.axisymmetric and direction == 1:
            part = part + space.pressure_mass(1 / space.measure)
        parts.append(part)
    return -sparse.hstack(parts, format="csr").T.tocsr()


def _loads(space: FlowSpace, values: Sequence[float] | FloatArray) -> FloatArray:
    """Full vector of the integrals of each component's values against the velocity shape functions."""
    return np.concatenate([*(space.load(value) for value in values), np.zeros(space.pressure_nodes)])


def _boundary_data(space: FlowSpace, conditions: Sequence[Dirichlet]) -> tuple[FloatArray, BoolArray]:
    values = np.zeros(space.unknowns)
    fixed = np.zeros(space.unknowns, dtype=bool)
    for condition in conditions:
        nodes = space.boundary_nodes(condition.boundary)
        where = condition.component * space.velocity_nodes + nodes
        values[where] = space.nodal(condition.value)[nodes]
        fixed[where] = True
    return values, fixed
