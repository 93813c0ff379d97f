"""Laminar flow in a tube: meshes, the section rotating about an axis normal to the tube, and both ends.

**Fully developed flow in the rotating section.** Half of the section, circular or rectangular, lengths over
the bore or hydraulic diameter d, velocities over the mean velocity U. With x along the tube, z along the
rotation axis, w the axial and (u, v) the velocity along (y, z), and p the reduced pressure:

    Re (u w_y + v w_z) - 2 R u = G + lap w
    Re (u u_y + v u_z) + 2 R w = -p_y + lap u
    Re (u v_y + v v_z)         = -p_z + lap v,     u_y + v_z = 0,     mean(w) = 1

Re = U d/nu, R = omega d^2/nu.  The friction ratio is F = G/32, 1 without rotation.  Equivalent pairs are
Kl = R Re and S = R/Re; at Re = 0 (S infinite) the problem is linear.

**Meshes** are put together from patches of structured nodes. A patch is an array of nodes, shape (2 m + 1,
2 n + 1, 2): every second node is a vertex, the others are the mid-nodes of a quadratic mesh and lie on the
true geometry. Patches that share nodes are glued; boundaries are named by the positions of their facets.

**Entrance from a reservoir and exit into one**, axisymmetric. The tube ends flush in a plane wall with a
sharp edge. Lengths over the bore d, velocities over the mean velocity U, pressure over mu U/d:

    Re (u . grad) u = -grad p + lap u,   div u = 0

Far away in the reservoir the surface is free of force at zero pressure (its side lets liquid through at
right angles only, where a jet leaves the tube); deep inside the tube the flow is developed, so that p is a
straight line of slope -32 there. With that line extrapolated to the tube's end,

    K_ent  = 2 (p_reservoir - p_end)/(rho U^2)      (it contains the leaving stream's kinetic factor 2)
    K_exit = 2 (p_end - p_reservoir)/(rho U^2)

and K Re stays finite at Re = 0, where both ends have the same loss because creeping flow is reversible.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import sparse
from skfem import MeshQuad2

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSystem
from ringbalance.verification.navier_stokes.newton import (
    Factors,
    FlowSolution,
    NewtonSettings,
    flow_at,
    solve_flow,
)

Test = Callable[[FloatArray], BoolArray]
"""Test of middles of facets, shape (dimension, n): true on those that belong to a boundary."""
POISEUILLE_GRADIENT = 32.0
"""G of a tube at rest: -dp/dx d^2/(mu U)."""
_KL_SCALE = 300.0
_TOUCHING = 1e-9
"""Distance over the bore up to which facets lie on a line."""


class _HalfSection(ABC):
    """Half of a section, with the boundaries wall and symmetry."""

    @abstractmethod
    def mesh(self) -> Any:
        """Quadratic mesh of the half section."""

    def system(self) -> FlowSystem:
        """Discrete equations of the half section: no slip at the wall, mirror symmetry about z = 0."""
        conditions = [Dirichlet(boundary="symmetry", component=1)]
        conditions += [Dirichlet(boundary="wall", component=c) for c in range(3)]
        return FlowSystem.of(
            mesh=self.mesh(), conditions=conditions, components=3, enclosed=True, flow_component=2
        )


@dataclass(frozen=True, kw_only=True)
class SectionMesh(_HalfSection):
    """Cells of the half section: a core of 2 n x n cells inside a ring of 4 n cells around."""

    around: int = 6
    """n, a quarter of the cells around."""
    across: int = 12
    """Cells of the ring between core and wall."""
    wall_ratio: float = 12.0
    """Innermost cell of the ring over the cell at the wall."""

    def mesh(self) -> Any:
        """Quadratic mesh of the half section (y, z >= 0) of a tube of unit bore, refined at its wall."""
        n, half_width, corner = self.around, 0.26, 0.2
        bottom = _lines(np.array([[-half_width, 0.0], [half_width, 0.0]]), 2 * n)
        angles = np.pi * np.linspace(0.75, 0.25, 4 * n + 1)
        straight = _lines(np.array([[-corner, corner], [corner, corner]]), 2 * n)
        bulge = np.stack([np.cos(angles), np.sin(angles)], axis=1) * corner * np.sqrt(2.0)
        top = (straight + bulge) / 2
        core = ruled(inner=bottom, outer=top, blend=np.linspace(0.0, 1.0, 2 * n + 1))
        # Right, top and left edges of the core in the order of growing angle.
        edges = (core[-1], core[::-1, -1], core[0, ::-1])
        vertices = geometric_vertices(cells=self.across, ratio=self.wall_ratio)
        blend = 1 - with_midpoints(vertices=vertices)[::-1]
        patches = [core]
        ranges = ((0.0, 0.25, n), (0.25, 0.75, 2 * n), (0.75, 1.0, n))
        for edge, (first, last, count) in zip(edges, ranges, strict=True):
            angles = np.pi * np.linspace(first, last, 2 * count + 1)
            wall = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            wall[np.abs(wall) < 1e-15] = 0.0
            patches.append(ruled(inner=edge, outer=wall, blend=blend))
        return patch_mesh(patches, symmetry=on_symmetry)


@dataclass(frozen=True, kw_only=True)
class DuctMesh(_HalfSection):
    """Cells of the half section of a rectangular duct, refined towards its walls."""

    aspect_ratio: float = 1.0
    """Extent across the axis of rotation over that along it."""
    across_axis: int = 12
    """Cells across the axis of rotation, an even number."""
    along_axis: int = 8
    """Cells of the half along the axis of rotation."""
    wall_ratio: float = 20.0
    """Innermost cell over the cell at the wall."""

    def mesh(self) -> Any:
        """Quadratic mesh of the half section (z >= 0) of a duct of unit hydraulic diameter."""
        width = (1 + self.aspect_ratio) / 2
        half = geometric_vertices(cells=self.across_axis // 2, ratio=self.wall_ratio) / 2
        y = width * (np.concatenate([half, 1 - half[-2::-1]]) - 0.5)
        height = width / self.aspect_ratio
        z = height / 2 * (1 - geometric_vertices(cells=self.along_axis, ratio=self.wall_ratio)[::-1])
        patch = tensor(x=with_midpoints(vertices=y), y=with_midpoints(vertices=z))
        return patch_mesh([patch], symmetry=on_symmetry)


def on_symmetry(middle: FloatArray) -> BoolArray:
    """True where points lie on the line z = 0 of a half section."""
    return np.asarray(middle[1] < _TOUCHING)


def _lines(points: FloatArray, count: int) -> FloatArray:
    """Nodes on a straight line between two points, shape (2 count + 1, 2)."""
    share = np.linspace(0.0, 1.0, 2 * count + 1)[:, None]
    return np.asarray((1 - share) * points[0] + share * points[1], dtype=np.float64)


def solve_section(
    *,
    system: FlowSystem,
    kl: float,
    s: float,
    start: FlowSolution | None = None,
    settings: NewtonSettings | None = None,
) -> FlowSolution:
    """Fully developed flow in the rotating tube at given Kl = R Re and S = R/Re, which may be zero.

        u w_y + v w_z - 2 S u = G + lap w,    u u_y + v u_z + 2 Kl w = -p_y + lap u,    ...
    Args: `start`: a neighbouring flow; needed once Kl exceeds a few thousand.
    Returns: The flow; nodal velocity components along (y, z) over nu/d, and along x over U.
    """
    return solve_flow(
        system=system,
        coefficients=section_coefficients(kl=kl, s=s),
        flow_rate=float(system.weights.sum()),
        start=start,
        settings=settings,
    )


def section_coefficients(*, kl: float, s: float, inertia: float = 1.0) -> Coefficients:
    """Coefficients of developed flow, velocity along (y, z, x): the first two over nu/d, the last over U."""
    rotation = ((0.0, 0.0, 2 * kl), (0.0, 0.0, 0.0), (-2 * s, 0.0, 0.0))
    return Coefficients(inertia=inertia, viscosity=1.0, rotation=rotation)


def march_section(*, system: FlowSystem, kl: float, s: float, step: float, steps: int) -> FloatArray:
    """March developed flow in time, from the flow without inertia with a disturbance of one per cent.

    It finds the unsteady flow where the steady one is unstable; the flow does not vary along the tube.
    Second-order backward differences, convection extrapolated from two steps:

        (3 u - 4 u' + u'')/(2 dt) + inertia (2 N' - N'') + rotation C u = -grad p + viscosity lap u + G e

    div u = 0, N is convection and ' the step before.  One set of factors serves all steps.  Stable while a
    step carries flow through less than about a third of a cell.
    Args: `step`: dt over d^2/nu.
    Returns: G of each step.
    Raises: ArithmeticError: the flow grew without bound; the step is too long.
    """
    free, area = system.free, float(system.weights.sum())
    linear = section_coefficients(kl=kl, s=s, inertia=0.0)
    start = solve_flow(system=system, coefficients=linear, flow_rate=area).vector.copy()
    velocity = system.split(start)[0]
    noise = np.random.default_rng(0).standard_normal(velocity.shape)
    noise *= 0.01 * np.abs(velocity).max(axis=1, keepdims=True)
    moving = free[free < velocity.size]
    start[moving] += noise.ravel()[moving]
    assert system.flow_load is not None
    border = system.flow_load[free]
    mass = system.of_all(sparse.kron(sparse.identity(system.components), system.mass))[free]
    steady = system.free_part(system.linear_matrix(section_coefficients(kl=kl, s=s)))
    factors = Factors((steady + 1.5 / step * mass[:, free]).tocsc())
    bordering = factors.solve(border)
    now, before = start, start
    convection = system.convection_vector(now)
    gradients = np.empty(steps)
    for i in range(steps):
        carried, convection = convection, system.convection_vector(now)
        pull = (2 * convection - carried)[free]
        change = factors.factors.solve(mass @ (4 * now - before) / (2 * step) - pull)
        gradients[i] = (area - border @ change) / (border @ bordering)
        now, before = start.copy(), now
        now[free] = change + gradients[i] * bordering
        if not np.isfinite(gradients[i]) or np.abs(now).max() > 1e12:
            raise ArithmeticError("the flow grew without bound: take shorter steps")
    return gradients


def developed_section(
    *, system: FlowSystem, kl: float, s: float, settings: NewtonSettings | None = None
) -> FlowSolution:
    """Developed flow at any Kl, by continuation from a small one. Raises: ArithmeticError: not found."""

    def solve(a: float, start: FlowSolution | None) -> FlowSolution:
        scaled = _KL_SCALE * float(np.expm1(a))
        return solve_section(system=system, kl=scaled, s=s, start=start, settings=settings)

    return flow_at(solve=solve, parameter=float(np.log1p(kl / _KL_SCALE)), first=2.0)


def solve_section_without_inertia(*, system: FlowSystem, rotation_reynolds: float) -> FlowSolution:
    """Fully developed flow in the limit Re = 0, where it is linear; components along (y, z, x) over U."""
    c = section_coefficients(kl=rotation_reynolds, s=rotation_reynolds, inertia=0.0)
    return solve_flow(system=system, coefficients=c, flow_rate=float(system.weights.sum()))


def friction_ratio(solution: FlowSolution) -> float:
    """F = G/32, the pressure gradient over that of the tube at rest at the same flow rate."""
    return solution.driving_gradient / POISEUILLE_GRADIENT


# An irrational factor keeps dyadic coordinates away from the rounding boundaries of the gluing.
_GLUE = 0.7548776662e9


def ruled(*, inner: FloatArray, outer: FloatArray, blend: FloatArray) -> FloatArray:
    """Patch between two curves of nodes, at j = 0 and at j = 2 n, joined by straight lines.

    Args: `blend`: fraction of the way from inner to outer, shape (2 n + 1,), from 0 to 1.
    """
    share = blend[None, :, None]
    return np.asarray((1 - share) * inner[:, None, :] + share * outer[:, None, :])


def tensor(*, x: FloatArray, y: FloatArray) -> FloatArray:
    """Rectangular patch from nodes along its two directions, shapes (2 m + 1,) and (2 n + 1,)."""
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def with_midpoints(*, vertices: npt.ArrayLike) -> FloatArray:
    """Nodes of quadratic cells on a line: the vertices with their midpoints between them."""
    v = np.asarray(vertices, dtype=np.float64)
    nodes = np.empty(2 * v.size - 1)
    nodes[::2] = v
    nodes[1::2] = (v[1:] + v[:-1]) / 2
    return nodes


def geometric_vertices(*, cells: int, ratio: float) -> FloatArray:
    """Vertices on [0, 1] whose cells grow by one factor; `ratio` is that of the last cell over the first."""
    growth = np.linspace(0.0, 1.0, cells) if cells > 1 else np.zeros(1)
    lengths = ratio**growth
    return np.asarray(np.concatenate(([0.0], np.cumsum(lengths))) / lengths.sum(), dtype=np.float64)


def patch_mesh(patches: Sequence[FloatArray], **named: Test) -> Any:
    """Nine-node quadrilaterals of patches, glued where nodes coincide.

    Args: `**named`: boundaries by name, each true at the middles, shape (2, n), of its facets; the rest is
        "wall".
    """
    points = np.concatenate([nodes.reshape(-1, 2) for nodes in patches])
    extent = float(np.ptp(points, axis=0).max())
    keys = np.round((points - points.min(axis=0)) / extent * _GLUE).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    numbers = np.split(inverse.ravel(), np.cumsum([nodes.size // 2 for nodes in patches])[:-1])
    # Nine nodes per cell: four vertices, four mid-sides, the centre.
    a, b, c = slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)
    order = [(a, a), (c, a), (c, c), (a, c), (b, a), (c, b), (b, c), (a, b), (b, b)]
    grids = [number.reshape(nodes.shape[:2]) for number, nodes in zip(numbers, patches, strict=True)]
    cells = [np.stack([grid[i, j].ravel() for i, j in order]) for grid in grids]
    mesh = MeshQuad2(np.ascontiguousarray(points[first].T), np.concatenate(cells, axis=1))
    return mesh.with_boundaries(named_facets(mesh, named))


def named_facets(mesh: Any, named: Mapping[str, Test]) -> dict[str, IntArray]:
    """Boundary facets by the test that their middles pass; "wall" has those that pass none."""
    outside = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, outside]].mean(axis=1)
    masks = {name: test(middle) for name, test in named.items()}
    masks["wall"] = ~np.any([*masks.values(), np.zeros(outside.size, dtype=bool)], axis=0)
    return {name: outside[mask] for name, mask in masks.items()}


End = Literal["entrance", "exit"]


@dataclass(frozen=True, kw_only=True)
class EndMesh:
    """Domain and grading; lengths over the bore."""

    cells_per_fold: float = 2.0
    """Cells in which the cell size grows by a factor e, away from the edge."""
    edge_cell: float = 1e-4
    """Size of the cells at the sharp edge."""
    reservoir: float = 40.0
    """Extent of the reservoir along the axis and across."""
    tube: float = 300.0
    """Length of tube."""
    longest_cell: float = 0.15
    """Longest cell over the length of its line, at two cells per fold."""
    tube_cell: float = 6.0
    """Longest cell along the tube, at two cells per fold."""
    jet_cell: float = 6.0
    """Longest cell along the axis of the reservoir, at two cells per fold."""

    def mesh(self, *, end: End) -> Any:
        """Quadratic mesh in (x, r) of a reservoir and a tube of unit bore, flow along x, the end at x = 0.

        The tube is at x > 0 for the entrance and at x < 0 for the exit; boundaries are axis, wall, far
        (normal to x), side (far, normal to r) and deep (in the tube).
        """
        sign = 1.0 if end == "entrance" else -1.0
        longest = self.longest_cell * self.reservoir
        outside = -sign * _line(self.reservoir, min(self.jet_cell, longest), self)
        inside = sign * _line(self.tube, min(self.tube_cell, self.longest_cell * self.tube), self)
        core = 0.5 - _line(0.5, self.longest_cell * 0.5, self)[::-1]
        core[0] = 0.0
        around = 0.5 + _line(self.reservoir, longest, self)
        far, deep = -sign * self.reservoir, sign * self.tube
        return patch_mesh(
            [tensor(x=outside, y=core), tensor(x=outside, y=around), tensor(x=inside, y=core)],
            axis=lambda at: at[1] < _TOUCHING,
            far=lambda at: np.abs(at[0] - far) < _TOUCHING,
            deep=lambda at: np.abs(at[0] - deep) < _TOUCHING,
            side=lambda at: at[1] > self.reservoir,
        )

    def system(self, *, end: End) -> FlowSystem:
        """Discrete equations of an end: developed flow deep in the tube, no force on the far reservoir."""
        conditions = [Dirichlet(boundary="deep", component=0, value=lambda x: 2 * (1 - 4 * x[1] ** 2))]
        conditions += [Dirichlet(boundary=name, component=1) for name in ("deep", "wall", "axis")]
        conditions.append(Dirichlet(boundary="wall", component=0))
        if end == "exit":
            # The jet draws liquid in through the side; free to flow along it, this is unstable near Re 1950.
            conditions.append(Dirichlet(boundary="side", component=0))
        return FlowSystem.of(mesh=self.mesh(end=end), conditions=conditions, axisymmetric=True)


def _line(length: float, longest: float, cells: EndMesh) -> FloatArray:
    """Nodes from 0 to a length whose cells grow geometrically from the edge cell up to the longest one."""
    growth = np.exp(1 / cells.cells_per_fold)
    limit = 2 * longest / cells.cells_per_fold
    steps = [cells.edge_cell]
    while sum(steps) < length:
        steps.append(min(steps[-1] * growth, limit))
    vertices = np.concatenate([[0.0], np.cumsum(steps)])
    return with_midpoints(vertices=vertices * (length / vertices[-1]))


def solve_end(
    *,
    system: FlowSystem,
    reynolds: float,
    start: FlowSolution | None = None,
    settings: NewtonSettings | None = None,
) -> FlowSolution:
    """Flow at an end of the tube at Re = U d/nu, at least 0, from a neighbouring flow where one is given."""
    c = Coefficients(inertia=reynolds, viscosity=1.0)
    return solve_flow(system=system, coefficients=c, start=start, settings=settings)
