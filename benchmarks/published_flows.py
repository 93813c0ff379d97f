"""Published flows that verify the kernel: Kovasznay, Taylor-Couette, lid-driven cavity, cylinder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, solve_flow
from ringbalance.verification.navier_stokes.tube import (
    geometric_vertices,
    patch_mesh,
    ruled,
    tensor,
    with_midpoints,
)

Field = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, kw_only=True)
class FieldErrors:
    """Errors of a discrete flow in the norms of the theory."""

    velocity_l2: float
    velocity_h1: float
    """Error of the gradient alone."""
    pressure_l2: float


@dataclass(frozen=True, kw_only=True)
class TaylorCouette:
    """Flow between rotating cylinders, computed and exact."""

    torque: float
    """Torque on the inner cylinder, per unit depth."""
    exact_torque: float
    velocity_error: float
    """Largest nodal error over the largest wall velocity."""


@dataclass(frozen=True, kw_only=True)
class CylinderForces:
    """Compared quantities of the cylinder benchmark 2D-1."""

    drag: float
    lift: float
    pressure_difference: float
    unknowns: int


def reaction(system: FlowSystem, solution: FlowSolution, *, viscosity: float) -> FloatArray:
    """Force of the surroundings on a fluid of density 1 at its nodes, shape (components, velocity nodes)."""
    residual = system.linear_matrix(Coefficients(viscosity=viscosity)) @ solution.vector
    residual += system.convection_vector(solution.vector)
    residual[system.free] = 0.0
    return system.split(residual)[0]


def wall_force(*, system: FlowSystem, solution: FlowSolution, boundary: str, viscosity: float) -> FloatArray:
    """Force of the fluid on a boundary, from the residual of its momentum equations.

    F = -sum over the boundary's nodes of (weak momentum residual).
    Args: `boundary`: name of a boundary whose velocity is given.
    Returns: Shape (components,), per unit depth on a plane mesh (per radian in (x, r)).
    Source: e.g. Giles, Larson, Levenstam, Suli, Oxford NA-97/06 (1997), on dual evaluation of wall forces.
    """
    nodes = system.boundary_nodes(boundary)
    return np.asarray(-reaction(system, solution, viscosity=viscosity)[:, nodes].sum(axis=1))


def wall_torque(
    *,
    system: FlowSystem,
    solution: FlowSolution,
    boundary: str,
    viscosity: float,
    centre: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Torque of the fluid on a boundary of a plane flow, counter-clockwise positive, from the residual.

    T = -sum over nodes of [(x - x0) R_y - (y - y0) R_x]; needs the stress form when the wall moves.
    Args: `boundary`: name of a boundary whose velocity is given. `centre`: (x0, y0).
    """
    nodes = system.boundary_nodes(boundary)
    x, y = system.nodes[:, nodes] - np.asarray(centre)[:, None]
    force = reaction(system, solution, viscosity=viscosity)[:, nodes]
    return float(-(x * force[1] - y * force[0]).sum())


def kovasznay(*, reynolds: float) -> tuple[Field, Field, Field]:
    """Kovasznay's exact flow behind a grid.

    u = 1 - e^(l x) cos 2 pi y, v = l/(2 pi) e^(l x) sin 2 pi y, p = -e^(2 l x)/2,
    l = Re/2 - sqrt(Re^2/4 + 4 pi^2).
    Args: `reynolds`: Re, above zero.
    Returns: Velocity (2, ...), its gradient (component, direction, ...) and pressure, as functions of
        coordinates.
    Source: L. I. G. Kovasznay, Proc. Camb. Phil. Soc. 44 (1948) 58, doi 10.1017/S0305004100023999.
    """
    rate, turn = reynolds / 2 - np.sqrt(reynolds**2 / 4 + 4 * np.pi**2), 2 * np.pi

    def velocity(x: FloatArray) -> FloatArray:
        decay = np.exp(rate * x[0])
        return np.stack([1 - decay * np.cos(turn * x[1]), rate / turn * decay * np.sin(turn * x[1])])

    def gradient(x: FloatArray) -> FloatArray:
        decay, cosine, sine = np.exp(rate * x[0]), np.cos(turn * x[1]), np.sin(turn * x[1])
        streamwise = np.stack([-rate * decay * cosine, turn * decay * sine])
        across = np.stack([rate**2 / turn * decay * sine, rate * decay * cosine])
        return np.stack([streamwise, across])

    def pressure(x: FloatArray) -> FloatArray:
        return np.asarray(-np.exp(2 * rate * x[0]) / 2, dtype=np.float64)

    return velocity, gradient, pressure


def kovasznay_flow(*, cells: int, reynolds: float = 40.0) -> tuple[FlowSystem, FlowSolution]:
    """Kovasznay's flow on (-1/2, 1) x (-1/2, 1/2), its velocity given all round.

    Args: `cells`: along each side. `reynolds`: Re.
    """
    x, y = np.linspace(-0.5, 1.0, 2 * cells + 1), np.linspace(-0.5, 0.5, 2 * cells + 1)
    mesh = patch_mesh([tensor(x=x, y=y)])
    velocity = kovasznay(reynolds=reynolds)[0]
    conditions = [
        Dirichlet(boundary="wall", component=0, value=lambda x: velocity(x)[0]),
        Dirichlet(boundary="wall", component=1, value=lambda x: velocity(x)[1]),
    ]
    system = FlowSystem.of(mesh=mesh, conditions=conditions, enclosed=True)
    return system, solve_flow(system=system, coefficients=Coefficients(viscosity=1 / reynolds))


def field_errors(
    *, system: FlowSystem, solution: FlowSolution, velocity: Field, gradient: Field, pressure: Field
) -> FieldErrors:
    """L2 errors of velocity, velocity gradient and pressure (pressures compared at zero mean).

    Args: `velocity`: exact, of coordinates. `gradient`: exact, (component, direction, ...). `pressure`:
        exact, up to a constant.
    Returns: The three errors.
    """
    u, du = system.at_points(solution.velocity)
    p = np.asarray(system.pressure.interpolate(solution.pressure))
    w, area, points = system.weights, system.weights.sum(), system.points
    exact = pressure(points)
    gap = (p - (w * p).sum() / area) - (exact - (w * exact).sum() / area)
    return FieldErrors(
        velocity_l2=float(np.sqrt((w * (u - velocity(points)) ** 2).sum())),
        velocity_h1=float(np.sqrt((w * (du - gradient(points)) ** 2).sum())),
        pressure_l2=float(np.sqrt((w * gap**2).sum())),
    )


def _arc(radius: float, angles: FloatArray, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    circle = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(circle + np.asarray(centre), dtype=np.float64)


def _spinning(speed: float, component: int) -> Field:
    """Velocity component of a solid rotation about the origin."""
    return lambda x: np.asarray(-speed * x[1] if component == 0 else speed * x[0], dtype=np.float64)


def taylor_couette(
    *,
    cells: int,
    inner_radius: float,
    outer_radius: float,
    inner_speed: float,
    outer_speed: float,
    viscosity: float,
) -> TaylorCouette:
    """Flow between two rotating cylinders, with the torque on the inner one.

    u_phi = A r + B/r, torque = -4 pi mu B on the inner cylinder.
    Args: `cells`: across the gap; eight times as many around. `inner_radius`: r1. `outer_radius`: r2.
        `inner_speed`: angular velocity of the inner cylinder, counter-clockwise. `viscosity`: dynamic;
        density is 1.
    Returns: Torque and velocity error with the exact values.
    Source: exact; e.g. Batchelor, An Introduction to Fluid Dynamics (1967), section 4.4.
    """
    around = np.linspace(0.0, 2 * np.pi, 16 * cells + 1)
    around[-1] = 0.0
    inner, outer = _arc(inner_radius, around), _arc(outer_radius, around)
    blend = np.linspace(0.0, 1.0, 2 * cells + 1)
    middle = (inner_radius + outer_radius) / 2
    ring = patch_mesh(
        [ruled(inner=inner, outer=outer, blend=blend)], inner=lambda at: np.hypot(at[0], at[1]) < middle
    )
    walls = (("inner", inner_speed), ("wall", outer_speed))
    conditions = [Dirichlet(boundary=b, component=c, value=_spinning(w, c)) for b, w in walls for c in (0, 1)]
    system = FlowSystem.of(mesh=ring, conditions=conditions, enclosed=True, stress_form=True)
    solution = solve_flow(system=system, coefficients=Coefficients(viscosity=viscosity))
    gap = outer_radius**2 - inner_radius**2
    solid = (outer_speed * outer_radius**2 - inner_speed * inner_radius**2) / gap
    vortex = (inner_speed - outer_speed) * (inner_radius * outer_radius) ** 2 / gap
    x = system.nodes
    spin = solid + vortex / (x**2).sum(axis=0)
    error = np.abs(solution.velocity - np.stack([-spin * x[1], spin * x[0]])).max()
    return TaylorCouette(
        torque=wall_torque(system=system, solution=solution, boundary="inner", viscosity=viscosity),
        exact_torque=-4 * np.pi * viscosity * vortex,
        velocity_error=float(error / max(abs(inner_speed) * inner_radius, abs(outer_speed) * outer_radius)),
    )


def cavity_flow(*, cells: int, reynolds: float, wall_ratio: float = 4.0) -> tuple[FlowSystem, FlowSolution]:
    """Flow in a unit square under a lid that moves with u = 1, its cells refined towards the walls.

    Args: `cells`: along each side, even. `reynolds`: Re; continued from lower ones above 200. `wall_ratio`:
        middle cell over wall cell.
    Returns: The system and its solution; the status is that of the last Reynolds number solved.
    Source: Ghia, Ghia, Shin, J. Comput. Phys. 48 (1982) 387, doi 10.1016/0021-9991(82)90058-4.
    """
    half = geometric_vertices(cells=cells // 2, ratio=wall_ratio) / 2
    line = with_midpoints(vertices=np.concatenate([half, 1 - half[-2::-1]]))
    mesh = patch_mesh([tensor(x=line, y=line)], lid=lambda at: at[1] > 1 - 1e-9)
    conditions = [Dirichlet(boundary="lid", component=0, value=1.0), Dirichlet(boundary="lid", component=1)]
    conditions += [Dirichlet(boundary="wall", component=c) for c in (0, 1)]
    system = FlowSystem.of(mesh=mesh, conditions=conditions, enclosed=True)
    solution = None
    for step in [r for r in (100.0, 400.0, 1000.0, 2000.0) if r < reynolds] + [reynolds]:
        solution = solve_flow(system=system, coefficients=Coefficients(viscosity=1 / step), start=solution)
        if not solution.status.ok:
            break
    if solution is None:
        raise ValueError("reynolds must be above zero")
    return system, solution


_CENTRE, _RADIUS, _HEIGHT, _LENGTH = (0.2, 0.2), 0.05, 0.41, 2.2
_VISCOSITY = 1e-3


def cylinder_mesh(*, around: int, across: int, lengthwise: int, growth: float = 8.0) -> Any:
    """Curved mesh of benchmark 2D-1: a ring of four patches about the cylinder, then the channel.

    Args: `around`: cells on a quarter of the cylinder, and across the channel. `across`: cells from the
        cylinder to the channel wall. `lengthwise`: cells from the ring to the outlet. `growth`: last cell
        over first cell from the cylinder outwards.
    Returns: Quadratic mesh with boundaries inflow, outflow, wall, cylinder.
    Source: Schaefer and Turek, Benchmark computations of laminar flow around a cylinder (1996), Fig. 1.
    """
    line = np.linspace(0.0, 1.0, 2 * around + 1)[:, None]
    corners = _HEIGHT * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    blend = with_midpoints(vertices=geometric_vertices(cells=across, ratio=growth))
    patches = []
    for side in range(4):
        angles = np.pi * (1.25 + 0.5 * (side + line[:, 0]))
        outer = (1 - line) * corners[side] + line * corners[side + 1]
        patches.append(ruled(inner=_arc(_RADIUS, angles, _CENTRE), outer=outer, blend=blend))
    x = with_midpoints(vertices=geometric_vertices(cells=lengthwise, ratio=4.0))
    patches.append(tensor(x=_HEIGHT + (_LENGTH - _HEIGHT) * x, y=_HEIGHT * line[:, 0]))
    return patch_mesh(
        patches,
        inflow=lambda at: at[0] < 1e-9,
        outflow=lambda at: at[0] > _LENGTH - 1e-9,
        cylinder=lambda at: np.hypot(at[0] - _CENTRE[0], at[1] - _CENTRE[1]) < 2 * _RADIUS,
    )


def cylinder_flow(*, mesh: Any) -> tuple[FlowSystem, FlowSolution]:
    """Flow past the cylinder at Re = 20 (2D-1): nu 1e-3, parabolic inflow of mean 0.2, free outflow.

    Returns: The system and its solution, SI units with density 1.
    """
    inflow = Dirichlet(
        boundary="inflow", component=0, value=lambda x: 1.2 * x[1] * (_HEIGHT - x[1]) / _HEIGHT**2
    )
    still = [Dirichlet(boundary=b, component=c) for b in ("wall", "cylinder") for c in (0, 1)]
    conditions = [inflow, Dirichlet(boundary="inflow", component=1), *still]
    system = FlowSystem.of(mesh=mesh, conditions=conditions)
    return system, solve_flow(system=system, coefficients=Coefficients(viscosity=_VISCOSITY))


def cylinder_forces(*, system: FlowSystem, solution: FlowSolution) -> CylinderForces:
    """Drag and lift coefficients and the pressure difference of benchmark 2D-1.

    c = 2 F/(rho U^2 D) with U = 0.2, D = 0.1; dp = p(0.15, 0.2) - p(0.25, 0.2).
    Returns: The three quantities.
    Source: reference values 5.57953523384, 0.010618948146, 0.11752016697 of G. Nabh, dissertation, Heidelberg
        (1998), for the problem of Schaefer and Turek (1996).
    """
    drag, lift = 500.0 * wall_force(
        system=system, solution=solution, boundary="cylinder", viscosity=_VISCOSITY
    )
    x = system.pressure.doflocs
    front = np.argmin(np.hypot(x[0] - 0.15, x[1] - 0.2))
    back = np.argmin(np.hypot(x[0] - 0.25, x[1] - 0.2))
    return CylinderForces(
        drag=float(drag),
        lift=float(lift),
        pressure_difference=float(solution.pressure[front] - solution.pressure[back]),
        unknowns=system.unknowns,
    )
