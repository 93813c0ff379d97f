"""Laminar flow fields of the tube, ready to draw: its rotating section, its entrance and its exit.

Lengths over the bore d, velocities over the mean velocity U, on meshes coarse enough to take about a second.
Beyond the parameters that can be drawn, the flow at the nearest ones is given, and its status says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from skfem import BilinearForm, LinearForm, condense, solve
from skfem.helpers import dot, grad

from ringbalance.physics.results import Status, StatusCode
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import Dirichlet, FlowSpace, FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, flow_at
from ringbalance.verification.navier_stokes.tube import (
    End,
    EndMesh,
    SectionMesh,
    developed_section,
    friction_ratio,
    solve_end,
)

LARGEST_KL: Final = 1e6
"""R Re up to which the section is drawn; near it further steady flows appear."""
LARGEST_ROTATION: Final = 1e4
"""R up to which the drawing's mesh resolves the layer at the wall."""
LARGEST_END_REYNOLDS: Final = 2000.0
_END_SCALE = 5.0
_SECTION: Final = SectionMesh(around=6, across=9, wall_ratio=15.0)
_WINDOWS: Final = {"entrance": (-2.5, 5.0, 2.5), "exit": (-2.0, 8.0, 2.5)}
_FLOW_THROUGH: Final = 1 / 8
"""Stream function at the tube's wall: integral of u_x r dr over the radius, in U d^2."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SectionFlow:
    """Developed flow in the whole section of the rotating tube."""

    points: FloatArray
    """(y, z)/d, shape (2, n): z along the rotation axis, y = z cross the axial direction."""
    triangles: IntArray
    """Node numbers, counter-clockwise, shape (m, 3)."""
    axial_velocity: FloatArray
    """w/U, shape (n,)."""
    velocity: FloatArray
    """In-plane (u, v)/U along (y, z), shape (2, n)."""
    stream_function: FloatArray
    """psi/(U d), u = dpsi/dz, v = -dpsi/dy, 0 at the wall, shape (n,)."""
    reynolds: float
    """Re of the flow given."""
    rotation_reynolds: float
    """R of the flow given."""
    friction_ratio: float
    """F of the flow given, on this coarse mesh."""
    status: Status

    @classmethod
    def of(cls, *, reynolds: float, rotation_reynolds: float) -> SectionFlow:
        """Developed laminar flow over the section of a tube that turns about an axis across it.

        Beyond R Re = 1e6 or R = 1e4 it is the nearest flow of the same R/Re, its status OUT_OF_RANGE.
        Raises: ValueError: an argument that is not finite or out of its bounds.
        Raises: ArithmeticError: the flow was not found.
        """
        _check(reynolds, "reynolds", above=True)
        _check(rotation_reynolds, "rotation_reynolds", above=False)
        kl, s = reynolds * rotation_reynolds, rotation_reynolds / reynolds
        drawn = min(kl, LARGEST_KL, LARGEST_ROTATION * (LARGEST_ROTATION / s)) if s > 0.0 else 0.0
        system = _SECTION.system()
        settings = NewtonSettings(max_iterations=10, tolerance=1e-6)
        flow = developed_section(system=system, kl=drawn, s=s, settings=settings)
        re = reynolds if drawn == kl else float(np.sqrt(drawn / s))
        return _whole_section(system, flow, re, re * s, _section_status(drawn < kl))


@dataclass(frozen=True, kw_only=True, eq=False)
class EndFlow:
    """Axisymmetric flow near a mouth of the tube; the mouth lies at x = 0, liquid flows towards larger x."""

    points: FloatArray
    """(x, r)/d, shape (2, n), r >= 0."""
    triangles: IntArray
    """Node numbers, counter-clockwise, shape (m, 3)."""
    velocity: FloatArray
    """(u_x, u_r)/U, shape (2, n)."""
    speed: FloatArray
    """Magnitude of the velocity over U, shape (n,)."""
    stream_function: FloatArray
    """psi/(U d^2), u_x = dpsi/dr / r, 0 on the axis, 1/8 on the tube's wall, shape (n,)."""
    pressure: FloatArray
    """2 (p - p_reservoir)/(rho U^2), shape (n,)."""
    reynolds: float
    """Re of the flow given."""
    status: Status

    @classmethod
    def exit(cls, *, reynolds: float) -> EndFlow:
        """Laminar developed flow from a sharp-edged tube into a reservoir; else as `EndFlow.entrance`."""
        _check(reynolds, "reynolds", above=True)
        cells = EndMesh(cells_per_fold=1.3, edge_cell=1e-2, reservoir=15.0, tube=2.0, jet_cell=1.0)
        return _end_flow("exit", cells.system(end="exit"), reynolds, 1.2)

    @classmethod
    def entrance(cls, *, reynolds: float) -> EndFlow:
        """Laminar flow near the mouth from a large reservoir into a sharp-edged tube, see `end_losses`.

        Beyond Re = 2000 it is the one there, its status OUT_OF_RANGE.
        Raises: ValueError: an argument that is not finite or not above zero.
        Raises: ArithmeticError: the flow was not found.
        """
        _check(reynolds, "reynolds", above=True)
        length = 10.0 + 0.1 * min(reynolds, LARGEST_END_REYNOLDS)
        cells = EndMesh(cells_per_fold=1.8, edge_cell=1e-2, reservoir=10.0, tube=length)
        return _end_flow("entrance", _entrance_system(cells), reynolds, 3.0)


def _triangles(space: FlowSpace, cells: IntArray | slice = slice(None)) -> IntArray:
    """Eight straight triangles per nine-node cell, counter-clockwise, shape (m, 3)."""
    v0, v1, v2, v3, s, e, n, w, c = space.velocity.element_dofs[:, cells]
    quads = [(v0, s, c, w), (s, v1, e, c), (c, e, v2, n), (w, c, n, v3)]
    nodes = np.concatenate([np.stack(quad, axis=1) for quad in quads]).astype(np.int64)
    x, y = space.node_coordinates()[:, nodes]
    area = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    straight = np.where((area > 0)[:, None], nodes, nodes[:, ::-1])
    return np.concatenate([straight[:, [0, 1, 2]], straight[:, [0, 2, 3]]])


def _squared_slope(u: Any, v: Any, w: Any) -> Any:
    return w.weight * dot(grad(u), grad(v))


def _slope_along(v: Any, w: Any) -> Any:
    return w.weight * (w.across[0] * grad(v)[0] + w.across[1] * grad(v)[1])


def _potential(
    space: FlowSpace, gradient: FloatArray, known: IntArray, values: FloatArray, weight: FloatArray
) -> FloatArray:
    """Nodal psi with known values at some nodes whose gradient is nearest to a given one, by a weight."""
    matrix = BilinearForm(_squared_slope).assemble(space.velocity, weight=weight)
    right = LinearForm(_slope_along).assemble(space.velocity, weight=weight, across=gradient)
    psi = np.zeros(space.velocity_nodes)
    psi[known] = values
    return np.asarray(solve(*condense(matrix, right, x=psi, D=known)), dtype=np.float64)


def _section_status(clipped: bool) -> Status:
    if not clipped:
        return Status()
    text = (
        f"drawn at the nearest flow of the same R/Re with R Re <= {LARGEST_KL:.0e} and "
        f"R <= {LARGEST_ROTATION:.0e}: beyond, steady flow in one pair of vortices is not to be expected"
    )
    return Status(code=StatusCode.OUT_OF_RANGE, text=text)


def _in_plane_stream_function(system: FlowSystem, flow: FlowSolution) -> FloatArray:
    space = system.space
    u, v = space.at_points(flow.velocity)[0][:2]
    edge = np.concatenate([space.boundary_nodes(name) for name in ("wall", "symmetry")])
    known = np.unique(edge).astype(np.int64)
    return _potential(space, np.stack([-v, u]), known, np.zeros(1), space.measure)


def _whole_section(
    system: FlowSystem, flow: FlowSolution, re: float, rotation: float, status: Status
) -> SectionFlow:
    """The half section and its mirror image, which share the nodes on the symmetry line."""
    space = system.space
    half = space.node_coordinates()
    on_line = np.zeros(half.shape[1], dtype=bool)
    on_line[space.boundary_nodes("symmetry")] = True
    off = np.flatnonzero(~on_line)
    image = np.arange(half.shape[1])
    image[off] = half.shape[1] + np.arange(off.size)
    triangles = _triangles(space)
    u, v, w = flow.velocity
    psi = _in_plane_stream_function(system, flow)

    def both(values: FloatArray, sign: float) -> FloatArray:
        return np.concatenate([values, sign * values[off]])

    return SectionFlow(
        points=np.stack([both(half[0], 1.0), both(half[1], -1.0)]),
        triangles=np.concatenate([triangles, image[triangles][:, ::-1]]),
        axial_velocity=both(w, 1.0),
        velocity=np.stack([both(u, 1.0), both(v, -1.0)]) / re,
        stream_function=both(psi, -1.0) / re,
        reynolds=re,
        rotation_reynolds=rotation,
        friction_ratio=friction_ratio(flow),
        status=status,
    )


def _check(value: float, name: str, *, above: bool) -> None:
    if not (np.isfinite(value) and (value > 0.0 if above else value >= 0.0)):
        raise ValueError(f"{name} must be finite and {'above zero' if above else 'not negative'}")


def _sink(component: int) -> Callable[[FloatArray], FloatArray]:
    """Velocity of a half-space that drains U pi d^2/4 at the origin."""

    def velocity(at: FloatArray) -> FloatArray:
        distance = np.maximum(np.hypot(at[0], at[1]), 0.5)
        return np.asarray(-at[component] / (8 * distance**3), dtype=np.float64)

    return velocity


def _entrance_system(cells: EndMesh) -> FlowSystem:
    """An entrance fed by a sink's flow: let in freely so near, liquid at high Re makes the solve unstable."""
    space = FlowSpace.taylor_hood(mesh=cells.mesh(end="entrance"), axisymmetric=True)
    conditions = [Dirichlet(boundary=b, component=c, value=_sink(c)) for b in ("far", "side") for c in (0, 1)]
    conditions += [Dirichlet(boundary="wall", component=c) for c in (0, 1)]
    conditions += [Dirichlet(boundary="deep", component=1), Dirichlet(boundary="axis", component=1)]
    return FlowSystem.of(space=space, conditions=conditions)


def _reservoir_pressure(space: FlowSpace, pressure: FloatArray) -> float:
    """Mean over the far surface."""
    basis: Any = space.pressure
    return float(pressure[basis.get_dofs("far").flatten()].mean())


def _end_flow(end: End, system: FlowSystem, reynolds: float, first: float) -> EndFlow:
    re = min(reynolds, LARGEST_END_REYNOLDS)
    settings = NewtonSettings(max_iterations=10, tolerance=1e-5)

    def flow_from(a: float, start: FlowSolution | None) -> FlowSolution:
        at = _END_SCALE * float(np.expm1(a))
        return solve_end(system=system, reynolds=at, start=start, settings=settings)

    flow = flow_at(solve=flow_from, parameter=float(np.log1p(re / _END_SCALE)), first=first)
    status = Status()
    if re < reynolds:
        text = f"drawn at Re = {re:.0f}: beyond, steady laminar flow is not to be expected"
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return _near_the_mouth(end, system, flow, re, status)


def _meridional_stream_function(system: FlowSystem, flow: FlowSolution) -> FloatArray:
    space = system.space
    u, v = space.at_points(flow.velocity)[0]
    axis, wall = (space.boundary_nodes(name) for name in ("axis", "wall"))
    values = np.concatenate([np.zeros(axis.size), np.full(wall.size, _FLOW_THROUGH)])
    r = space.points[1]
    # Weighted so that the fit is of the velocity, whose every component is a derivative of psi over r.
    return _potential(space, np.stack([-r * v, r * u]), np.concatenate([axis, wall]), values, 1 / r)


def _nodal_pressure(*, space: FlowSpace, pressure: FloatArray) -> FloatArray:
    """The linear pressure at all nodes of the velocity."""
    basis: Any = space.pressure
    at = np.asarray(space.velocity.elem.doflocs, dtype=np.float64).T
    shape = np.stack([np.broadcast_to(basis.elem.lbasis(at, i)[0], at.shape[1]) for i in range(basis.Nbfun)])
    out = np.zeros(space.velocity_nodes)
    out[space.velocity.element_dofs] = np.einsum("in,ie->ne", shape, pressure[basis.element_dofs])
    return out


def _near_the_mouth(end: End, system: FlowSystem, flow: FlowSolution, re: float, status: Status) -> EndFlow:
    space = system.space
    at = space.node_coordinates()
    low, high, radius = _WINDOWS[end]
    x, r = (c[space.velocity.element_dofs[8]] for c in at)
    cells = np.flatnonzero((x > low) & (x < high) & (r < radius))
    reservoir = _reservoir_pressure(space, flow.pressure)
    used, triangles = np.unique(_triangles(space, cells), return_inverse=True)
    return EndFlow(
        points=at[:, used],
        triangles=triangles.reshape(-1, 3).astype(np.int64),
        velocity=flow.velocity[:, used],
        speed=np.asarray(np.hypot(*flow.velocity[:, used]), dtype=np.float64),
        stream_function=_meridional_stream_function(system, flow)[used],
        pressure=2 / re * _nodal_pressure(space=space, pressure=flow.pressure - reservoir)[used],
        reynolds=re,
        status=status,
    )
