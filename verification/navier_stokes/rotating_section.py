"""Laminar fully developed flow in a straight tube that rotates about an axis at right angles to its own.

Half of the section, circular or rectangular, lengths over the bore or hydraulic diameter d, velocities over
the mean velocity U.  With x along the tube, z along the rotation axis, w the axial and (u, v) the velocity
along (y, z), and p the reduced pressure:

    Re (u w_y + v w_z) - 2 R u = G + lap w
    Re (u u_y + v u_z) + 2 R w = -p_y + lap u
    Re (u v_y + v v_z)         = -p_z + lap v,     u_y + v_z = 0,     mean(w) = 1

Re = U d/nu, R = omega d^2/nu.  The friction ratio is F = G/32, 1 without rotation.  Equivalent pairs are
Kl = R Re and S = R/Re; at Re = 0 (S infinite) the problem is linear.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSpace, FlowSystem
from ringbalance.verification.navier_stokes.meshes import (
    Patch,
    geometric_vertices,
    patch_mesh,
    with_midpoints,
)
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
