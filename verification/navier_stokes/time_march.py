"""Flow that changes in time: second-order backward differences, convection extrapolated from two steps.

    (3 u - 4 u' + u'')/(2 dt) + inertia (2 N' - N'') + rotation C u = -grad p + viscosity lap u + G e

div u = 0, N is convection and ' the step before.  One set of factors serves all steps.  Stable while a step
carries flow through less than about a third of a cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.linear import Factors, factorize
from ringbalance.verification.navier_stokes.system import Coefficients, FlowSystem


@dataclass(frozen=True, kw_only=True, eq=False)
class March:
    """A flow at constant flow rate over equal steps."""

    gradients: FloatArray
    """G of each step."""
    vector: FloatArray
    """All unknowns after the last."""

    def mean_gradient(self) -> float:
        """Mean of G over the second half of the steps."""
        return float(np.mean(self.gradients[-round(self.gradients.size / 2) :]))


def march_flow(
    *,
    system: FlowSystem,
    coefficients: Coefficients,
    flow_rate: float,
    start: FloatArray,
    step: float,
    steps: int,
) -> March:
    """Flow from a given one on, with the boundary values zero or those of `start`.

    Args: `start`: all unknowns. `step`: dt.
    Raises: ArithmeticError: the flow grew without bound; the step is too long.
    """
    free, border = system.free, system.flow_load[system.free]
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
        found[i] = (flow_rate - border @ change) / (border @ bordering)
        now, before = start.copy(), now
        now[free] = change + found[i] * bordering
        if not np.isfinite(found[i]) or np.abs(now).max() > 1e12:
            raise ArithmeticError("the flow grew without bound: take shorter steps")
    return March(gradients=found, vector=now)


def _mass(system: FlowSystem) -> Any:
    space = system.space
    entries, pattern = space.mass_entries(np.ones_like(space.weights)), space.velocity_pattern
    one = sparse.csr_matrix((entries, (pattern.rows, pattern.cols)), shape=(space.velocity_nodes,) * 2)
    nothing = sparse.csr_matrix((space.pressure_nodes,) * 2)
    return sparse.block_diag([one] * space.components + [nothing], format="csr")


def _factors(system: FlowSystem, coefficients: Coefficients, mass: Any, step: float) -> Factors:
    steady = system.free_matrix(system.linear_entries(coefficients))
    matrix = (steady + 1.5 / step * mass[:, system.free]).tocsc()
    quads = system.space.mesh.refdom.__name__ == "RefQuad"
    return factorize(matrix=matrix, along_diagonal=quads)
