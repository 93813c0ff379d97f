"""Steady laminar flow by finite elements: Newton's method with the exact Jacobian on a Taylor-Hood space.

The prescribed flow rate borders the matrix by one row and column, solved with a second right-hand side: a
dense row inside the matrix would ruin the sparse factors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.linear import Factors
from ringbalance.verification.navier_stokes.system import Coefficients, FlowSystem


@dataclass(frozen=True, kw_only=True)
class NewtonSettings:
    """When Newton's method stops, and when it keeps its factors."""

    tolerance: float = 1e-9
    """Largest change of a velocity over the largest velocity at which it has converged."""
    max_iterations: int = 20
    keep_factors_below: float = 1e-3
    """Relative change below which the next step reuses the factors: the contraction is then at least that."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSolution:
    """Velocity, pressure and reactions of a flow, with how the solve ended."""

    vector: FloatArray
    """Full vector of unknowns; a start for a neighbouring solve."""
    velocity: FloatArray
    """Nodal, shape (components, velocity nodes)."""
    pressure: FloatArray
    """Nodal, shape (pressure nodes,)."""
    reaction: FloatArray
    """Force of the surroundings on the fluid at a node, (components, velocity nodes); zero inside."""
    driving_gradient: float
    """G that drives the prescribed flow rate, 0 without one."""
    status: Status
    statistics: Statistics


@dataclass(eq=False)
class _Iteration:
    """Working state of one Newton solve."""

    vector: FloatArray
    gradient: float
    factors: Factors | None = None
    bordering: FloatArray | None = None
    update: float = np.inf
    contracting: bool = True
    """Whether the last step was well below the one before, so that old factors may serve once more."""
    iterations: int = 0
    factorizations: int = 0
    progress: Callable[[str], None] | None = None


def _residual(system: FlowSystem, c: Coefficients, linear: Any, state: _Iteration) -> FloatArray:
    residual = np.asarray(linear @ state.vector, dtype=np.float64)
    residual -= system.source + state.gradient * system.flow_load
    if c.inertia != 0.0:
        residual += c.inertia * system.convection_vector(state.vector)
    if system.enclosed:
        # A boundary flow that does not close in the discrete sense is spread evenly instead of
        # becoming a point source at the pinned node.
        mass = residual[-system.mean_load.size :]
        mass -= mass.sum() / system.mean_load.sum() * system.mean_load
    return residual


def _factorize(system: FlowSystem, c: Coefficients, linear: Any, state: _Iteration) -> Factors:
    jacobian = linear
    if c.inertia != 0.0:
        jacobian = linear + c.inertia * system.convection_matrix(state.vector)
    quads = system.space.mesh.refdom.__name__ == "RefQuad"
    layers = None if system.layers is None else system.layers[system.free]
    factors = Factors.of(matrix=system.free_part(jacobian), along_diagonal=quads, layers=layers)
    state.factorizations += 1
    if system.flow_component is not None:
        state.bordering = factors.solve(system.flow_load[system.free])
    return factors


def _step(
    system: FlowSystem, factors: Factors, residual: FloatArray, flow_rate: float, state: _Iteration
) -> None:
    change = factors.solve(-residual[system.free])
    if state.bordering is not None:
        border = system.flow_load[system.free]
        missing = flow_rate - float(system.flow_load @ state.vector)
        share = (missing - float(border @ change)) / float(border @ state.bordering)
        change += share * state.bordering
        state.gradient += share
    full = np.zeros_like(state.vector)
    full[system.free] = change
    state.vector = state.vector + full
    largest = float(np.abs(system.space.split(state.vector)[0]).max())
    moved = float(np.abs(system.space.split(full)[0]).max())
    before, state.update = state.update, moved / largest if largest > 0.0 else 0.0
    state.contracting = state.update < 0.1 * before
    state.iterations += 1
    if state.progress is not None:
        state.progress(f"Newton iteration {state.iterations}: relative change {state.update:.1e}")


def _iterate(
    system: FlowSystem, c: Coefficients, flow_rate: float, settings: NewtonSettings, state: _Iteration
) -> str:
    """Newton steps; returns an empty text on convergence, else what went wrong."""
    linear = system.linear_matrix(c)
    for _ in range(settings.max_iterations):
        residual = _residual(system, c, linear, state)
        keep = c.inertia == 0.0 or (state.update < settings.keep_factors_below and state.contracting)
        try:
            if state.factors is None or not keep:
                state.factors = _factorize(system, c, linear, state)
            _step(system, state.factors, residual, flow_rate, state)
        except RuntimeError as error:
            return f"the matrix could not be factorized ({error})"
        if not np.isfinite(state.update) or state.update > 1e8:
            return "the iteration diverged"
        if state.update <= settings.tolerance:
            return ""
    return f"no convergence in {settings.max_iterations} iterations (last relative change {state.update:.1e})"


def _status(problem: str) -> Status:
    if not problem:
        return Status()
    remedy = "start from the solution of a neighbouring, less convective case, or refine the mesh"
    return Status(code=StatusCode.NOT_CONVERGED, text=f"{problem}; {remedy}")


def _centred(system: FlowSystem, vector: FloatArray) -> FloatArray:
    """The same flow with a mean pressure of zero."""
    count = system.mean_load.size
    shifted = vector.copy()
    shifted[-count:] -= float(system.mean_load @ vector[-count:]) / float(system.mean_load.sum())
    return shifted


def _solution(
    system: FlowSystem, c: Coefficients, settings: NewtonSettings, state: _Iteration, problem: str
) -> FlowSolution:
    finite = np.all(np.isfinite(state.vector))
    vector = np.where(np.isfinite(state.vector), state.vector, 0.0)
    state.vector = _centred(system, vector) if system.enclosed else vector
    residual = _residual(system, c, system.linear_matrix(c), state)
    reaction = residual.copy()
    reaction[system.free] = 0.0
    scale = float(np.abs(reaction).max()) or 1.0
    velocity, pressure = system.space.split(state.vector)
    update = state.update if np.isfinite(state.update) else float(settings.max_iterations)
    return FlowSolution(
        vector=state.vector,
        velocity=velocity,
        pressure=pressure,
        reaction=system.space.split(reaction)[0],
        driving_gradient=state.gradient,
        status=_status(problem or ("" if finite else "the iteration diverged")),
        statistics=Statistics(
            unknowns=int(system.free.size),
            iterations=state.iterations,
            relative_residual=float(np.abs(residual[system.free]).max()) / scale,
            extra={
                "factorizations": float(state.factorizations),
                "pivoted": float(state.factors is not None and state.factors.pivoted),
                "relative_update": update,
            },
        ),
    )


def solve_flow(
    *,
    system: FlowSystem,
    coefficients: Coefficients,
    flow_rate: float = 0.0,
    start: FlowSolution | None = None,
    settings: NewtonSettings | None = None,
    progress: Callable[[str], None] | None = None,
) -> FlowSolution:
    """Steady flow of a system by Newton's method with the exact derivative, at first from the Stokes flow.

    Args: `flow_rate`: integral of the system's flow component over the domain; unused without one. `start`: a
        flow of the same system. `progress`: called with a short text on each iteration.
    Returns: The flow; its status says NOT_CONVERGED, with a remedy, when Newton's method failed.
    Raises: ValueError: viscosity not above zero, or a start of another system.
    """
    if not coefficients.viscosity > 0.0:
        raise ValueError("viscosity must be above zero")
    settings = settings or NewtonSettings()
    if start is not None and start.vector.size != system.space.unknowns:
        raise ValueError("start belongs to another system")
    if start is None:
        state = _Iteration(vector=system.fixed_values.copy(), gradient=0.0, progress=progress)
        still = Coefficients(inertia=0.0, viscosity=coefficients.viscosity, rotation=coefficients.rotation)
        problem = _iterate(system, still, flow_rate, settings, state)
        if problem or coefficients.inertia == 0.0:
            return _solution(system, still, settings, state, problem)
        state.factors, state.update = None, np.inf
    else:
        vector = np.where(
            np.isin(np.arange(start.vector.size), system.free), start.vector, system.fixed_values
        )
        state = _Iteration(vector=vector, gradient=start.driving_gradient, progress=progress)
    problem = _iterate(system, coefficients, flow_rate, settings, state)
    return _solution(system, coefficients, settings, state, problem)
