"""Laminar flow through a bent tube in the rotating frame, in three dimensions.

The path lies in the plane across the rotation axis, as a tube between two chambers of a disc does: its legs,
its bends and the arc over the crest are all at one position along the shaft. Coriolis and centrifugal forces
then lie in that plane too, the flow is its own mirror image in it, and half the tube is enough. Without that
symmetry (with an axis in the path's plane) the whole section would be needed. With lengths over the bore d,
velocities over the mean velocity U and reduced pressure over mu U/d:

    Re (u . grad) u + 2 R e_z x u = -grad p + lap u,    div u = 0

Inflow is developed; at the outlet the traction is that of developed flow. The section's flow comes from the
same finite elements on the same cells, so a straight tube keeps it to round-off.

Across the path the stream is driven by 2 omega u, to its right when the disc turns to the left, and in a
bend by u^2/r away from the bend's centre: its curvature adds to the rotation, or subtracts. In a bend to
the left (with the rotation) both act to the same side, in one to the right they oppose each other: the bend
then costs less than the straight tube.

**The mesh** is a plane section of quadratic quadrilaterals, swept along a plane path of lines and arcs. The
section lies in (y, z) with y to the left of the path and z normal to the path's plane; the path starts at
the origin in the direction of x. Nodes lie on the true surface, mid-nodes too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from skfem import MeshHex1, MeshHex2, MeshQuad1, MeshQuad2

from ringbalance.physics.tube.local_losses import MOMENTUM_FACTOR
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSystem
from ringbalance.verification.navier_stokes.newton import (
    FlowSolution,
    NewtonSettings,
    StepRule,
    follow,
    solve_flow,
)
from ringbalance.verification.navier_stokes.tube import (
    SectionMesh,
    developed_section,
    geometric_vertices,
    named_facets,
    on_symmetry,
    with_midpoints,
)

# Corner of the section (0 to 3) and end of the slab for each vertex, in scikit-fem's order.
_HEXAHEDRON = ((2, 1), (2, 0), (1, 1), (3, 1), (1, 0), (3, 0), (0, 1), (0, 0))


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A straight line or an arc of the path, with the cells along it."""

    length: float
    """Along the path, in the section's unit of length."""
    turn: float = 0.0
    """Angle by which the path turns to the left, rad."""
    cells: int = 4
    ratio: float = 1.0
    """Length of the last cell over that of the first."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _SweptTube:
    """A swept mesh and its structure."""

    mesh: Any
    """`skfem.MeshHex2` with boundaries inlet, outlet, symmetry and wall."""
    section_node: IntArray
    """Section node of each node."""
    half_station: IntArray
    """Twice the station of each node; odd half-way between two."""
    arc_length: FloatArray
    """Along the path at every half-station, shape (2 slabs + 1,)."""
    path: FloatArray
    """Point of the path at every half-station, shape (2, 2 slabs + 1)."""
    direction: FloatArray
    """Unit tangent of the path at every half-station, shape (2, 2 slabs + 1)."""


def swept_tube(*, section: Any, segments: Sequence[Segment]) -> _SweptTube:
    """Mesh of a tube along a path.

    Args: `section`: `skfem.MeshQuad2` in (y, z), z >= 0.
    Returns: The mesh and its structure.
    Raises: ValueError: no segments, a length or a number of cells that is not positive, or an arc so tight
        that the section would reach its centre.
    """
    reach = float(np.abs(section.doflocs[0]).max())
    if not segments or any(s.length <= 0.0 or s.cells < 1 or s.ratio <= 0.0 for s in segments):
        raise ValueError("a path needs segments of positive length, cells and ratio")
    if any(abs(s.turn) * reach >= s.length for s in segments):
        raise ValueError("a bend is too tight: its radius must exceed half the bore")
    ends = [np.zeros(1)]
    for segment in segments:
        shares = geometric_vertices(cells=segment.cells, ratio=segment.ratio)
        ends.append(ends[-1][-1] + segment.length * shares[1:])
    arc_length = with_midpoints(vertices=np.concatenate(ends))
    slabs = (arc_length.size - 1) // 2
    # Straight mesh of the section's vertices at z = 0 to the number of slabs.
    plane = np.ascontiguousarray(section.doflocs[:, : section.nvertices])
    count = plane.shape[1]
    layers = [np.vstack([plane, np.full(count, float(k))]) for k in range(slabs + 1)]
    rows = [np.asarray(section.t[corner]) + end * count for corner, end in _HEXAHEDRON]
    cells = np.concatenate([np.stack(rows) + k * count for k in range(slabs)], axis=1)
    prism = MeshHex2.from_mesh(MeshHex1(np.concatenate(layers, axis=1), cells))
    half = np.rint(2 * prism.doflocs[2]).astype(np.int64)
    # Upright facets between two layers stand at odd half-stations on nodes of the plane section.
    straight = np.asarray(MeshQuad2.from_mesh(MeshQuad1(plane, section.t)).doflocs, dtype=np.float64)
    gap, node = cKDTree(straight.T).query(np.asarray(prism.doflocs[:2]).T)
    if gap.max() > 1e-9:
        raise ValueError("the section's nodes were not found again: it must be a mesh of quadrilaterals")
    path, direction = _path(segments, arc_length)
    y, z = np.asarray(section.doflocs)[:, node]
    left = np.stack([-direction[1], direction[0]])
    points = np.vstack([path[:, half] + y * left[:, half], z])
    named = {
        "inlet": lambda at: at[2] < 0.25,
        "outlet": lambda at: at[2] > slabs - 0.25,
        "symmetry": on_symmetry,
    }
    mesh = MeshHex2(np.ascontiguousarray(points), prism.t)
    return _SweptTube(
        mesh=mesh.with_boundaries(named_facets(prism, named)),
        section_node=np.asarray(node, dtype=np.int64),
        half_station=half,
        arc_length=arc_length,
        path=path,
        direction=direction,
    )


def _path(segments: Sequence[Segment], arc_length: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points of a path at arc lengths, and its unit tangents, each of shape (2, n)."""
    point, tangent = np.zeros((2, arc_length.size), dtype=np.complex128)
    start, origin, heading = 0.0, 0j, 0.0
    for segment in segments:
        reached = arc_length >= start
        s = np.append(np.minimum(arc_length[reached] - start, segment.length), segment.length)
        # Chord of an arc: s sinc(half the turned angle), in the mean of both headings.
        half = segment.turn * s / segment.length / 2
        points = origin + s * np.sinc(half / np.pi) * np.exp(1j * (heading + half))
        point[reached], tangent[reached] = points[:-1], np.exp(1j * (heading + 2 * half[:-1]))
        start, origin, heading = start + segment.length, points[-1], heading + segment.turn
    return np.stack([point.real, point.imag]), np.stack([tangent.real, tangent.imag])


Progress = Callable[[str], None]
_NEWTON = NewtonSettings(tolerance=1e-7, max_iterations=10)


def coefficients(*, reynolds: float, rotation_reynolds: float) -> Coefficients:
    """Coefficients of flow in a tube that turns about e_z, components along (x, y, z)."""
    twice = 2 * rotation_reynolds
    rotation = ((0.0, -twice, 0.0), (twice, 0.0, 0.0), (0.0, 0.0, 0.0))
    return Coefficients(inertia=reynolds, viscosity=1.0, rotation=rotation)


@dataclass(frozen=True, kw_only=True, eq=False)
class BentTubeFlow:
    """Flow in half a bent tube, and the developed flow that enters it."""

    tube: _SweptTube
    system: FlowSystem
    solution: FlowSolution
    developed: FlowSolution
    """Flow in the section; in-plane velocity over nu/d."""
    reynolds: float
    rotation_reynolds: float
    arc_length: FloatArray
    """Arc length of the stations between slabs, over d."""
    mean_pressure: FloatArray
    """Reduced pressure, mean over the section, over mu U/d, at those stations."""
    energy_flux: FloatArray
    """Kinetic energy carried through a station over rho U^3/2 and area: alpha, at those stations."""

    @classmethod
    def of(
        cls,
        *,
        segments: Sequence[Segment],
        cells: SectionMesh,
        reynolds: float,
        rotation_reynolds: float,
        coriolis_factor: float = 1.0,
        first_inertia: float = 1.0,
        progress: Progress | None = None,
    ) -> BentTubeFlow:
        """Steady laminar flow through a tube along a plane path that turns about the plane's normal.

        Args:
            segments: of the path, lengths over the bore; a positive turn is to the left, as the rotation.
            cells: of the half section.
            reynolds: Re = U d/nu, above zero.
            rotation_reynolds: R = omega d^2/nu, zero or more, counter-clockwise about e_z.
            coriolis_factor: on the Coriolis force in the tube, not on the inflow; other than 1 only as a
                mutation.
            first_inertia: fraction of the inertia to start with; bends at rest need less, such as 0.2.
            progress: called with a short text on the current step.
        Returns: The flow; its solution's status says NOT_CONVERGED when Newton's method failed.
        Raises: ValueError: a Reynolds number out of its bounds, or an impossible path.
        Raises: ArithmeticError: the developed flow was not found.
        Range: steady, symmetric laminar flow.
        """
        if not (np.isfinite(reynolds + rotation_reynolds) and reynolds > 0.0 and rotation_reynolds >= 0.0):
            raise ValueError("reynolds must be above zero, rotation_reynolds zero or more, both finite")
        report_progress = progress or (lambda _: None)
        section = cells.system()
        kl, s = reynolds * rotation_reynolds, rotation_reynolds / reynolds
        developed = developed_section(system=section, kl=kl, s=s)
        tube = swept_tube(section=cells.mesh(), segments=segments)
        system = _system(tube, section, developed, reynolds)
        report_progress(f"{system.free.size} unknowns in {tube.arc_length.size // 2} slabs")

        def solve(share: float, start: FlowSolution | None) -> FlowSolution:
            report_progress(f"inertia {share:.3g} of its full value")
            c = coefficients(reynolds=share * reynolds, rotation_reynolds=coriolis_factor * rotation_reynolds)
            return solve_flow(
                system=system, coefficients=c, start=start, settings=_NEWTON, progress=report_progress
            )

        solution = solve(first_inertia, _guess(tube, system, developed, reynolds))
        if first_inertia < 1.0 and solution.status.ok:
            rule = StepRule(first=first_inertia, smallest=0.02)
            path = follow(solve=solve, start=solution, start_at=first_inertia, targets=[1.0], rule=rule)
            solution = path.solutions[0] if path.status.ok else replace(solution, status=path.status)
        return cls(
            tube=tube,
            system=system,
            solution=solution,
            developed=developed,
            reynolds=reynolds,
            rotation_reynolds=rotation_reynolds,
            arc_length=tube.arc_length[::2],
            mean_pressure=_mean_pressure(tube, section, solution),
            energy_flux=_energy_flux(tube, section, solution),
        )

    @property
    def gradient(self) -> float:
        """G = -dp/dx of the developed flow on the same cells, over mu U/d^2."""
        return self.developed.driving_gradient

    def pressure_loss(self, *, start: float, end: float) -> float:
        """Loss coefficient between two arc lengths over d, 2 (H_1 - H_2)/U^2 with H = p/rho + alpha U^2/2.

        With developed flow at both ends it is the fall of reduced pressure over rho U^2/2.
        """
        head = 2 / self.reynolds * self.mean_pressure + self.energy_flux
        first, last = np.interp([start, end], self.arc_length, head)
        return float(first - last)


def _swept_velocity(tube: _SweptTube, developed: FlowSolution, reynolds: float) -> FloatArray:
    """The section's velocity at every node of the tube, Cartesian components (3, nodes)."""
    left, up, axial = developed.velocity[:, tube.section_node]
    tangent = tube.direction[:, tube.half_station]
    normal = np.stack([-tangent[1], tangent[0]])
    return np.asarray(np.vstack([axial * tangent + left / reynolds * normal, up / reynolds]))


def _pressure_nodes(tube: _SweptTube) -> tuple[IntArray, IntArray]:
    """Section node and station of every pressure node: the mesh's vertices."""
    count = tube.mesh.nvertices
    return tube.section_node[:count], tube.half_station[:count] // 2


def _system(tube: _SweptTube, section: FlowSystem, developed: FlowSolution, reynolds: float) -> FlowSystem:
    """Discrete equations of the tube, with developed inflow and the traction of developed flow outside."""
    conditions = [Dirichlet(boundary="symmetry", component=2)]
    conditions += [Dirichlet(boundary=name, component=c) for name in ("inlet", "wall") for c in range(3)]
    system = FlowSystem.of(mesh=tube.mesh, conditions=conditions)
    velocity = _swept_velocity(tube, developed, reynolds)
    velocity[:, system.boundary_nodes("wall")] = 0.0
    fixed = np.append(velocity.ravel(), np.zeros(system.pressure.N))
    fixed[system.free] = 0.0
    # Integral over the outlet of minus the section's pressure times normal and shape functions.
    pressure = developed.pressure / reynolds
    normal_force = section.load(np.asarray(section.pressure.interpolate(pressure)))
    at_outlet = np.flatnonzero(tube.half_station == tube.half_station.max())
    load = np.zeros(system.unknowns)
    system.split(load)[0][:2, at_outlet] = (
        -tube.direction[:, -1:] * normal_force[tube.section_node[at_outlet]]
    )
    return replace(system, fixed_values=fixed, source=load)


def _guess(tube: _SweptTube, system: FlowSystem, developed: FlowSolution, reynolds: float) -> FlowSolution:
    """Developed flow all along the tube, its pressure zero at the outlet but for the section's variation."""
    velocity = _swept_velocity(tube, developed, reynolds)
    node, station = _pressure_nodes(tube)
    s = tube.arc_length[::2]
    fall = developed.driving_gradient * (s[-1] - s)
    pressure = np.asarray(fall[station] + developed.pressure[node] / reynolds, dtype=np.float64)
    return FlowSolution.of(system, np.append(velocity.ravel(), pressure))


def _mean_pressure(tube: _SweptTube, section: FlowSystem, solution: FlowSolution) -> FloatArray:
    node, station = _pressure_nodes(tube)
    share = section.mean_load / section.mean_load.sum()
    return np.bincount(station, weights=share[node] * solution.pressure).astype(np.float64)


def _energy_flux(tube: _SweptTube, section: FlowSystem, solution: FlowSolution) -> FloatArray:
    """Integral of |u|^2 times the velocity along the path over the section, at the stations."""
    at = np.flatnonzero(tube.half_station % 2 == 0)
    speeds = np.zeros((tube.arc_length[::2].size, 4, section.velocity.N))
    tangent = tube.direction[:, tube.half_station[at]]
    u = solution.velocity[:, at]
    stations = tube.half_station[at] // 2
    speeds[stations, :3, tube.section_node[at]] = u.T
    speeds[stations, 3, tube.section_node[at]] = (u[:2] * tangent).sum(axis=0)
    weights = section.weights / section.weights.sum()
    fields = (section.at_points(speed)[0] for speed in speeds)
    return np.array([np.sum(weights * (field[:3] ** 2).sum(axis=0) * field[3]) for field in fields])


def bend_shift(
    *, reynolds: float, rotation_reynolds: float, angle: float, radius: float, with_rotation: bool = False
) -> float:
    """Loss coefficient of a bend in laminar flow, without the rotating friction of its arc.

    (64/Re) phi (r/d) (F(R') - F(R)) with the rotation R' of the straight tube in which liquid is driven aside
    as strongly: R' = R + (4/3) Re kappa d/2, from 2 omega' U = 2 omega U + mean(u^2) kappa, to first order;
    negative where the curvature outweighs the rotation.
    Args: `radius`: r/d, of the path. `with_rotation`: True if the path turns in the sense of the rotation.
    Returns: K, negative where the bend turns against a rotation that outweighs it.
    Range: R well above Re d/r; the stream's recovery behind the bend is left out.
    """
    curvature = (1.0 if with_rotation else -1.0) / radius
    shifted = rotation_reynolds + MOMENTUM_FACTOR * reynolds * curvature / 2
    ratios = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=[abs(shifted), rotation_reynolds])
    return float(64 / reynolds * angle * radius * (ratios.value[0] - ratios.value[1]))
