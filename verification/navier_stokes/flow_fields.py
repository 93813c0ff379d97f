"""Laminar flow fields of the tube, ready to draw: its rotating section, its entrance and its exit.

Lengths over the bore d, velocities over the mean velocity U, on meshes coarse enough to take about a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from skfem import BilinearForm, LinearForm, condense, solve
from skfem.helpers import dot, grad

from ringbalance.physics.results import Status, StatusCode
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import Dirichlet, FlowSystem
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
_END_SCALE: Final = 5.0
_SECTION: Final = SectionMesh(around=6, across=9, wall_ratio=15.0)
_WINDOWS: Final = {"entrance": (-2.5, 5.0, 2.5), "exit": (-2.0, 8.0, 2.5)}
"""Least and largest x, and largest r, that are drawn."""
_FLOW_THROUGH: Final = 1 / 8
"""Stream function at the tube's wall, over U d^2: integral of u_x r dr from the axis to the wall."""

_squared_slope = BilinearForm(lambda u, v, w: w.weight * dot(grad(u), grad(v)))
_slope_along = LinearForm(lambda v, w: w.weight * dot(w.across, grad(v)))


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowField:
    """A flow at the nodes of triangles."""

    points: FloatArray
    """Over d, shape (2, n): (y, z) of the section, z along the rotation axis, y = z cross the axial
    direction; (x, r) of an end, its mouth at x = 0, flow towards larger x, r >= 0."""
    triangles: IntArray
    """Node numbers, counter-clockwise, shape (m, 3)."""
    velocity: FloatArray
    """Over U, along the points' directions, and of the section along the tube too, shape (2 or 3, n)."""
    stream_function: FloatArray
    """Section: psi/(U d), u = dpsi/dz, v = -dpsi/dy, 0 at the wall; end: psi/(U d^2), u_x = dpsi/dr / r, 0 on
    the axis, 1/8 on the tube's wall; shape (n,)."""
    reynolds: float
    """Re of the flow."""
    rotation_reynolds: float = 0.0
    """R of the flow."""
    friction_ratio: float = 1.0
    """F of the section, on this coarse mesh."""
    status: Status


def section_field(*, reynolds: float, rotation_reynolds: float) -> FlowField:
    """Developed laminar flow over the whole section of a tube that turns about an axis normal to it.

    Beyond R Re = 1e6 or R = 1e4 it is the nearest flow of the same R/Re, its status OUT_OF_RANGE.
    Args: `reynolds`: above zero. `rotation_reynolds`: zero or more.
    Raises: ArithmeticError: the flow was not found.
    """
    full_kl, s = reynolds * rotation_reynolds, rotation_reynolds / reynolds
    kl = min(full_kl, LARGEST_KL, LARGEST_ROTATION * (LARGEST_ROTATION / s)) if s > 0.0 else 0.0
    system = _SECTION.system()
    settings = NewtonSettings(max_iterations=10, tolerance=1e-6)
    flow = developed_section(system=system, kl=kl, s=s, settings=settings)
    status = Status()
    if kl < full_kl:
        text = (
            f"drawn at the nearest flow of the same R/Re with R Re <= {LARGEST_KL:.0e} and "
            f"R <= {LARGEST_ROTATION:.0e}: beyond, steady flow in one pair of vortices is not to be expected"
        )
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
        reynolds = float(np.sqrt(kl / s))
    # The half section and its mirror image share the nodes on the symmetry line.
    half = system.nodes
    off = np.setdiff1d(np.arange(half.shape[1]), system.boundary_nodes("symmetry"))
    image = np.arange(half.shape[1])
    image[off] = half.shape[1] + np.arange(off.size)
    triangles = _triangles(system)
    u, v, w = flow.velocity
    in_plane = system.at_points(flow.velocity)[0][:2]
    edge = np.union1d(system.boundary_nodes("wall"), system.boundary_nodes("symmetry"))
    psi = _potential(system, in_plane[::-1] * [[[-1.0]], [[1.0]]], {0.0: edge})

    def both(*fields: tuple[FloatArray, float]) -> FloatArray:
        """Fields of the half and of its mirror image, each field with the sign of its image."""
        return np.stack([np.concatenate([values, sign * values[off]]) for values, sign in fields])

    return FlowField(
        points=both((half[0], 1.0), (half[1], -1.0)),
        triangles=np.concatenate([triangles, image[triangles][:, ::-1]]),
        velocity=both((u / reynolds, 1.0), (v / reynolds, -1.0), (w, 1.0)),
        stream_function=both((psi / reynolds, -1.0))[0],
        reynolds=reynolds,
        rotation_reynolds=reynolds * s,
        friction_ratio=friction_ratio(flow),
        status=status,
    )


def end_field(end: End, *, reynolds: float) -> FlowField:
    """Laminar flow near a sharp-edged mouth between the tube and a large reservoir.

    Args: `reynolds`: above zero, at most 2000.
    Raises: ArithmeticError: the flow was not found.
    """
    if end == "entrance":
        cells = EndMesh(cells_per_fold=1.8, edge_cell=1e-2, reservoir=10.0, tube=10.0 + 0.1 * reynolds)
        first = 3.0

        def sink_velocity(component: int, points: FloatArray) -> FloatArray:
            """Velocity of a half-space that drains U pi d^2/4 at the origin."""
            distance = np.maximum(np.hypot(points[0], points[1]), 0.5)
            return np.asarray(-points[component] / (8 * distance**3), dtype=np.float64)

        # A sink's velocity on the far sides: free inflow so near is unstable at high Re.
        conditions = [
            Dirichlet(boundary=boundary, component=c, value=partial(sink_velocity, c))
            for boundary in ("far", "side")
            for c in (0, 1)
        ]
        conditions += [Dirichlet(boundary="wall", component=c) for c in (0, 1)]
        conditions += [Dirichlet(boundary="deep", component=1), Dirichlet(boundary="axis", component=1)]
        system = FlowSystem.of(mesh=cells.mesh(end="entrance"), conditions=conditions, axisymmetric=True)
    else:
        cells = EndMesh(cells_per_fold=1.3, edge_cell=1e-2, reservoir=15.0, tube=2.0, jet_cell=1.0)
        system, first = cells.system(end="exit"), 1.2
    settings = NewtonSettings(max_iterations=10, tolerance=1e-5)

    def solve_at(a: float, start: FlowSolution | None) -> FlowSolution:
        scaled = _END_SCALE * float(np.expm1(a))
        return solve_end(system=system, reynolds=scaled, start=start, settings=settings)

    flow = flow_at(solve=solve_at, parameter=float(np.log1p(reynolds / _END_SCALE)), first=first)
    low, high, radius = _WINDOWS[end]
    x, r = system.nodes[:, system.velocity.element_dofs[8]]
    in_window = np.flatnonzero((x > low) & (x < high) & (r < radius))
    used, triangles = np.unique(_triangles(system, in_window), return_inverse=True)
    u, v = system.at_points(flow.velocity)[0]
    # The weight makes this a fit of the velocity, each component of which is a derivative of psi over r; the
    # quadrature weights contain one factor r.
    r = system.points[1]
    boundary_values = {0.0: system.boundary_nodes("axis"), _FLOW_THROUGH: system.boundary_nodes("wall")}
    psi = _potential(system, np.stack([-r * v, r * u]), boundary_values, r**-2)
    return FlowField(
        points=system.nodes[:, used],
        triangles=triangles.reshape(-1, 3).astype(np.int64),
        velocity=flow.velocity[:, used],
        stream_function=psi[used],
        reynolds=reynolds,
        status=Status(),
    )


def _potential(
    system: FlowSystem,
    gradient: FloatArray,
    boundary_values: dict[float, IntArray],
    weight: FloatArray | float = 1.0,
) -> FloatArray:
    """Nodal psi with given boundary values, its gradient fitted to `gradient` by weighted least squares."""
    basis: Any = system.velocity
    psi = np.zeros(basis.N)
    for value, nodes in boundary_values.items():
        psi[nodes] = value
    matrix = _squared_slope.assemble(basis, weight=weight)
    right = _slope_along.assemble(basis, weight=weight, across=gradient)
    fixed = np.unique(np.concatenate(list(boundary_values.values())))
    return np.asarray(solve(*condense(matrix, right, x=psi, D=fixed)), dtype=np.float64)


def _triangles(system: FlowSystem, cells: IntArray | slice = slice(None)) -> IntArray:
    """Eight straight triangles per nine-node cell, counter-clockwise, shape (m, 3)."""
    v0, v1, v2, v3, s, e, n, w, c = system.velocity.element_dofs[:, cells]
    quads = [(v0, s, c, w), (s, v1, e, c), (c, e, v2, n), (w, c, n, v3)]
    nodes = np.concatenate([np.stack(quad, axis=1) for quad in quads]).astype(np.int64)
    x, y = system.nodes[:, nodes]
    area = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    straight = np.where((area > 0)[:, None], nodes, nodes[:, ::-1])
    return np.concatenate([straight[:, [0, 1, 2]], straight[:, [0, 2, 3]]])
