"""Laminar loss of a tube's two ends: entrance from a reservoir and exit into one, axisymmetric.

The tube ends flush in a plane wall with a sharp edge.  Lengths over the bore d, velocities over the mean
velocity U, pressure over mu U/d:

    Re (u . grad) u = -grad p + lap u,   div u = 0

Far away in the reservoir the surface is free of force at zero pressure (its side lets liquid through at right
angles only, where a jet leaves the tube); deep inside the tube the flow is
developed, so that p is a straight line of slope -32 there.  With that line carried on to the tube's end,

    K_ent  = 2 (p_reservoir - p_end)/(rho U^2)      (it contains the leaving stream's kinetic factor 2)
    K_exit = 2 (p_end - p_reservoir)/(rho U^2)

and K Re stays finite at Re = 0, where both ends have the same loss because creeping flow is reversible.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSpace, FlowSystem
from ringbalance.verification.navier_stokes.meshes import Patch, patch_mesh, with_midpoints
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, solve_flow

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
