"""Laminar flow in a tube: meshes, its section that rotates about an axis across it, and its two ends.

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
true geometry. Patches that share nodes are glued.

**Entrance from a reservoir and exit into one**, axisymmetric. The tube ends flush in a plane wall with a
sharp edge. Lengths over the bore d, velocities over the mean velocity U, pressure over mu U/d:

    Re (u . grad) u = -grad p + lap u,   div u = 0

Far away in the reservoir the surface is free of force at zero pressure (its side lets liquid through at
right angles only, where a jet leaves the tube); deep inside the tube the flow is developed, so that p is a
straight line of slope -32 there. With that line carried on to the tube's end,

    K_ent  = 2 (p_reservoir - p_end)/(rho U^2)      (it contains the leaving stream's kinetic factor 2)
    K_exit = 2 (p_end - p_reservoir)/(rho U^2)

and K Re stays finite at Re = 0, where both ends have the same loss because creeping flow is reversible.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import sparse
from skfem import MeshQuad2

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSpace, FlowSystem
from ringbalance.verification.navier_stokes.newton import (
    Factors,
    FlowSolution,
    NewtonSettings,
    flow_at,
    solve_flow,
)

POISEUILLE_GRADIENT = 32.0
"""G of a tube at rest: -dp/dx d^2/(mu U)."""
_KL_SCALE = 300.0
CORIOLIS = ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
"""e_z x velocity for components along (y, z, x)."""


class _HalfSection(ABC):
    """Half of a section, with the boundaries wall and symmetry."""

    @abstractmethod
    def mesh(self) -> Any:
        """Its mesh."""

    def system(self) -> FlowSystem:
        """Discrete equations of the half section: no slip at the wall, mirror symmetry about z = 0."""
        space = FlowSpace.taylor_hood(mesh=self.mesh(), components=3)
        conditions = [Dirichlet(boundary="symmetry", component=1)]
        conditions += [Dirichlet(boundary="wall", component=c) for c in range(3)]
        return FlowSystem.of(
            space=space, conditions=conditions, enclosed=True, flow_component=2, coriolis=CORIOLIS
        )


@dataclass(frozen=True, kw_only=True)
class SectionMesh(_HalfSection):
    """Cells of the half section: a core of 2 n x n cells inside a ring of 4 n cells around."""

    around: int = 6
    """n."""
    across: int = 12
    """Cells of the ring between core and wall."""
    wall_ratio: float = 12.0
    """Innermost cell of the ring over the cell at the wall."""

    def mesh(self) -> Any:
        """Quadratic mesh of the half section (y, z >= 0) of a tube of unit bore, refined at its wall."""
        n = self.around
        core, edges = _core(n)
        vertices = geometric_vertices(cells=self.across, ratio=self.wall_ratio)
        blend = 1 - with_midpoints(vertices=vertices)[::-1]
        patches = [Patch(nodes=core, sides={"south": "symmetry"})]
        ranges = ((0.0, 0.25, n), (0.25, 0.75, 2 * n), (0.75, 1.0, n))
        for edge, (first, last, count), flat in zip(edges, ranges, ("west", "", "east"), strict=True):
            angles = np.pi * np.linspace(first, last, 2 * count + 1)
            wall = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            wall[np.abs(wall) < 1e-15] = 0.0
            sides = {"north": "wall"} | ({flat: "symmetry"} if flat else {})
            patches.append(Patch.ruled(inner=edge, outer=wall, blend=blend, sides=sides))
        return patch_mesh(patches)


@dataclass(frozen=True, kw_only=True)
class DuctMesh(_HalfSection):
    """Cells of the half section of a rectangular duct, refined towards its walls."""

    aspect_ratio: float = 1.0
    """Across the axis of rotation over along it."""
    across: int = 12
    """Cells across the axis of rotation, an even number."""
    along: int = 8
    """Cells of the half along it."""
    wall_ratio: float = 20.0
    """Innermost cell over the cell at the wall."""

    def mesh(self) -> Any:
        """Quadratic mesh of the half section (z >= 0) of a duct of unit hydraulic diameter."""
        width = (1 + self.aspect_ratio) / 2
        half = geometric_vertices(cells=self.across // 2, ratio=self.wall_ratio) / 2
        y = width * (np.concatenate([half, 1 - half[-2::-1]]) - 0.5)
        height = width / self.aspect_ratio
        z = height / 2 * (1 - geometric_vertices(cells=self.along, ratio=self.wall_ratio)[::-1])
        patch = Patch.tensor(
            x=with_midpoints(vertices=y),
            y=with_midpoints(vertices=z),
            sides={"west": "wall", "east": "wall", "north": "wall", "south": "symmetry"},
        )
        return patch_mesh([patch])


def _lines(points: FloatArray, count: int) -> FloatArray:
    """Nodes on a straight line between two points, shape (2 count + 1, 2)."""
    share = np.linspace(0.0, 1.0, 2 * count + 1)[:, None]
    return np.asarray((1 - share) * points[0] + share * points[1], dtype=np.float64)


def _core(n: int) -> tuple[FloatArray, list[FloatArray]]:
    """Nodes of the core, and its right, top and left edges in the order of growing angle."""
    half_width, corner = 0.26, 0.2
    bottom = _lines(np.array([[-half_width, 0.0], [half_width, 0.0]]), 2 * n)
    angles = np.pi * np.linspace(0.75, 0.25, 4 * n + 1)
    straight = _lines(np.array([[-corner, corner], [corner, corner]]), 2 * n)
    bulge = np.stack([np.cos(angles), np.sin(angles)], axis=1) * corner * np.sqrt(2.0)
    top = (straight + bulge) / 2
    nodes = Patch.ruled(inner=bottom, outer=top, blend=np.linspace(0.0, 1.0, 2 * n + 1)).nodes
    return nodes, [nodes[-1], nodes[::-1, -1], nodes[0, ::-1]]


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
    c = _coefficients(kl=kl, s=s, inertia=1.0)
    area = float(system.space.weights.sum())
    return solve_flow(system=system, coefficients=c, flow_rate=area, start=start, settings=settings)


def _coefficients(*, kl: float, s: float, inertia: float) -> Coefficients:
    rotation = ((0.0, 0.0, 2 * kl), (0.0, 0.0, 0.0), (2 * s, 0.0, 0.0))
    return Coefficients(inertia=inertia, viscosity=1.0, rotation=rotation)


def march_section(*, system: FlowSystem, kl: float, s: float, step: float, steps: int) -> FloatArray:
    """The same in time, from the flow without inertia and a disturbance of one per cent.

    It finds what a steady solution leaves out where that is unstable; flow is alike along the tube.
    Second-order backward differences, convection extrapolated from two steps:

        (3 u - 4 u' + u'')/(2 dt) + inertia (2 N' - N'') + rotation C u = -grad p + viscosity lap u + G e

    div u = 0, N is convection and ' the step before.  One set of factors serves all steps.  Stable while a
    step carries flow through less than about a third of a cell.
    Args: `step`: dt over d^2/nu.
    Returns: G of each step.
    Raises: ArithmeticError: the flow grew without bound; the step is too long.
    """
    coefficients, start = _coefficients(kl=kl, s=s, inertia=1.0), _disturbed(system, kl, s)
    free, border = system.free, system.flow_load[system.free]
    area = float(system.space.weights.sum())
    mass = _mass(system)[free]
    factors = _factors(system, coefficients, mass, step)
    bordering = factors.solve(border)
    now, before = start, start
    convection = system.convection_vector(now)
    found = np.empty(steps)
    for i in range(steps):
        carried, convection = convection, system.convection_vector(now)
        pull = coefficients.inertia * (2 * convection - carried)[free]
        change = factors.factors.solve(mass @ (4 * now - before) / (2 * step) - pull)
        found[i] = (area - border @ change) / (border @ bordering)
        now, before = start.copy(), now
        now[free] = change + found[i] * bordering
        if not np.isfinite(found[i]) or np.abs(now).max() > 1e12:
            raise ArithmeticError("the flow grew without bound: take shorter steps")
    return found


def _disturbed(system: FlowSystem, kl: float, s: float) -> FloatArray:
    """The flow without inertia, with noise of one per cent of each component's largest velocity."""
    linear = _coefficients(kl=kl, s=s, inertia=0.0)
    area = float(system.space.weights.sum())
    start = solve_flow(system=system, coefficients=linear, flow_rate=area).vector.copy()
    velocity = system.space.split(start)[0]
    noise = np.random.default_rng(0).standard_normal(velocity.shape)
    noise *= 0.01 * np.abs(velocity).max(axis=1, keepdims=True)
    moving = system.free[system.free < velocity.size]
    start[moving] += noise.ravel()[moving]
    return start


def developed_section(
    *, system: FlowSystem, kl: float, s: float, settings: NewtonSettings | None = None
) -> FlowSolution:
    """The same for any Kl, followed from a small one. Raises: ArithmeticError: the flow was not found."""

    def solve(a: float, start: FlowSolution | None) -> FlowSolution:
        at = _KL_SCALE * float(np.expm1(a))
        return solve_section(system=system, kl=at, s=s, start=start, settings=settings)

    return flow_at(solve=solve, parameter=float(np.log1p(kl / _KL_SCALE)), first=2.0)


def solve_section_without_inertia(*, system: FlowSystem, rotation_reynolds: float) -> FlowSolution:
    """Fully developed flow in the limit Re = 0, where it is linear; components along (y, z, x) over U."""
    c = Coefficients(inertia=0.0, viscosity=1.0, rotation=2 * rotation_reynolds)
    area = float(system.space.weights.sum())
    return solve_flow(system=system, coefficients=c, flow_rate=area)


def friction_ratio(solution: FlowSolution) -> float:
    """F = G/32, the pressure gradient over that of the tube at rest at the same flow rate."""
    return solution.driving_gradient / POISEUILLE_GRADIENT


def _mass(system: FlowSystem) -> Any:
    nothing = sparse.csr_matrix((system.space.pressure_nodes,) * 2)
    return sparse.block_diag([system.mass] * system.space.components + [nothing], format="csr")


def _factors(system: FlowSystem, coefficients: Coefficients, mass: Any, step: float) -> Factors:
    steady = system.free_part(system.linear_matrix(coefficients))
    matrix = (steady + 1.5 / step * mass[:, system.free]).tocsc()
    return Factors.of(matrix)


# An irrational factor keeps dyadic coordinates away from the rounding boundaries of the gluing.
_GLUE = 0.7548776662e9


@dataclass(frozen=True, kw_only=True, eq=False)
class Patch:
    """Structured nodes and the names of those of its four sides that are boundaries."""

    nodes: FloatArray
    """Coordinates, shape (2 m + 1, 2 n + 1, 2)."""
    sides: Mapping[str, str] = field(default_factory=dict)
    """Boundary name by side: "west" i = 0, "east" i = 2 m, "south" j = 0, "north" j = 2 n."""

    @classmethod
    def ruled(
        cls,
        *,
        inner: FloatArray,
        outer: FloatArray,
        blend: FloatArray,
        sides: Mapping[str, str] | None = None,
    ) -> Patch:
        """Patch between two curves of nodes, at j = 0 and at j = 2 n, joined by straight lines.

        Args: `blend`: share of the way from inner to outer, shape (2 n + 1,), from 0 to 1.
        """
        share = blend[None, :, None]
        nodes = (1 - share) * inner[:, None, :] + share * outer[:, None, :]
        return cls(nodes=nodes, sides=sides or {})

    @classmethod
    def tensor(cls, *, x: FloatArray, y: FloatArray, sides: Mapping[str, str] | None = None) -> Patch:
        """Rectangular patch from nodes along its two directions, shapes (2 m + 1,) and (2 n + 1,)."""
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        return cls(nodes=grid, sides=sides or {})


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


def _numbered(patches: Sequence[Patch]) -> tuple[FloatArray, list[IntArray]]:
    """Glued node coordinates (N, 2) and each patch's node numbers."""
    points = np.concatenate([patch.nodes.reshape(-1, 2) for patch in patches])
    extent = float(np.ptp(points, axis=0).max())
    keys = np.round((points - points.min(axis=0)) / extent * _GLUE).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    numbers = np.split(
        inverse.ravel(), np.cumsum([p.nodes.shape[0] * p.nodes.shape[1] for p in patches])[:-1]
    )
    shaped = [n.reshape(p.nodes.shape[:2]).astype(np.int64) for n, p in zip(numbers, patches, strict=True)]
    return points[first], shaped


def _quads(number: IntArray) -> IntArray:
    """Nine nodes per cell: four vertices, four mid-sides, the centre; shape (9, cells)."""
    a, b, c = slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)
    order = [(a, a), (c, a), (c, c), (a, c), (b, a), (c, b), (b, c), (a, b), (b, b)]
    return np.stack([number[i, j].ravel() for i, j in order])


def _side(number: IntArray, side: str) -> IntArray:
    chains = {"west": number[0], "east": number[-1], "south": number[:, 0], "north": number[:, -1]}
    return np.asarray(chains[side], dtype=np.int64)


def _named_facets(mesh: Any, nodes: FloatArray, patches: Sequence[Patch], numbers: list[IntArray]) -> Any:
    """Boundary facets by name: those whose two vertices lie on one named side of a patch."""
    where = {tuple(point): index for index, point in enumerate(mesh.doflocs.T[: mesh.nvertices])}
    facets = {tuple(sorted(pair)): index for index, pair in enumerate(mesh.facets.T.tolist())}
    named: dict[str, list[int]] = {}
    for patch, number in zip(patches, numbers, strict=True):
        for side, name in patch.sides.items():
            chain = [where[tuple(nodes[n])] for n in _side(number, side)[::2]]
            pairs = pairwise(chain)
            named.setdefault(name, []).extend(facets[(min(p), max(p))] for p in pairs)
    return {name: np.array(sorted(found)) for name, found in named.items()}


def patch_mesh(patches: Sequence[Patch]) -> Any:
    """Nine-node quadrilaterals of patches, glued where nodes coincide, with named boundaries."""
    nodes, numbers = _numbered(patches)
    mesh = MeshQuad2(np.ascontiguousarray(nodes.T), np.concatenate([_quads(n) for n in numbers], axis=1))
    return mesh.with_boundaries(_named_facets(mesh, nodes, patches, numbers))


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
    """Share of a line's length that no cell exceeds, at two cells per fold."""
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
        patches = [
            Patch.tensor(x=outside, y=core, sides={"east": "far", "south": "axis"}),
            Patch.tensor(x=outside, y=around, sides={"east": "far", "west": "wall", "north": "side"}),
            Patch.tensor(x=inside, y=core, sides={"east": "deep", "south": "axis", "north": "wall"}),
        ]
        return patch_mesh(patches)

    def system(self, *, end: End) -> FlowSystem:
        """Discrete equations of an end: developed flow deep in the tube, no force on the far reservoir."""
        space = FlowSpace.taylor_hood(mesh=self.mesh(end=end), axisymmetric=True)
        conditions = [Dirichlet(boundary="deep", component=0, value=lambda x: 2 * (1 - 4 * x[1] ** 2))]
        conditions += [Dirichlet(boundary=name, component=1) for name in ("deep", "wall", "axis")]
        conditions.append(Dirichlet(boundary="wall", component=0))
        if end == "exit":
            # The jet draws liquid in through the side; left free along it, that goes unstable near Re 1950.
            conditions.append(Dirichlet(boundary="side", component=0))
        return FlowSystem.of(space=space, conditions=conditions)


def _graded_line(*, length: float, longest: float, cells: EndMesh) -> FloatArray:
    """Vertices from 0 to a length whose cells grow geometrically from the edge cell up to the longest one."""
    growth = np.exp(1 / cells.cells_per_fold)
    limit = 2 * longest / cells.cells_per_fold
    steps = [cells.edge_cell]
    while sum(steps) < length:
        steps.append(min(steps[-1] * growth, limit))
    vertices = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(vertices * (length / vertices[-1]), dtype=np.float64)


def _line(length: float, longest: float, cells: EndMesh) -> FloatArray:
    return with_midpoints(vertices=_graded_line(length=length, longest=longest, cells=cells))


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
