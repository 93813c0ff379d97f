"""The discrete equations of a steady laminar flow on a Taylor-Hood space with fixed boundary conditions.

    inertia (u . grad) u + rotation C u = -grad p + viscosity lap u + f + G e,    div u = 0

Coefficients are chosen at solve time, so one system serves a whole sweep: density and dynamic viscosity in
SI, or 1 and 1/Re, or Re and 1.  C is a constant matrix (twice the cross product with the rotation, in a
rotating frame).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.verification.navier_stokes.linear import layers_of
from ringbalance.verification.navier_stokes.space import FlowSpace


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
    load: FloatArray
    """Body force, full vector."""
    flow_load: FloatArray
    """Integral of every shape function of the flow component, full vector."""
    mean_load: FloatArray
    """Integral of every pressure shape function, shape (pressure nodes,)."""
    viscous: FloatArray
    coriolis: FloatArray
    coupling: FloatArray
    """Entries of the constant operators in the order of `blocks`."""
    blocks: tuple[tuple[int, int], ...]
    """Velocity blocks (row component, column component) in the order of their entries."""
    full_pattern: Any
    """CSR matrix of all rows whose data are entry numbers."""
    free_pattern: Any
    """CSC matrix of the free rows and columns whose data are entry numbers."""
    mass: FloatArray
    convection: FloatArray
    """Contracted quadrature tables."""
    layers: IntArray | None = None
    """Layers of all unknowns along a long, thin mesh, for factors slab by slab."""

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
        slab: IntArray | None = None,
    ) -> FlowSystem:
        """Operators and numbering of a flow problem, to be solved for any coefficients.

        Args:
            space: Taylor-Hood space.
            conditions: velocity boundary values; a boundary without them is free: zero traction in the stress
                form, viscosity du/dn = p n otherwise.
            enclosed: true when no boundary is free in its normal direction: pressure up to a constant.
            flow_component: component whose integral over the domain is prescribed when solved; None for none.
            coriolis: C, shape (components, components); default none.
            body_force: of coordinates (dimension, elements, points), giving (components, elements, points).
            stress_form: viscous term with the transposed gradient, needed for the torque on a moving wall.
            slab: number of every element's slab along a long, thin mesh, which is then solved slab by slab.
        Raises: ValueError: an unknown boundary, a Coriolis matrix of another shape, stress form in (x, r).
        """
        matrix = (
            np.zeros((space.components,) * 2) if coriolis is None else np.asarray(coriolis, dtype=np.float64)
        )
        if matrix.shape != (space.components,) * 2:
            raise ValueError(f"coriolis must have shape {(space.components,) * 2}, not {matrix.shape}")
        if stress_form and space.axisymmetric:
            raise ValueError("the stress form is not available in axisymmetric coordinates")
        values, fixed = _boundary_data(space, conditions)
        if enclosed:
            fixed[space.components * space.velocity_nodes] = True
        free = np.flatnonzero(~fixed)
        blocks = _block_list(space, matrix)
        viscous, rotating, coupling = _constant_entries(space, blocks, matrix, stress_form)
        full, part = _patterns(space, *_indices(space, blocks), free)
        flow = np.zeros(space.unknowns)
        if flow_component is not None:
            where = slice(flow_component * space.velocity_nodes, (flow_component + 1) * space.velocity_nodes)
            flow[where] = space.load_vector(np.ones_like(space.weights))
        return cls(
            space=space,
            enclosed=enclosed,
            flow_component=flow_component,
            free=free,
            fixed_values=values,
            load=_force_vector(space, body_force),
            flow_load=flow,
            mean_load=space.pressure_load(),
            viscous=viscous,
            coriolis=rotating,
            coupling=coupling,
            blocks=blocks,
            full_pattern=full,
            free_pattern=part,
            mass=space.mass_table(),
            convection=space.convection_table(),
            layers=None if slab is None else _layers(space, slab),
        )

    def linear_entries(self, coefficients: Coefficients) -> FloatArray:
        """Entries of the linear part of the equations."""
        count = self.space.components
        factors = np.broadcast_to(np.asarray(coefficients.rotation, dtype=np.float64), (count, count))
        turning = np.array([factors[block] for block in self.blocks])
        rotating = np.repeat(turning, self.space.velocity_pattern.rows.size) * self.coriolis
        return np.concatenate([coefficients.viscosity * self.viscous + rotating, self.coupling])

    def convection_vector(self, vector: FloatArray) -> FloatArray:
        """Integral of (u . grad) u against every velocity shape function."""
        space = self.space
        u, gradient = space.at_points(space.split(vector)[0])
        carried = np.einsum("deq,cdeq->ceq", u[: space.dimension], gradient, optimize=True)
        out = np.zeros(space.unknowns)
        parts = [space.load_vector(component) for component in carried]
        out[: space.components * space.velocity_nodes] = np.concatenate(parts)
        return out

    def convection_entries(self, vector: FloatArray) -> FloatArray:
        """Exact derivative of `convection_vector`: u . grad(du) + du . grad(u)."""
        space, dim = self.space, self.space.dimension
        u, gradient = space.at_points(space.split(vector)[0])
        reference = np.einsum("eq,deq,kdeq->eqk", space.weights, u[:dim], space.inverse, optimize=True)
        along = reference.reshape(reference.shape[0], -1) @ self.convection
        parts = []
        for c, d in self.blocks:
            entry = along if c == d else np.zeros_like(along)
            if d < dim:
                entry = entry + (space.weights * gradient[c, d]) @ self.mass
            parts.append(space.velocity_pattern.assemble(entry))
        return np.concatenate([*parts, np.zeros(self.coupling.size)])

    def full_matrix(self, entries: FloatArray) -> Any:
        """CSR matrix of all rows and columns, those of given unknowns included."""
        return _filled(self.full_pattern, entries)

    def free_matrix(self, entries: FloatArray) -> Any:
        """CSC matrix of the free rows and columns."""
        return _filled(self.free_pattern, entries)


def _block_list(space: FlowSpace, coriolis: FloatArray) -> tuple[tuple[int, int], ...]:
    count, dim = space.components, space.dimension
    return tuple(
        (c, d) for c in range(count) for d in range(count) if d < dim or c == d or coriolis[c, d] != 0.0
    )


def _constant_entries(
    space: FlowSpace, blocks: Sequence[tuple[int, int]], coriolis: FloatArray, stress_form: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    stiffness, mass = space.stiffness_entries(), space.mass_entries(np.ones_like(space.weights))
    viscous, rotating = [], []
    for c, d in blocks:
        entry = stiffness if c == d else np.zeros_like(stiffness)
        if stress_form and max(c, d) < space.dimension:
            entry = entry + space.cross_entries(c, d)
        if space.axisymmetric and (c, d) == (1, 1):
            entry = entry + space.mass_entries(1 / space.points[1] ** 2)
        viscous.append(entry)
        rotating.append(coriolis[c, d] * mass)
    divergence = [-space.divergence_entries(d) for d in range(space.dimension)]
    return np.concatenate(viscous), np.concatenate(rotating), np.concatenate(divergence + divergence)


def _indices(space: FlowSpace, blocks: Sequence[tuple[int, int]]) -> tuple[IntArray, IntArray]:
    n = space.velocity_nodes
    v, b, first = space.velocity_pattern, space.coupling_pattern, space.components * n
    rows = [c * n + v.rows for c, _ in blocks]
    cols = [d * n + v.cols for _, d in blocks]
    rows += [first + b.rows for _ in range(space.dimension)] + [
        d * n + b.cols for d in range(space.dimension)
    ]
    cols += [d * n + b.cols for d in range(space.dimension)] + [
        first + b.rows for _ in range(space.dimension)
    ]
    return np.concatenate(rows), np.concatenate(cols)


def _patterns(space: FlowSpace, rows: IntArray, cols: IntArray, free: IntArray) -> tuple[Any, Any]:
    """Full CSR and free CSC matrices holding entry numbers; one-based inside scipy, which drops zeros."""
    size = space.unknowns
    number = np.arange(1, rows.size + 1, dtype=np.float64)
    full = sparse.csr_matrix((number, (rows, cols)), shape=(size, size))
    local = np.full(size, -1, dtype=np.int64)
    local[free] = np.arange(free.size)
    keep = (local[rows] >= 0) & (local[cols] >= 0)
    part = sparse.csc_matrix(
        (number[keep], (local[rows[keep]], local[cols[keep]])), shape=(free.size, free.size)
    )
    part.sort_indices()
    return full, part


def _boundary_data(space: FlowSpace, conditions: Sequence[Dirichlet]) -> tuple[FloatArray, BoolArray]:
    values = np.zeros(space.unknowns)
    fixed = np.zeros(space.unknowns, dtype=bool)
    for condition in conditions:
        nodes = space.boundary_nodes(condition.boundary)
        where = condition.component * space.velocity_nodes + nodes
        values[where] = space.nodal(condition.value)[nodes]
        fixed[where] = True
    return values, fixed


def _force_vector(space: FlowSpace, force: Callable[[FloatArray], FloatArray] | None) -> FloatArray:
    load = np.zeros(space.unknowns)
    if force is not None:
        values = np.asarray(force(space.points), dtype=np.float64)
        parts = [space.load_vector(values[c]) for c in range(space.components)]
        load[: space.components * space.velocity_nodes] = np.concatenate(parts)
    return load


def _layers(space: FlowSpace, slab: IntArray) -> IntArray:
    velocity, pressure = (
        layers_of(slab=slab, element_dofs=basis.element_dofs, size=basis.N)
        for basis in (space.velocity, space.pressure)
    )
    return np.concatenate([np.tile(velocity, space.components), pressure])


def _filled(pattern: Any, entries: FloatArray) -> Any:
    """The matrix of a pattern whose data are numbers of entries, from one."""
    data = entries[pattern.data.astype(np.int64) - 1]
    return type(pattern)((data, pattern.indices, pattern.indptr), shape=pattern.shape)
