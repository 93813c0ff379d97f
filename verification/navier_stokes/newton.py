"""Steady laminar flow by Newton's method with the exact Jacobian, and flows followed along a parameter.

The prescribed flow rate borders the matrix by one row and column, solved with a second right-hand side: a
dense row inside the matrix would ruin the sparse factors.  Eliminating along the diagonal keeps these three
to four times sparser than partial pivoting does, because fill-in gives the pressure block its diagonal in
time.  It is not safe by construction, so every solve checks its residual, refines it, and falls back on
partial pivoting when that does not help.  A path is followed with a secant predictor, and steps that recover
from failure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, FlowSystem

_EASY = 2.0
"""Parameter up to which a start from rest converges."""
_GOOD, _USABLE, _REFINEMENTS = 1e-12, 1e-8, 3


@dataclass(eq=False)
class Factors:
    """A matrix with its sparse factors; made by `Factors.of`."""

    matrix: Any
    factors: Any
    pivoted: bool

    @classmethod
    def of(cls, matrix: Any) -> Factors:
        """Factors of a square CSC matrix of symmetric pattern. Raises: RuntimeError: it is singular."""
        try:
            symmetric = {"SymmetricMode": True}
            factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
        except RuntimeError:
            return cls(matrix=matrix, factors=_with_pivoting(matrix), pivoted=True)
        return cls(matrix=matrix, factors=factors, pivoted=False)

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b, refined, with pivots if need be. Raises: RuntimeError: A is singular."""
        x, gap = _refined(self.matrix, self.factors, right)
        if gap > _USABLE and not self.pivoted:
            self.factors, self.pivoted = _with_pivoting(self.matrix), True
            x, gap = _refined(self.matrix, self.factors, right)
        return x


def _refined(matrix: Any, factors: Any, right: FloatArray) -> tuple[FloatArray, float]:
    """Solution with up to three refinements, and its relative residual."""
    scale = float(np.abs(right).max()) or 1.0
    x = np.asarray(factors.solve(right), dtype=np.float64)
    gap = np.inf
    for _ in range(_REFINEMENTS):
        residual = right - matrix @ x
        gap, before = float(np.abs(residual).max()) / scale, gap
        if gap <= _GOOD or not gap < before / 2:
            break
        x = x + factors.solve(residual)
    return x, gap if np.isfinite(gap) else np.inf


def _with_pivoting(matrix: Any) -> Any:
    return splu(matrix, permc_spec="COLAMD")


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
    factors = Factors.of(system.free_part(jacobian))
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


def _solution(system: FlowSystem, c: Coefficients, state: _Iteration, problem: str) -> FlowSolution:
    finite = np.all(np.isfinite(state.vector))
    vector = np.where(np.isfinite(state.vector), state.vector, 0.0)
    state.vector = _centred(system, vector) if system.enclosed else vector
    residual = _residual(system, c, system.linear_matrix(c), state)
    reaction = residual.copy()
    reaction[system.free] = 0.0
    scale = float(np.abs(reaction).max()) or 1.0
    velocity, pressure = system.space.split(state.vector)
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
            return _solution(system, still, state, problem)
        state.factors, state.update = None, np.inf
    else:
        vector = np.where(
            np.isin(np.arange(start.vector.size), system.free), start.vector, system.fixed_values
        )
        state = _Iteration(vector=vector, gradient=start.driving_gradient, progress=progress)
    problem = _iterate(system, coefficients, flow_rate, settings, state)
    return _solution(system, coefficients, state, problem)


Solve = Callable[[float, FlowSolution], FlowSolution]
FirstSolve = Callable[[float, FlowSolution | None], FlowSolution]


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """Steps in the parameter, in the parameter's own unit."""

    first: float = 1.0
    smallest: float = 1 / 64
    largest: float = float("inf")
    """Where several flows exist for one parameter, long steps can land on another branch."""
    growth: float = 1.6
    """Factor after an easy step; a failed step is halved."""
    easy_iterations: int = 6
    """Newton iterations up to which a step counts as easy."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _FlowPath:
    """Flows at the targets that were reached, in order."""

    solutions: tuple[FlowSolution, ...]
    status: Status
    failures: int
    """Steps that had to be repeated with half their length."""


@dataclass(eq=False)
class _Walk:
    """Where the path is: the last two flows and the present step."""

    at: float
    flow: FlowSolution
    step: float
    before: float | None = None
    flow_before: FlowSolution | None = None
    failures: int = 0


def _predicted(walk: _Walk, parameter: float) -> FlowSolution:
    if walk.flow_before is None or walk.before is None:
        return walk.flow
    share = (parameter - walk.at) / (walk.at - walk.before)
    vector = walk.flow.vector + share * (walk.flow.vector - walk.flow_before.vector)
    gradient = walk.flow.driving_gradient
    gradient += share * (gradient - walk.flow_before.driving_gradient)
    return replace(walk.flow, vector=vector, driving_gradient=gradient)


def _advance(walk: _Walk, solve: Solve, target: float, rule: StepRule) -> bool:
    """One step towards the target; false when even the smallest step fails."""
    remaining = target - walk.at
    full = min(walk.step, abs(remaining))
    # A sliver left over would make the secant through it worthless.
    full = abs(remaining) if abs(remaining) - full < 0.1 * full else full
    parameter = target if full == abs(remaining) else walk.at + full * (1 if remaining > 0 else -1)
    flow = solve(parameter, _predicted(walk, parameter))
    if not flow.status.ok:
        walk.failures += 1
        walk.step = full / 2
        return walk.step >= rule.smallest
    easy = flow.statistics.iterations <= rule.easy_iterations
    walk.before, walk.flow_before = walk.at, walk.flow
    walk.at, walk.flow = parameter, flow
    walk.step = min(max(walk.step, full) * (rule.growth if easy else 1.0), rule.largest)
    return True


def follow(
    *,
    solve: Solve,
    start: FlowSolution,
    start_at: float,
    targets: Sequence[float],
    rule: StepRule | None = None,
) -> _FlowPath:
    """Flows at the targets, each reached from the one before; a failed step is halved, an easy one grows.

    Args: `solve`: flow at a parameter from a predicted start. `start`: a converged flow. `start_at`: its
        parameter. `targets`: parameters to reach, in monotone order.
    Returns: The flows reached; the status says NOT_CONVERGED, and where, when a target was not reached.
    """
    rule = rule or StepRule()
    walk = _Walk(at=start_at, flow=start, step=rule.first)
    reached: list[FlowSolution] = []
    status = Status()
    for target in targets:
        while walk.at != target and _advance(walk, solve, target, rule):
            pass
        if walk.at != target:
            text = f"the path ended at {walk.at:.6g} on its way to {target:.6g}"
            remedy = "refine the mesh or take smaller steps"
            status = Status(code=StatusCode.NOT_CONVERGED, text=f"{text}; {remedy}")
            break
        reached.append(walk.flow)
    return _FlowPath(solutions=tuple(reached), status=status, failures=walk.failures)


def flow_at(*, solve: FirstSolve, parameter: float, first: float) -> FlowSolution:
    """Flow at a parameter, followed from where a start from rest converges. Raises: ArithmeticError: none."""
    flow = solve(min(parameter, _EASY), None)
    status = flow.status
    if parameter > _EASY and status.ok:
        rule = StepRule(first=first, smallest=0.02, largest=3.0)
        path = follow(solve=solve, start=flow, start_at=_EASY, targets=[parameter], rule=rule)
        flow, status = path.solutions[-1] if path.solutions else flow, path.status
    if not status.ok:
        raise ArithmeticError(f"the flow was not found: {status.text}")
    return flow
